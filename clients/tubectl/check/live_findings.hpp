// Does what a running daemon publishes fit the room that is described to it?
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "EmSamples.h"
#include "TubeHealth.h"
#include "TubeIdentity.h"
#include "TubeStatus.h"
#include "clients/evaluation/recording_check.hpp"

namespace tubed {

/// Gathers the slow topics of one instrument and says what a recording's check would say of them. Judges by
/// seconds: each TubeHealth counts the newest TubeStatus.
class LiveFindings {
 public:
  void take(const tubed_TubeIdentity& identity) { identity_ = identity; }
  /// Keeps kMaxMeasurements at most, the newest.
  void take(const tubed_EmSamples& samples);
  void take(const tubed_TubeStatus& status) { status_ = status; }
  void take(const tubed_TubeHealth& health);

  /// Reports of health that have come.
  [[nodiscard]] int seconds() const { return seconds_; }

  /// Whether there are shapes and one writer, directions and distances of the coils, the tube in the images,
  /// registration, arc lengths, clock, focal length, coils, view.
  [[nodiscard]] std::vector<RecordingFinding> findings() const;

 private:
  static constexpr std::size_t kMaxMeasurements = 4096;

  [[nodiscard]] double share(int times) const { return seconds_ > 0 ? 1.0 * times / seconds_ : 0; }
  static constexpr double kSomeImages = 0.3;  // share of the seconds, to judge what images show

  [[nodiscard]] bool has_images() const { return share(seconds_ - without_image_) >= kSomeImages; }
  [[nodiscard]] RecordingFinding shapes() const;
  [[nodiscard]] RecordingFinding tube_in_images() const;
  [[nodiscard]] RecordingFinding view() const;
  void add_coils(std::vector<RecordingFinding>& findings) const;
  void add_agreement(std::vector<RecordingFinding>& findings) const;

  std::optional<tubed_TubeIdentity> identity_;
  std::optional<tubed_TubeStatus> status_;
  std::optional<tubed_TubeHealth> health_;
  std::vector<SequenceMeasurement> measurements_;
  std::size_t next_measurement_ = 0;
  int seconds_ = 0;
  int without_image_ = 0;  ///< seconds, as the next four
  int lost_ = 0;
  int moved_ = 0;
  int rivalled_ = 0;
  int without_shape_ = 0;
  std::string why_none_;  ///< reasons of the newest of those
};

}  // namespace tubed
