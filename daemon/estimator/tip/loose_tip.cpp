#include "daemon/estimator/tip/loose_tip.hpp"

#include <algorithm>

namespace tubed {

double loose_tip_mm(const CoilObservations& coils, const RestHook* hook) {
  constexpr double kBehindHook_mm = 2;
  const double by_coils_mm = coils.hold_tip() ? 0 : coils.first_used_mm();
  if (hook == nullptr || hook->is_held_by(coils.first_used_mm())) {
    return by_coils_mm;
  }
  return std::max(by_coils_mm, hook->length_mm() + kBehindHook_mm);
}

void soften_loose_tip(double loose_mm, double length_mm, Eigen::VectorXd& bending) {
  constexpr double kTimesAsMuch = 20;  // variance of the curvature
  const double nodes = loose_mm / length_mm * static_cast<double>(bending.size());
  bending.head(static_cast<Eigen::Index>(nodes)).setConstant(kTimesAsMuch);
}

}  // namespace tubed
