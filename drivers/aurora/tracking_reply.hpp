// What a TX or BX reply says: every enabled handle with its pose, and the tracker's state. Both encodings
// give the same struct. Any thread; no allocation.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>

#include "drivers/aurora/status.hpp"
#include "drivers/interface/em_source.hpp"

namespace tubed::aurora {

/// Handles we can hold: two coils on each of 16 ports.
inline constexpr int kMaxHandles = 32;

/// What a reply has about one handle.
enum class Report {
  kValid,        ///< a pose
  kMissing,      ///< no pose: the coil is not seen
  kDisabled,     ///< the handle is not tracked
  kUnoccupied,   ///< nothing is plugged in there any more (text replies only)
  kImplausible,  ///< a pose that no coil can have: see plausible_pose()
};

/// Rotation of a coil as sent. Of a 5-DOF coil only the axis means something: use coil_axis(), never average.
struct Quaternion {
  double q0 = 1;
  double qx = 0;
  double qy = 0;
  double qz = 0;
};

/// One handle of one measurement. Pose and indicator are NaN unless `report` is kValid.
struct HandleReading {
  static constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  std::uint8_t handle = 0;
  Report report = Report::kMissing;
  Quaternion rotation{kNaN, kNaN, kNaN, kNaN};
  Eigen::Vector3d p_em_mm{kNaN, kNaN, kNaN};
  double indicator = kNaN;  ///< the tracker's own quality figure, unit-less
  PortStatus port_status;   ///< 0 for disabled and unoccupied handles
  std::uint32_t frame = 0;  ///< the tracker's counter; 0 for disabled and unoccupied handles
};

/// One reply. Everything beyond `handle_count` is left over from before.
struct TrackingReply {
  int handle_count = 0;
  std::array<HandleReading, kMaxHandles> handles;
  SystemStatus system_status;

  [[nodiscard]] std::span<const HandleReading> readings() const noexcept {
    return {handles.data(), static_cast<std::size_t>(handle_count)};
  }
};

/// Whether rotation, position and indicator are finite, the quaternion is of unit length (within 0.2 %) and
/// the position within 10 m. A damaged reply that its check sum lets through mostly fails here.
[[nodiscard]] bool plausible_pose(const HandleReading& reading) noexcept;

/// `reading` as it has to be handed on: without its pose, as kImplausible, unless plausible_pose().
void settle_pose(HandleReading& reading) noexcept;

/// Frame number that all handles with a pose share or, when none has a pose, all missing ones; nothing when
/// they differ or there are none. An Aurora measures all coils at once.
[[nodiscard]] std::optional<std::uint32_t> common_frame(const TrackingReply& reply) noexcept;

/// Whether the reply has each of `handles` once and no other: what it should be while those are enabled.
[[nodiscard]] bool lists_exactly(const TrackingReply& reply, std::span<const std::uint8_t> handles) noexcept;

/// Which way the asked-for axis points: a coil may be mounted the other way round along the catheter.
enum class AxisSense { kAsMeasured, kReversed };

/// Unit vector along a coil: the image of +z under `rotation`, whose length does not matter but is not 0.
[[nodiscard]] Eigen::Vector3d coil_axis(const Quaternion& rotation,
                                        AxisSense sense = AxisSense::kAsMeasured) noexcept;

/// Unit vector along the x axis of a sensor of 6 degrees of freedom: the image of +x.
[[nodiscard]] Eigen::Vector3d sensor_x_axis(const Quaternion& rotation) noexcept;

/// State of a coil from what the reply says and the port's bits. Broken coils and processing exceptions are
/// missing whatever pose came with them; partly out of the volume is out of it.
[[nodiscard]] CoilStatus coil_status(Report report, PortStatus port) noexcept;

/// The coil as the daemon takes it: with a pose when it is OK, or out of the volume and the tracker gave one.
/// The tangent is the axis as measured: InstrumentDescription says which coils are flipped, and the estimator
/// turns those round.
[[nodiscard]] CoilSample coil_sample(const HandleReading& reading) noexcept;

}  // namespace tubed::aurora
