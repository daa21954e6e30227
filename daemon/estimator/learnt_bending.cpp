#include "daemon/estimator/learnt_bending.hpp"

#include <algorithm>
#include <cmath>

namespace tubed {

namespace {

constexpr double kAveragedOver_mm = 10;  // of the tube, standard deviation of a Gaussian
constexpr double kBendingMemory_s = 0.5;
// Weight of the settings, in units of one shape's. So a tube as straight as a line can still be bent, and
// where nothing is measured, so that the expectation is what it was, the settings are what is left.
constexpr double kOfTheSettings = 0.2;

}  // namespace

LearntBending::LearntBending(Eigen::Index node_count, double spacing_mm)
    : averaging_(node_count, node_count),
      expected_(Eigen::VectorXd::Zero(node_count)),
      averaged_(Eigen::VectorXd::Zero(node_count)) {
  for (Eigen::Index i = 0; i < node_count; ++i) {
    for (Eigen::Index j = 0; j < node_count; ++j) {
      const double away = static_cast<double>(i - j) * spacing_mm / 2 / kAveragedOver_mm;
      averaging_(i, j) = std::exp(-0.5 * away * away);
    }
    averaging_.row(i) /= averaging_.row(i).sum();
  }
}

void LearntBending::learn(const TubeMap& map, const Eigen::Matrix3Xd& C, double interval_s,
                          Eigen::VectorXd& factors) {
  const double share = std::clamp(interval_s / kBendingMemory_s, 0.0, 1.0);
  map.expect_bending(C, expected_);
  averaged_.noalias() = averaging_ * expected_;
  factors.array() += share * ((kOfTheSettings + averaged_.array()) / (kOfTheSettings + 1) - factors.array());
}

}  // namespace tubed
