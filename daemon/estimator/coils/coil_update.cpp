#include "daemon/estimator/coils/coil_update.hpp"

#include <Eigen/Cholesky>
#include <algorithm>

#include "idl/geometry/squared.hpp"

namespace tubed {

namespace {

/// Of |zeta'| - 1: what a spline makes of a tube that bends more sharply than it can, for knots this far
/// apart; its curvature's error goes with the square.
constexpr double kStrainOfSpline = 0.15;
constexpr double kWithSpacing_mm = 16.5;
constexpr double kSigmaOfStrain = 0.1;  // of what is more, one measurement
constexpr double kMinSpeed = 0.5;  // of |zeta'|: no direction turns faster than that with the coefficients

}  // namespace

CoilUpdate::CoilUpdate(int max_coils, int column_count)
    : PHt_(Eigen::MatrixXd::Zero(3 * column_count, 6 * max_coils)),
      S_(Eigen::MatrixXd::Zero(6 * max_coils, 6 * max_coils)),
      Y_(Eigen::MatrixXd::Zero(6 * max_coils, 3 * column_count)),
      innovation_(Eigen::VectorXd::Zero(6 * max_coils)),
      step_(Eigen::VectorXd::Zero(3 * column_count)) {}

void CoilUpdate::add(const Rows& rows, const Eigen::Vector3d& residual_at_C, const Eigen::Matrix3Xd& C,
                     const Eigen::Matrix3Xd& m, const Eigen::MatrixXd& P) {
  rows_[static_cast<std::size_t>(count_)] = rows;
  auto covariance = PHt_.middleCols<3>(3 * count_);
  Eigen::Vector3d departure = rows.further_gradient * (m.col(rows.further) - C.col(rows.further));
  // P H^T column by column. H has four blocks w_k G at the coefficients and one at the coil's own error; the
  // residual is whitened, so that R = I.
  covariance.noalias() = P.middleCols<3>(3 * rows.further) * rows.further_gradient.transpose();
  for (int k = 0; k < 4; ++k) {
    const int column = rows.first + k;
    const Eigen::Matrix3d gradient = rows.weights[static_cast<std::size_t>(k)] * rows.gradient;
    covariance.noalias() += P.middleCols<3>(3 * column) * gradient.transpose();
    departure += gradient * (m.col(column) - C.col(column));
  }
  // nu = -(r(C) + H (m - C)): linearised at C, which is not the mean m.
  innovation_.segment<3>(3 * count_) = -(residual_at_C + departure);
  ++count_;
}

// S = H P H^T + I.
void CoilUpdate::fill_innovation_covariance(Eigen::Index n) {
  auto S = S_.topLeftCorner(n, n);
  for (Eigen::Index a = 0; a < count_; ++a) {
    const Rows& rows = rows_[static_cast<std::size_t>(a)];
    auto band = S.middleRows<3>(3 * a);
    band.noalias() = rows.further_gradient * PHt_.block(3 * rows.further, 0, 3, n);
    for (int k = 0; k < 4; ++k) {
      const Eigen::Matrix3d gradient = rows.weights[static_cast<std::size_t>(k)] * rows.gradient;
      band.noalias() += gradient * PHt_.block(3 * (rows.first + k), 0, 3, n);
    }
  }
  S.diagonal().array() += 1;
}

bool CoilUpdate::apply(const CoilObservations& coils, const TubeMap& map, double sigma_position_mm,
                       double sigma_tangent, Eigen::Matrix3Xd& C, Eigen::Matrix3Xd& m, Eigen::MatrixXd& P) {
  count_ = 0;
  pull_ = Pull{};
  const double of_spline = kStrainOfSpline * squared(map.spline().spacing_mm() / kWithSpacing_mm);
  for (int i = 0; i < coils.count; ++i) {
    const CoilObservation& coil = coils.coils[static_cast<std::size_t>(i)];
    if (!coil.used()) {
      continue;
    }
    const CubicBasis basis = map.spline().basis(coil.s_mm);
    const int position = map.columns().position_error(i);
    const int tangent = map.columns().tangent_error(i);
    const Eigen::Matrix3d placing = Eigen::Matrix3d::Identity() / sigma_position_mm;
    add({basis.first, basis.value, placing, position, placing},
        (combine(C, basis.first, basis.value) + C.col(position) - coil.p_world_mm) / sigma_position_mm, C, m,
        P);
    const Eigen::Vector3d derivative = combine(C, basis.first, basis.first_derivative);
    const double speed = derivative.norm();
    const Eigen::Vector3d direction = derivative / std::max(speed, 1e-6);
    const Eigen::Matrix3d along = direction * direction.transpose();
    const Eigen::Matrix3d all = Eigen::Matrix3d::Identity() / sigma_tangent;
    const Eigen::Matrix3d across = all - along / sigma_tangent;
    const Eigen::Matrix3d turning = -across / std::max(speed, kMinSpeed);
    const Eigen::Vector3d turned = C.col(tangent) - coil.tangent_world - direction;
    const double strain = speed - std::clamp(speed, 1 - of_spline, 1 + of_spline);
    pull_.expected += strain == 0 ? 5 : 6;  // a unit vector has no noise along itself
    if (strain == 0) {
      add({basis.first, basis.first_derivative, turning, tangent, all}, turned / sigma_tangent, C, m, P);
    } else {
      add({basis.first, basis.first_derivative, turning + along / kSigmaOfStrain, tangent, across},
          across * turned + direction * (strain / kSigmaOfStrain), C, m, P);
    }
  }
  if (count_ == 0) {
    return true;
  }
  const Eigen::Index n = 3 * count_;
  fill_innovation_covariance(n);
  auto S = S_.topLeftCorner(n, n);
  // S = L L^T and Y = L^-1 H P: the gain times nu is Y^T (L^-1 nu), and the new covariance P - Y^T Y.
  Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> cholesky(S);
  if (cholesky.info() != Eigen::Success) {
    return false;
  }
  auto Y = Y_.topRows(n);
  Y = PHt_.leftCols(n).transpose();
  cholesky.matrixL().solveInPlace(Y);
  auto innovation = innovation_.head(n);
  cholesky.matrixL().solveInPlace(innovation);
  // Of the whitened innovation, unit covariance in expectation: how much of it is more than the noise itself.
  pull_.chi_squared = innovation.squaredNorm();
  step_.noalias() = Y.transpose() * innovation;
  P.selfadjointView<Eigen::Lower>().rankUpdate(Y.transpose(), -1);
  P.triangularView<Eigen::StrictlyUpper>() = P.transpose();
  const Eigen::Map<const Eigen::Matrix3Xd> step(step_.data(), 3, m.cols());
  m += step;
  C += step;
  return step_.allFinite();
}

}  // namespace tubed
