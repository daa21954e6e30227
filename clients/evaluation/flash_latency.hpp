// From a flash on a screen to the shape that says so: what `tubectl latency --glass` counts. Pure: clocks
// come as values.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

namespace tubed {

/// What of a sample matters here.
struct FlashSample {
  std::int64_t received_ns = 0;  ///< of this host's CLOCK_MONOTONIC
  bool is_image_instant = false;
  bool is_rejected = false;  ///< IMAGE_REJECTED: the newest image was no X-ray image, as a white one is not
  /// What the image is stamped with, on this host's CLOCK_MONOTONIC; nothing where the daemon runs elsewhere.
  std::optional<std::int64_t> exposure_ns{};
};

/// A screen shows noise, which is taken for an image, and at times white, which is refused. Each change to
/// white is a flash; the first sample that refuses it afterwards answers it.
class FlashLatency {
 public:
  /// The screen has just become white at `shown_ns`, or noise again.
  void turn_white(std::int64_t shown_ns);
  void turn_to_noise();
  void add(const FlashSample& sample);

  /// May the screen flash: has an image of noise been taken since the last flash?
  [[nodiscard]] bool is_ready() const { return is_ready_; }
  /// Is a flash waiting for its answer?
  [[nodiscard]] bool is_waiting() const { return shown_ns_.has_value(); }

  /// ms from the flash to the sample, one a flash that was answered.
  [[nodiscard]] const std::vector<double>& to_shape_ms() const { return to_shape_ms_; }
  /// ms from the flash to the stamp of the image that showed it.
  [[nodiscard]] const std::vector<double>& to_stamp_ms() const { return to_stamp_ms_; }
  [[nodiscard]] int flashes() const { return flashes_; }

  /// By how much the stamps are late against the light, ms: the mean of to_stamp_ms() less half the time
  /// between images, since a flash waits that long for the next exposure in the mean. What [[camera]]
  /// time_offset_ms should become greater by. Nothing before ten flashes, or without stamps or a period.
  [[nodiscard]] std::optional<double> stamps_late_ms() const;
  /// Median time from one image instant to the next, ms; nothing before ten.
  [[nodiscard]] std::optional<double> period_ms() const;

 private:
  std::optional<std::int64_t> shown_ns_;
  bool is_white_ = false;
  bool is_ready_ = false;
  int flashes_ = 0;
  std::vector<double> to_shape_ms_, to_stamp_ms_;
  std::optional<std::int64_t> last_exposure_ns_;
  std::vector<double> periods_ms_;
};

}  // namespace tubed
