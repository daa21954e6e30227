// What coils measured over some time, from a sequence folder or from a running daemon.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "drivers/replay/sequence_folder.hpp"

namespace tubed {

/// What was recorded does not tell what was asked; says what to do.
class CalibrationError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// All measurements of one instrument, in the tracker's frame. Coil i of the instrument is the sample of its
/// `sensor`, as in a sequence folder.
struct CoilRecording {
  std::string from;  ///< "still1", "a daemon in domain 0": for messages
  InstrumentDescription instrument;
  std::vector<SequenceMeasurement> measurements;  ///< ordered by time
};

/// The coils of a folder.
CoilRecording coils_of(const Sequence& sequence);

/// The sample of that coil; nullptr unless the tracker says it is good and its numbers are finite.
const CoilSample* sample_of(const SequenceMeasurement& measurement, const CoilPlacement& coil);

/// Throws CalibrationError for a recording shorter than `min_s`: too short, or its time stamps stand still.
void require_time(const CoilRecording& recording, double min_s);

/// Where one coil was, over time, smoothed.
class CoilTrack {
 public:
  /// Of coil `index` of the instrument; the direction is that toward the tip, however it is mounted.
  CoilTrack(const std::vector<SequenceMeasurement>& measurements, const CoilPlacement& coil);

  struct Place {
    Eigen::Vector3d p_em_mm;
    Eigen::Vector3d toward_tip_em;  ///< unit
    Eigen::Vector3d velocity_mm_s;
    int averaged = 1;  ///< how many measurements are in it
  };
  /// A straight line in time through what was measured within `half_window_s` of t; between the two
  /// neighbours where the window holds fewer than two. Nothing where no measurement lies within 0.3 s to
  /// either side.
  [[nodiscard]] std::optional<Place> at(double t_s, double half_window_s) const;

  [[nodiscard]] std::size_t size() const { return t_s_.size(); }
  [[nodiscard]] double begins_s() const { return t_s_.empty() ? 0 : t_s_.front(); }
  [[nodiscard]] double ends_s() const { return t_s_.empty() ? 0 : t_s_.back(); }

 private:
  std::vector<double> t_s_;
  std::vector<Eigen::Vector3d> p_em_mm_;
  std::vector<Eigen::Vector3d> toward_tip_em_;
};

}  // namespace tubed
