#include "daemon/estimator/loose_tip.hpp"

namespace tubed {

void soften_loose_tip(double loose_mm, double length_mm, Eigen::VectorXd& bending) {
  constexpr double kTimesAsMuch = 20;  // variance of the curvature
  const double nodes = loose_mm / length_mm * static_cast<double>(bending.size());
  bending.head(static_cast<Eigen::Index>(nodes)).setConstant(kTimesAsMuch);
}

}  // namespace tubed
