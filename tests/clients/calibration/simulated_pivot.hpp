// Turning a probe about its tip, whose truth is known.
#pragma once

#include <cmath>
#include <numbers>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "clients/calibration/probe_pose.hpp"
#include "idl/geometry/rigid_transform.hpp"
#include "tests/clients/calibration/simulated_markers.hpp"

namespace tubed {

inline constexpr double kDeg = std::numbers::pi / 180;
inline const Eigen::Vector3d kPivot_em_mm(40, -30, 120);

/// A probe that is turned about its tip: leaned by up to so much to all sides, and spun.
struct PivotMovement {
  Eigen::Vector3d tip_offset_mm{0, 0, 98};
  double lean_deg = 40;
  double sigma_position_mm = 0.5;
  double sigma_angle_deg = 0.4;
  int count = 400;

  [[nodiscard]] std::vector<ProbePose> poses(std::mt19937& random, ProbeFreedom freedom) const {
    std::uniform_real_distribution<double> uniform(0, 1);
    std::vector<ProbePose> all;
    for (int i = 0; i < count; ++i) {
      const double lean = lean_deg * kDeg * std::sqrt(uniform(random));
      const double side = 2 * std::numbers::pi * uniform(random);
      const double spin = 2 * std::numbers::pi * uniform(random);
      const Eigen::Quaterniond turned =
          Eigen::AngleAxisd(lean, Eigen::Vector3d(std::cos(side), std::sin(side), 0)) *
          Eigen::AngleAxisd(spin, Eigen::Vector3d::UnitZ());
      const Eigen::Vector3d wrong = normal_vector(random, sigma_angle_deg * kDeg);
      ProbePose pose;
      pose.frame = static_cast<std::uint32_t>(i + 1);
      pose.p_em_mm = kPivot_em_mm - turned * tip_offset_mm + normal_vector(random, sigma_position_mm);
      pose.q_em_probe = turned * Eigen::AngleAxisd(wrong.norm(), wrong.normalized());
      if (freedom == ProbeFreedom::kFive) pose.q_em_probe = rotation_from_z_to(pose.axis_em());
      all.push_back(pose);
    }
    return all;
  }
};

/// The poses of sensor 1 as em.csv has them.
inline std::string em_csv(const std::vector<ProbePose>& poses) {
  std::ostringstream text;
  text.precision(12);
  text << "t_s,em_frame,sensor,status,x,y,z,tx,ty,tz,qw,qx,qy,qz,error\n";
  for (const ProbePose& pose : poses) {
    const Eigen::Vector3d& p_mm = pose.p_em_mm;
    const Eigen::Vector3d t = pose.axis_em();
    const Eigen::Quaterniond& q = pose.q_em_probe;
    text << pose.frame * 0.025 << ',' << pose.frame << ",1,OK," << p_mm.x() << ',' << p_mm.y() << ','
         << p_mm.z() << ',' << t.x() << ',' << t.y() << ',' << t.z() << ',' << q.w() << ',' << q.x() << ','
         << q.y() << ',' << q.z() << ",0.1\n";
  }
  return text.str();
}

}  // namespace tubed
