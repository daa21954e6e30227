#include "drivers/laboratory/tracker/marker_registration.hpp"

#include <algorithm>
#include <cmath>

#include "drivers/laboratory/random/counter_random.hpp"
#include "drivers/laboratory/tracker/gaussian.hpp"

namespace tubed {

namespace {

constexpr std::int64_t kPlaceStream = 7401;
constexpr std::int64_t kErrorStream = 7402;

/// On one of the six faces, each as likely.
Eigen::Vector3d place_on(const Eigen::AlignedBox3d& box_mm, CounterRandom random) {
  const Eigen::Vector3d share(random.unit(), random.unit(), random.unit());
  Eigen::Vector3d p_mm = box_mm.min() + share.cwiseProduct(box_mm.sizes());
  const auto face = static_cast<int>(6 * random.unit());
  p_mm[face / 2] = face % 2 == 0 ? box_mm.min()[face / 2] : box_mm.max()[face / 2];
  return p_mm;
}

RigidTransform fitted(const Eigen::Matrix3Xd& from_mm, const Eigen::Matrix3Xd& to_mm) {
  return RigidTransform(Eigen::umeyama(from_mm, to_mm, false));
}

Eigen::VectorXd residuals_mm(const RigidTransform& T, const Eigen::Matrix3Xd& from_mm,
                             const Eigen::Matrix3Xd& to_mm) {
  return (T * from_mm - to_mm).colwise().norm().transpose();
}

}  // namespace

double localisation_sigma_mm(const MarkerSettings& settings, double explained_mm2) {
  const double wanted_mm2 = std::pow(settings.mean_residual_mm, 2) + std::pow(settings.sd_residual_mm, 2);
  const double left_mm2 = std::max(0.0, wanted_mm2 - explained_mm2);
  return std::sqrt(left_mm2 / (3 * (1 - 2.0 / settings.count)));
}

SimulatedRegistration register_markers(const MarkerSettings& settings, const RigidTransform& true_T_world_em,
                                       const EmErrors& field, std::int64_t seed) {
  SimulatedRegistration registration;
  registration.found_ct_mm.resize(3, settings.count);
  registration.found_em_mm.resize(3, settings.count);
  for (Eigen::Index i = 0; i < settings.count; ++i) {
    const Eigen::Vector3d p_world_mm = place_on(settings.box_world_mm, CounterRandom(seed, kPlaceStream, i));
    const Eigen::Vector3d p_em_mm = true_T_world_em.inverse() * p_world_mm;
    registration.found_ct_mm.col(i) = p_world_mm;
    registration.found_em_mm.col(i) = p_em_mm + field.warp_mm(p_em_mm);
  }
  const Eigen::Matrix3Xd& em_mm = registration.found_em_mm;
  const Eigen::Matrix3Xd& ct_mm = registration.found_ct_mm;
  const double warped_mm2 = residuals_mm(fitted(em_mm, ct_mm), em_mm, ct_mm).squaredNorm() / settings.count;
  const double sigma_mm = localisation_sigma_mm(settings, warped_mm2);
  const double sigma_ct_mm = std::min(settings.sigma_ct_mm, sigma_mm);
  const double sigma_em_mm = std::sqrt(sigma_mm * sigma_mm - sigma_ct_mm * sigma_ct_mm);
  for (Eigen::Index i = 0; i < settings.count; ++i) {
    CounterRandom random(seed, kErrorStream, i);
    registration.found_em_mm.col(i) += sigma_em_mm * gaussian_vector(random);
    registration.found_ct_mm.col(i) += sigma_ct_mm * gaussian_vector(random);
  }
  registration.T_world_em = fitted(em_mm, ct_mm);
  const Eigen::VectorXd left_mm = residuals_mm(registration.T_world_em, em_mm, ct_mm);
  registration.residual_mm.assign(left_mm.begin(), left_mm.end());
  return registration;
}

}  // namespace tubed
