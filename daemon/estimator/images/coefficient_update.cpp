#include "daemon/estimator/images/coefficient_update.hpp"

#include "daemon/estimator/strain_slack.hpp"

namespace tubed {

namespace {

constexpr int kUpdateIterations = 3;

}  // namespace

CoefficientUpdate::CoefficientUpdate(const EstimatorSettings& settings,
                                     const InstrumentDescription& instrument, int column_count)
    : map_(settings, instrument.length_mm),
      coefficients_(Eigen::Matrix3Xd::Zero(3, settings.coefficient_count)),
      prior_{Eigen::MatrixXd::Zero(coefficients_.size(), coefficients_.size()), coefficients_},
      cholesky_(coefficients_.size()),
      following_(
          Eigen::MatrixXd::Zero(3 * Eigen::Index{column_count} - coefficients_.size(), coefficients_.size())),
      following_covariance_(following_),
      departure_(Eigen::VectorXd::Zero(coefficients_.size())),
      information_times_departure_(departure_) {
  map_.set_strain_slack(kStrainSlack);
  map_.set_stiffness(instrument.stiffness_profile());
}

bool CoefficientUpdate::begin(const TubeGaussian& tube, const Eigen::VectorXd& bending,
                              const Eigen::Matrix3Xd& C) {
  const Eigen::Index n = coefficients_.size();
  prior_.mean = tube.m.leftCols(coefficients_.cols());
  cholesky_.matrix() = tube.P.topLeftCorner(n, n);
  if (!cholesky_.factorise() || !cholesky_.invert(prior_.information)) {
    return false;
  }
  map_.set_bending(bending);
  set_coefficients(C);
  return true;
}

// One step of Gauss-Newton from a prediction is as good as many: whether it has converged is not asked.
std::uint32_t CoefficientUpdate::refine(std::span<const ViewConstraints> lines) {
  return refine(lines, kUpdateIterations, coefficients_);
}

std::uint32_t CoefficientUpdate::refine(std::span<const ViewConstraints> lines, int max_iterations,
                                        Eigen::Matrix3Xd& coefficients) {
  bool converged = false;
  return static_cast<std::uint32_t>(
      map_.refine(CoilObservations{}, lines, &prior_, max_iterations, coefficients, converged));
}

void CoefficientUpdate::follow(const TubeGaussian& tube, Eigen::Matrix3Xd& C) {
  const Eigen::Index n = coefficients_.size();
  const Eigen::Index further = tube.P.rows() - n;
  C.leftCols(coefficients_.cols()) = coefficients_;
  depart(coefficients_);
  auto rest = C.rightCols(C.cols() - coefficients_.cols()).reshaped();
  rest = tube.m.rightCols(C.cols() - coefficients_.cols()).reshaped();
  rest.noalias() += tube.P.bottomLeftCorner(further, n) * information_times_departure_;
}

// P_ec P_cc^-1 stays as it was before.
bool CoefficientUpdate::take(std::span<const ViewConstraints> lines, TubeGaussian& tube) {
  const Eigen::Index n = coefficients_.size();
  const Eigen::Index further = tube.P.rows() - n;
  auto P_cc = tube.P.topLeftCorner(n, n);
  auto P_ec = tube.P.bottomLeftCorner(further, n);
  if (!map_.condense(CoilObservations{}, lines, prior_, coefficients_, coefficients_)) {
    return false;
  }
  follow(tube, tube.m);
  following_.noalias() = P_ec * prior_.information;
  P_cc = map_.coefficient_covariance();
  following_covariance_.noalias() = following_ * P_cc;
  P_ec -= following_covariance_;
  tube.P.bottomRightCorner(further, further).noalias() -= P_ec * following_.transpose();
  P_ec = following_covariance_;
  tube.P.topRightCorner(n, further) = following_covariance_.transpose();
  return true;
}

double CoefficientUpdate::pull(const Eigen::Matrix3Xd& C) {
  depart(C);
  return departure_.dot(information_times_departure_);
}

double CoefficientUpdate::expected_pull(const TubeGaussian& updated) const {
  const Eigen::Index n = coefficients_.size();
  return static_cast<double>(n) - prior_.information.cwiseProduct(updated.P.topLeftCorner(n, n)).sum();
}

const TubeMap* CoefficientUpdate::with_covariance(std::span<const ViewConstraints> lines) {
  return map_.invert_at(CoilObservations{}, lines, &prior_, coefficients_) ? &map_ : nullptr;
}

// departure_ of C's coefficients from their prior mean, and with the information.
void CoefficientUpdate::depart(const Eigen::Matrix3Xd& C) {
  departure_ = (C.leftCols(coefficients_.cols()) - prior_.mean).reshaped();
  information_times_departure_.noalias() = prior_.information * departure_;
}

}  // namespace tubed
