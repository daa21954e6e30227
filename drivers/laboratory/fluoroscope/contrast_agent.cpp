#include "drivers/laboratory/fluoroscope/contrast_agent.hpp"

#include <algorithm>
#include <cmath>

namespace tubed {

double agent_concentration(const LumenSettings& lumen, double u_mm, double age_s) {
  constexpr double kFront_s = 0.25;
  constexpr double kThinning_mm = 350;
  const double since_front_s = age_s - u_mm / lumen.flow_mm_s;
  if (!(since_front_s > 0)) {
    return 0;
  }
  const double front = std::min(since_front_s / kFront_s, 1.0);
  const double washed_s = std::max(since_front_s - lumen.injection_s, 0.0);
  return front * front * (3 - 2 * front) * std::exp(-washed_s / lumen.washout_s - u_mm / kThinning_mm);
}

Eigen::VectorXd arc_lengths_mm(const Eigen::Matrix3Xd& points_mm) {
  Eigen::VectorXd lengths = Eigen::VectorXd::Zero(points_mm.cols());
  for (Eigen::Index i = 1; i < points_mm.cols(); ++i) {
    lengths[i] = lengths[i - 1] + (points_mm.col(i) - points_mm.col(i - 1)).norm();
  }
  return lengths;
}

}  // namespace tubed
