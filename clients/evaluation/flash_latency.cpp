#include "clients/evaluation/flash_latency.hpp"

#include <numeric>

#include "clients/evaluation/statistics.hpp"

namespace tubed {

namespace {

constexpr std::size_t kMin = 10;  // flashes or periods, before a mean is told

double ms_between(std::int64_t from_ns, std::int64_t to_ns) {
  return 1e-6 * (static_cast<double>(to_ns) - static_cast<double>(from_ns));
}

}  // namespace

void FlashLatency::turn_white(std::int64_t shown_ns) {
  ++flashes_;
  shown_ns_ = shown_ns;
  is_white_ = true;
  is_ready_ = false;
}

void FlashLatency::turn_to_noise() {
  shown_ns_.reset();  // what has not answered by now never will
  is_white_ = false;
}

void FlashLatency::add(const FlashSample& sample) {
  if (sample.is_image_instant && sample.exposure_ns) {
    if (last_exposure_ns_ && *sample.exposure_ns > *last_exposure_ns_) {
      periods_ms_.push_back(ms_between(*last_exposure_ns_, *sample.exposure_ns));
    }
    last_exposure_ns_ = sample.exposure_ns;
  }
  if (!is_white_) {
    is_ready_ = is_ready_ || (sample.is_image_instant && !sample.is_rejected);
    return;
  }
  if (!shown_ns_ || !sample.is_rejected || sample.received_ns < *shown_ns_) {
    return;
  }
  to_shape_ms_.push_back(ms_between(*shown_ns_, sample.received_ns));
  if (sample.is_image_instant && sample.exposure_ns) {
    to_stamp_ms_.push_back(ms_between(*shown_ns_, *sample.exposure_ns));
  }
  shown_ns_.reset();
}

std::optional<double> FlashLatency::period_ms() const {
  return periods_ms_.size() < kMin ? std::nullopt : std::optional(quantile(periods_ms_, 0.5));
}

std::optional<double> FlashLatency::stamps_late_ms() const {
  const auto period = period_ms();
  if (!period || to_stamp_ms_.size() < kMin) {
    return std::nullopt;
  }
  const double mean = std::accumulate(to_stamp_ms_.begin(), to_stamp_ms_.end(), 0.0) /
                      static_cast<double>(to_stamp_ms_.size());
  return mean - *period / 2;
}

}  // namespace tubed
