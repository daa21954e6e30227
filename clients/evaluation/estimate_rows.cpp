#include "clients/evaluation/estimate_rows.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "daemon/model/uniform_cubic_bspline.hpp"

namespace tubed {

namespace {

double sigma_at(const TubeEstimate& estimate, double s_mm, std::size_t diagonal) {
  const auto last = static_cast<double>(estimate.point_count - 1);
  const double place = std::clamp(s_mm / static_cast<double>(estimate.length_mm) * last, 0.0, last);
  const auto left =
      std::min(static_cast<std::size_t>(place), static_cast<std::size_t>(estimate.point_count - 2));
  const double share = place - static_cast<double>(left);
  const double variance = (1 - share) * static_cast<double>(estimate.points[left].covariance_mm2[diagonal]) +
                          share * static_cast<double>(estimate.points[left + 1].covariance_mm2[diagonal]);
  return std::sqrt(std::max(variance, 0.0));
}

}  // namespace

void write_estimate_header(std::ostream& out) {
  out << "frame,s_mm,x,y,z,sigma_x,sigma_y,sigma_z,validity\n";
}

void write_estimate_rows(std::ostream& out, std::uint32_t frame, const TubeEstimate& estimate) {
  if (estimate.point_count < 2) {
    out << frame << ",,,,,,,," << name_of(estimate.validity) << '\n';
    return;
  }
  const UniformCubicBSpline spline(static_cast<int>(estimate.coefficient_count),
                                   static_cast<double>(estimate.length_mm));
  const Eigen::Map<const Eigen::Matrix3Xd> C(estimate.coefficients_mm[0].data(), 3,
                                             spline.coefficient_count());
  std::array<char, 256> row{};
  for (int s = 0; s <= static_cast<int>(estimate.length_mm); ++s) {
    const CubicBasis basis = spline.basis(s);
    const Eigen::Vector3d p = combine(C, basis.first, basis.value);
    std::snprintf(row.data(), row.size(), "%u,%d,%.4f,%.4f,%.4f,%.4f,%.4f,%.4f,%s\n", frame, s, p.x(), p.y(),
                  p.z(), sigma_at(estimate, s, 0), sigma_at(estimate, s, 3), sigma_at(estimate, s, 5),
                  name_of(estimate.validity).data());
    out << row.data();
  }
}

}  // namespace tubed
