// The seam between the pipeline and an EM tracker. A driver is one class with open, read and close.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <limits>

#include "drivers/interface/source.hpp"
#include "drivers/interface/timestamps.hpp"

namespace tubed {

inline constexpr int kMaxTrackerCoils = 16;

enum class CoilStatus { kMissing, kOk, kOutOfVolume, kDisabled };

/// One sensor of one measurement, in the tracker's frame. Pose is NaN unless the tracker gave one.
struct CoilSample {
  static constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  CoilStatus status = CoilStatus::kMissing;
  Eigen::Vector3d p_em_mm{kNaN, kNaN, kNaN};     ///< position
  Eigen::Vector3d tangent_em{kNaN, kNaN, kNaN};  ///< unit vector toward the catheter's tip
  /// Unit vector along the sensor's x axis, for a sensor of 6 degrees of freedom; means nothing for a 5-DOF
  /// coil, whose roll is arbitrary. NaN where a tracker says no more than the axis.
  Eigen::Vector3d x_axis_em{kNaN, kNaN, kNaN};
  double indicator = 0;  ///< the tracker's own quality figure, unit-less
};

/// All coils of one measurement; coil i is the tracker's sensor i + 1.
struct EmFrame {
  MonotonicTime measured{};         ///< when the tracker measured (not when the reply arrived)
  MonotonicTime received{};         ///< when the host had it
  std::uint32_t tracker_frame = 0;  ///< the tracker's own frame number
  Origin origin = Origin::kDevice;
  int coil_count = 0;
  std::array<CoilSample, kMaxTrackerCoils> coils;
};

/// An EM tracker. All calls come from the EM acquisition thread: open(), then read() until it gives kNothing,
/// wait(), read() again.
class EmSource {
 public:
  virtual ~EmSource() = default;
  EmSource() = default;
  EmSource(const EmSource&) = delete;
  EmSource& operator=(const EmSource&) = delete;

  /// Connects. May allocate and take seconds. Called again after kLost, after close().
  virtual OpenResult open() = 0;
  /// Sleeps until read() may have something to do (something has come, a question is due, a device is to be
  /// looked for), but not beyond `deadline`; may come back early. Takes nothing from the device and sends
  /// nothing. Nothing ends it from outside: a thread that may be asked to stop gives near deadlines. Never
  /// allocates, locks, logs or throws.
  virtual void wait(MonotonicTime deadline) noexcept = 0;
  /// Takes the next measurement that has come, without waiting for one. Never allocates, locks, logs or
  /// throws.
  virtual ReadOutcome read(EmFrame& frame) noexcept = 0;
  /// Lets go of the device; harmless when not open.
  virtual void close() noexcept = 0;
};

}  // namespace tubed
