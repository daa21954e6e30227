#include "daemon/estimator/coils/coil_innovations.hpp"

#include <Eigen/LU>
#include <algorithm>

namespace tubed {

namespace {

constexpr double kMaxSurprise = 25;  // chi^2 of a coil, 3 dof: more says that it is wrong (1.5e-5)
constexpr double kCalm = 11.3;       // chi^2 of a coil, 3 dof: 0.01

}  // namespace

CoilInnovations::CoilInnovations(int max_coils)
    : innovation_mm(Eigen::VectorXd::Zero(3 * max_coils)),
      covariance_mm2(Eigen::MatrixXd::Zero(3 * max_coils, 3 * max_coils)) {}

// Of coil i: nu_i = p_i - zeta(s_i) - e_i, e_i what stays of its error; cov(nu_i, nu_k) is that of the two
// sums of columns, and noise on the diagonal.
void CoilInnovations::measure(const CoilObservations& coils, const TubeMap& map, const TubeGaussian& tube,
                              double noise_mm) {
  count = 0;
  for (int i = 0; i < coils.count; ++i) {
    const CoilObservation& observed = coils.coils[static_cast<std::size_t>(i)];
    if (!observed.used()) {
      continue;
    }
    const auto place = [&](int index) {
      const double s_mm = coils.coils[static_cast<std::size_t>(index)].s_mm;
      ColumnSum sum(map.spline().basis(s_mm));
      sum.column.back() = map.columns().position_error(index);
      sum.weight.back() = 1;
      return sum;
    };
    const ColumnSum own = place(i);
    const Eigen::Index row = 3 * count;
    coil[static_cast<std::size_t>(count)] = i;
    const CubicBasis basis = map.spline().basis(observed.s_mm);
    innovation_mm.segment<3>(row) = observed.p_world_mm - combine(tube.C, basis.first, basis.value) -
                                    tube.C.col(map.columns().position_error(i));
    for (int k = 0; k < count; ++k) {
      const Eigen::Matrix3d shared = tube.covariance_of(own, place(coil[static_cast<std::size_t>(k)]));
      covariance_mm2.block<3, 3>(row, 3 * k) = shared;
      covariance_mm2.block<3, 3>(3 * k, row) = shared.transpose();
    }
    covariance_mm2.block<3, 3>(row, row) = tube.covariance_of(own, own);
    covariance_mm2.block<3, 3>(row, row).diagonal().array() += noise_mm * noise_mm;
    ++count;
  }
}

double CoilInnovations::chi_squared(int k) const {
  const Eigen::Vector3d innovation = innovation_mm.segment<3>(3 * k);
  const Eigen::Matrix3d covariance = covariance_mm2.block<3, 3>(3 * k, 3 * k);
  return innovation.dot(covariance.inverse() * innovation);
}

bool CoilInnovations::others_are_calm(int than) const {
  for (int k = 0; k < count; ++k) {
    if (coil[static_cast<std::size_t>(k)] != than && chi_squared(k) > kCalm) return false;
  }
  return true;
}

double CoilInnovations::surprise() const {
  double sum = 0;
  double max = 0;
  for (int k = 0; k < count; ++k) {
    const double capped = std::min(chi_squared(k), kMaxSurprise);
    sum += capped;
    max = std::max(max, capped);
  }
  return count > 2 ? (sum - max) / (3 * (count - 1)) : 0;
}

}  // namespace tubed
