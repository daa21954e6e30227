// What a tracker says of a probe: a sensor in a stick with a tip.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <vector>

namespace tubed {

/// One measurement. z of the sensor points toward the tip; of a 5-DOF coil the turn about it means nothing.
struct ProbePose {
  std::uint32_t frame = 0;  ///< the tracker's own count
  bool is_seen = true;      ///< false: no pose
  Eigen::Vector3d p_em_mm = Eigen::Vector3d::Zero();
  Eigen::Quaterniond q_em_probe = Eigen::Quaterniond::Identity();

  [[nodiscard]] Eigen::Vector3d axis_em() const { return q_em_probe * Eigen::Vector3d::UnitZ(); }
};

/// What a probe's sensor is taken as.
enum class ProbeFreedom { kFive = 5, kSix = 6 };

/// Reads one sensor of a file with the columns of em.csv, sequence folder format 1 (t_s, em_frame, sensor,
/// status, x, y, z, tx, ty, tz, qw, qx, qy, qz): 5 degrees of freedom from the tangent, 6 from the
/// quaternion. Only rows that are OK. Throws MarkerFileError "FILE:LINE:COLUMN: ..." for whatever the format
/// forbids, a sensor without rows, a tangent or quaternion that is not of length 1, and for 6 degrees of
/// freedom when no row has a turn about its axis: then the sensor is a 5-DOF coil.
std::vector<ProbePose> read_probe_poses(const std::filesystem::path& file, int sensor, ProbeFreedom freedom);

}  // namespace tubed
