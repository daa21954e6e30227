#include "idl/shm_reader.hpp"

#include <algorithm>

namespace tubed {

namespace {

std::string content_words(std::uint32_t content, std::uint32_t version) {
  const char* what = content == TUBED_SHM_ESTIMATES ? "estimates"
                     : content == TUBED_SHM_IMAGES  ? "images"
                                                    : "something";
  return std::string(what) + " of version " + std::to_string(version);
}

/// later - earlier of numbers that a writer may have made up: wraps instead of overflowing.
std::int64_t difference(std::int64_t later, std::int64_t earlier) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(later) - static_cast<std::uint64_t>(earlier));
}

}  // namespace

ShmReader::ShmReader(const ShmReaderSettings& settings)
    : ShmReader(fetch_descriptor(settings.path, settings.timeout_ms, settings.trusted), settings) {}

ShmReader::ShmReader(int descriptor, const ShmReaderSettings& settings)
    : segment_(ShmSegment::adopt(descriptor, settings.max_segment_bytes)),
      ring_(segment_.memory(), segment_.bytes()),
      taken_(ring_.newest()) {
  const ShmIdentity& identity = ring_.identity();
  const std::uint32_t oldest =
      settings.oldest_content_version > 0 ? settings.oldest_content_version : settings.content_version;
  if (identity.content != settings.content || identity.content_version > settings.content_version ||
      identity.content_version < oldest) {
    throw ShmError("the writer at '" + settings.path + "' publishes " +
                   content_words(identity.content, identity.content_version) + ", expected " +
                   content_words(settings.content, settings.content_version));
  }
}

ShmNews ShmReader::news(std::int64_t now_ns) const noexcept {
  if (ring_.newest() > taken_) {
    return ShmNews::kSample;
  }
  if (ring_.has_ended()) {
    // Once more: the last sample may have come between the two looks. tests/models/shm_wake.pml.
    return ring_.newest() > taken_ ? ShmNews::kSample : ShmNews::kEnded;
  }
  const std::int64_t silence_ns = difference(now_ns, ring_.heartbeat_ns());
  // A heartbeat of the future is no sign of life either: it could never grow old.
  return silence_ns > TUBED_SHM_SILENCE_NS || silence_ns < -TUBED_SHM_SILENCE_NS ? ShmNews::kSilent
                                                                                 : ShmNews::kNone;
}

void ShmReader::sleep_until(std::int64_t deadline_ns) const noexcept {
  // How long until silence begins, were it now the deadline; a heartbeat from nowhere shortens nothing.
  const std::int64_t spare_ns = difference(deadline_ns, ring_.heartbeat_ns()) - TUBED_SHM_SILENCE_NS - 1;
  ring_.wait(taken_, spare_ns > 0 && spare_ns < deadline_ns ? deadline_ns - spare_ns : deadline_ns);
}

std::uint64_t ShmReader::oldest() const noexcept {
  const std::uint64_t newest = ring_.newest();
  // The slot after the newest one is the next to be overwritten, perhaps now: it does not count.
  const std::uint64_t kept = ring_.geometry().slot_count - 1;
  return newest > kept ? newest - kept + 1 : 1;
}

ShmSample ShmReader::take_next() noexcept { return take(std::max(taken_ + 1, oldest())); }

ShmSample ShmReader::take(std::uint64_t number) noexcept {
  lost_ += number > taken_ ? number - taken_ - 1 : 0;
  taken_ = number;
  return ring_.look(number);
}

}  // namespace tubed
