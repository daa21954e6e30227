// What the emulated tracker measures, as a plain function that the caller provides.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "drivers/aurora/tracking_reply.hpp"
#include "drivers/interface/em_source.hpp"

namespace tubed::aurora::emulator {

/// Coils of one measurement in the tracker's frame; coil i is sensor i + 1. Beyond the last one: missing.
using MeasuredCoils = std::array<CoilSample, kMaxTrackerCoils>;

/// Where the coils are when measurement number `measurement` is taken at `time`. Called once a measurement,
/// in order, by the thread that runs the emulator; numbers are left out while the tracker stands still.
using Motion = std::function<MeasuredCoils(std::uint64_t measurement, MonotonicTime time)>;

/// One row of a recording.
struct RecordedCoils {
  double t_s = 0;  ///< on the recording's own clock
  MeasuredCoils coils;
};

/// Plays a recording: the row that was the newest at that time, which begins at `start` with the first row
/// and begins again one row's time after the last. Throws std::invalid_argument for rows that are none or not
/// in the order of time.
[[nodiscard]] Motion play_recording(std::vector<RecordedCoils> rows, MonotonicTime start);

/// The shortest turn that brings +z to `axis` (a unit vector, em frame): qz = 0 and q0 not negative, as an
/// Aurora sends it for a coil with five degrees of freedom.
[[nodiscard]] Quaternion min_rotation(const Eigen::Vector3d& axis) noexcept;

}  // namespace tubed::aurora::emulator
