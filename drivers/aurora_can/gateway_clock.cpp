#include "drivers/aurora_can/gateway_clock.hpp"

#include <algorithm>
#include <limits>

namespace tubed {

namespace {

constexpr std::int64_t kUnknown = std::numeric_limits<std::int64_t>::max();
constexpr std::int64_t kNsPerUs = 1000;

}  // namespace

void GatewayClock::observe(std::uint32_t sent_us, MonotonicTime received) noexcept {
  if (!known_) {
    known_ = true;
    last_us_ = sent_us;
    last_ns_ = 0;
    min_ns_.fill(kUnknown);
    bucket_ends_ = received + kBucket;
  }
  last_ns_ = unwrapped_ns(sent_us);
  last_us_ = sent_us;
  for (std::size_t moved = 0; received >= bucket_ends_ && moved < kBuckets; ++moved) {
    bucket_ = (bucket_ + 1) % kBuckets;
    min_ns_[bucket_] = kUnknown;
    bucket_ends_ += kBucket;
  }
  bucket_ends_ = std::max(bucket_ends_, received);  // after a longer silence
  min_ns_[bucket_] = std::min(min_ns_[bucket_], to_ns(received) - last_ns_);
}

MonotonicTime GatewayClock::at(std::uint32_t time_us, MonotonicTime received) noexcept {
  if (!known_) {
    return received;
  }
  const MonotonicTime time = from_ns(unwrapped_ns(time_us) + min_difference_ns());
  if (time <= received && received - time <= kMaxDelay) {
    return time;
  }
  ++disbelieved_;
  reset();
  return received;
}

std::int64_t GatewayClock::unwrapped_ns(std::uint32_t time_us) const noexcept {
  return last_ns_ + kNsPerUs * static_cast<std::int32_t>(time_us - last_us_);
}

std::int64_t GatewayClock::min_difference_ns() const noexcept {
  return *std::min_element(min_ns_.begin(), min_ns_.end());
}

}  // namespace tubed
