#include "drivers/aurora/tracking_reply.hpp"

#include <algorithm>
#include <cmath>

namespace tubed::aurora {

namespace {

constexpr double kLengthTolerance = 0.002;
constexpr double kFarthest_mm = 10'000;

double squared_norm(const Quaternion& q) noexcept {
  return q.q0 * q.q0 + q.qx * q.qx + q.qy * q.qy + q.qz * q.qz;
}

bool has_frame(Report report) noexcept {
  return report != Report::kDisabled && report != Report::kUnoccupied;
}

}  // namespace

bool plausible_pose(const HandleReading& reading) noexcept {
  // A comparison with NaN is false.
  return std::abs(std::sqrt(squared_norm(reading.rotation)) - 1) < kLengthTolerance &&
         std::abs(reading.p_em_mm.x()) < kFarthest_mm && std::abs(reading.p_em_mm.y()) < kFarthest_mm &&
         std::abs(reading.p_em_mm.z()) < kFarthest_mm && std::isfinite(reading.indicator);
}

void settle_pose(HandleReading& reading) noexcept {
  if (reading.report == Report::kValid && plausible_pose(reading)) {
    return;
  }
  const HandleReading without_pose;
  reading.report = reading.report == Report::kValid ? Report::kImplausible : reading.report;
  reading.rotation = without_pose.rotation;
  reading.p_em_mm = without_pose.p_em_mm;
  reading.indicator = without_pose.indicator;
}

std::optional<std::uint32_t> common_frame(const TrackingReply& reply) noexcept {
  for (const Report report : {Report::kValid, Report::kMissing}) {
    std::optional<std::uint32_t> frame;
    for (const HandleReading& reading : reply.readings()) {
      if (reading.report != report) {
        continue;
      }
      if (frame && *frame != reading.frame) {
        return std::nullopt;
      }
      frame = reading.frame;
    }
    if (frame) {
      return frame;
    }
  }
  return std::nullopt;
}

bool lists_exactly(const TrackingReply& reply, std::span<const std::uint8_t> handles) noexcept {
  const auto times = [&reply](std::uint8_t handle) {
    const auto readings = reply.readings();
    return std::count_if(readings.begin(), readings.end(),
                         [handle](const HandleReading& reading) { return reading.handle == handle; });
  };
  return reply.readings().size() == handles.size() &&
         std::all_of(handles.begin(), handles.end(),
                     [&times](std::uint8_t handle) { return times(handle) == 1; });
}

Eigen::Vector3d coil_axis(const Quaternion& rotation, AxisSense sense) noexcept {
  const auto& [q0, qx, qy, qz] = rotation;
  const Eigen::Vector3d axis(2 * (qx * qz + q0 * qy), 2 * (qy * qz - q0 * qx),
                             q0 * q0 - qx * qx - qy * qy + qz * qz);
  const Eigen::Vector3d unit = axis / squared_norm(rotation);
  return sense == AxisSense::kReversed ? Eigen::Vector3d(-unit) : unit;
}

Eigen::Vector3d sensor_x_axis(const Quaternion& rotation) noexcept {
  const auto& [q0, qx, qy, qz] = rotation;
  const Eigen::Vector3d axis(q0 * q0 + qx * qx - qy * qy - qz * qz, 2 * (qx * qy + q0 * qz),
                             2 * (qx * qz - q0 * qy));
  return axis / squared_norm(rotation);
}

CoilStatus coil_status(Report report, PortStatus port) noexcept {
  if (!has_frame(report)) {
    return CoilStatus::kDisabled;
  }
  if (report == Report::kImplausible || port.coil_broken() || port.processing_exception()) {
    return CoilStatus::kMissing;
  }
  if (port.out_of_volume() || port.partly_out_of_volume()) {
    return CoilStatus::kOutOfVolume;
  }
  return report == Report::kValid ? CoilStatus::kOk : CoilStatus::kMissing;
}

CoilSample coil_sample(const HandleReading& reading) noexcept {
  CoilSample sample;
  sample.status = coil_status(reading.report, reading.port_status);
  const bool usable = sample.status == CoilStatus::kOk || sample.status == CoilStatus::kOutOfVolume;
  if (usable && reading.report == Report::kValid) {
    sample.p_em_mm = reading.p_em_mm;
    sample.tangent_em = coil_axis(reading.rotation);
    sample.x_axis_em = sensor_x_axis(reading.rotation);
    sample.indicator = reading.indicator;
  }
  return sample;
}

}  // namespace tubed::aurora
