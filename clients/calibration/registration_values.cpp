#include "clients/calibration/registration_values.hpp"

#include <cstdlib>

#include "clients/calibration/formatted.hpp"

namespace tubed {

namespace {

/// With so many significant digits.
double rounded(double value, int digits) {
  return value == 0 ? 0 : std::strtod(formatted("%.*e", digits - 1, value).c_str(), nullptr);
}

}  // namespace

void add_registration(const RigidTransform& T_world_em, const RegistrationQuality& quality,
                      double residual_mm, ConfigurationFragment& fragment) {
  Eigen::Matrix4d matrix = T_world_em.matrix();
  for (double& entry : matrix.reshaped()) entry = rounded(entry, 10);
  std::vector<double> covariance = upper_triangle(quality.covariance);
  for (double& entry : covariance) entry = rounded(entry, 8);
  std::vector<double> centre_mm;
  for (const double entry : quality.centre_world_mm) centre_mm.push_back(rounded(entry, 8));
  fragment.values.push_back({"em.T_world_em", matrix});
  fragment.values.push_back({"em.registration_residual_mm", rounded(residual_mm, 4)});
  fragment.values.push_back({"em.registration_covariance", covariance});
  fragment.values.push_back({"em.registration_centre_mm", centre_mm});
  fragment.values.push_back({"em.registration_date", fragment.date});
}

}  // namespace tubed
