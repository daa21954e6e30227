#include "clients/calibration/probe_pose.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <string>

#include "clients/markers/marker_file.hpp"
#include "drivers/csv/csv_reader.hpp"
#include "idl/geometry/rigid_transform.hpp"

namespace tubed {

namespace {

enum Column : std::size_t { kFrame, kSensor, kStatus, kX, kY, kZ, kTx, kTy, kTz, kQw, kQx, kQy, kQz };

constexpr double kLengthTolerance = 0.02;  // a person writes three decimals
constexpr double kSameTurn_rad = 1e-3;

Eigen::Vector3d vector_of(const CsvReader& csv, std::size_t first) {
  return {csv.number(first), csv.number(first + 1), csv.number(first + 2)};
}

void demand_unit_length(const CsvReader& csv, std::size_t column, double length) {
  if (std::abs(length - 1) > kLengthTolerance) {
    csv.refuse(column, "the length is " + std::to_string(length) + ", expected 1");
  }
}

ProbePose pose_of(const CsvReader& csv, ProbeFreedom freedom) {
  ProbePose pose{csv.count(kFrame), true, vector_of(csv, kX), {}};
  if (freedom == ProbeFreedom::kFive) {
    const Eigen::Vector3d tangent = vector_of(csv, kTx);
    demand_unit_length(csv, kTx, tangent.norm());
    pose.q_em_probe = rotation_from_z_to(tangent);
  } else {
    const Eigen::Vector3d imaginary = vector_of(csv, kQx);
    const Eigen::Quaterniond q(csv.number(kQw), imaginary.x(), imaginary.y(), imaginary.z());
    demand_unit_length(csv, kQw, q.norm());
    pose.q_em_probe = q.normalized();
  }
  return pose;
}

bool has_no_turn(const ProbePose& pose) {
  return pose.q_em_probe.angularDistance(rotation_from_z_to(pose.axis_em())) < kSameTurn_rad;
}

std::vector<ProbePose> read(const std::filesystem::path& file, std::uint32_t sensor, ProbeFreedom freedom) {
  CsvReader csv(file,
                {"em_frame", "sensor", "status", "x", "y", "z", "tx", "ty", "tz", "qw", "qx", "qy", "qz"});
  std::set<std::uint32_t> others;
  std::vector<ProbePose> poses;
  std::size_t rows = 0;
  while (csv.next_row()) {
    if (csv.count(kSensor) != sensor) {
      others.insert(csv.count(kSensor));
      continue;
    }
    ++rows;
    if (csv.text(kStatus) == "OK") poses.push_back(pose_of(csv, freedom));
  }
  if (poses.empty()) {
    std::string there;
    for (const std::uint32_t other : others) there += (there.empty() ? "" : ", ") + std::to_string(other);
    throw MarkerFileError(
        file.string() + ": sensor " + std::to_string(sensor) +
        (rows > 0 ? " is never OK in it" : " is not in it") +
        (there.empty() ? "; there is no row of any other" : "; there are rows of " + there));
  }
  return poses;
}

}  // namespace

std::vector<ProbePose> read_probe_poses(const std::filesystem::path& file, int sensor, ProbeFreedom freedom) {
  if (!std::filesystem::is_regular_file(file)) {
    throw MarkerFileError(file.string() + ": there is no such file");
  }
  try {
    auto poses = read(file, static_cast<std::uint32_t>(sensor), freedom);
    if (freedom == ProbeFreedom::kSix && std::all_of(poses.begin(), poses.end(), has_no_turn)) {
      throw MarkerFileError(file.string() + ": no quaternion of sensor " + std::to_string(sensor) +
                            " has a turn about its axis: it is a 5-DOF coil, use --dof 5");
    }
    return poses;
  } catch (const SequenceError& error) {
    throw MarkerFileError(error.what());
  }
}

}  // namespace tubed
