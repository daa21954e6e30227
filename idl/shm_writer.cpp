#include "idl/shm_writer.hpp"

#include <random>

namespace tubed {

namespace {

ShmIdentity with_start(ShmIdentity identity) {
  std::random_device entropy;
  identity.writer_start = (static_cast<std::uint64_t>(entropy()) << 32U) | entropy() | 1U;
  return identity;
}

}  // namespace

ShmWriter::ShmWriter(const ShmWriterSettings& settings, std::int64_t now_ns)
    : segment_(ShmSegment::create("tubed", settings.geometry.segment_bytes())),
      waking_(settings.waking),
      ring_(segment_.memory(), settings.geometry, with_start(settings.identity), now_ns),
      door_(settings.door) {}

ShmWriter::~ShmWriter() { ring_.end(); }

std::uint64_t ShmWriter::commit(std::size_t payload_bytes, std::int64_t now_ns) noexcept {
  const std::uint64_t number = ring_.commit(payload_bytes, now_ns);
  if (waking_ == ShmWaking::kAll && ring_.leaves_sleepers()) {
    ring_.wake_sleepers();
  }
  door_.serve(segment_.descriptor(), now_ns);  // after the sample is out
  return number;
}

std::uint64_t ShmWriter::publish(std::span<const std::byte> payload, std::int64_t now_ns) noexcept {
  ring_.begin();
  ring_.write(0, payload);
  return commit(payload.size(), now_ns);
}

void ShmWriter::beat(std::int64_t now_ns) noexcept {
  ring_.beat(now_ns);
  door_.serve(segment_.descriptor(), now_ns);
}

}  // namespace tubed
