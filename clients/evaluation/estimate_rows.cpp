#include "clients/evaluation/estimate_rows.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "daemon/model/uniform_cubic_bspline.hpp"

namespace tubed {

namespace {

using Covariance = Eigen::Matrix<double, 6, 1>;  // xx xy xz yy yz zz

// Where s lies among the published points.
double place_of(const TubeEstimate& estimate, double s_mm) {
  const auto last = static_cast<double>(estimate.point_count - 1);
  return std::clamp(s_mm / static_cast<double>(estimate.length_mm) * last, 0.0, last);
}

Covariance covariance_at(const TubeEstimate& estimate, double s_mm) {
  const double place = place_of(estimate, s_mm);
  const auto left =
      std::min(static_cast<std::size_t>(place), static_cast<std::size_t>(estimate.point_count - 2));
  const double share = place - static_cast<double>(left);
  const auto of_point = [&](std::size_t i) -> Covariance {
    return Eigen::Map<const Eigen::Matrix<float, 6, 1>>(estimate.points[i].covariance_mm2.data())
        .cast<double>();
  };
  const Covariance covariance = (1 - share) * of_point(left) + share * of_point(left + 1);
  // Unknown at a point, unknown beside it.
  return covariance.allFinite() ? covariance : Covariance::Constant(std::numeric_limits<double>::infinity());
}

}  // namespace

std::uint32_t held_by_at(const TubeEstimate& estimate, double s_mm) {
  return estimate.points[static_cast<std::size_t>(std::lround(place_of(estimate, s_mm)))].held_by;
}

Eigen::Matrix3Xd coefficients_of(const TubeEstimate& estimate) {
  return Eigen::Map<const Eigen::Matrix3Xd>(estimate.coefficients_mm[0].data(), 3,
                                            static_cast<Eigen::Index>(estimate.coefficient_count));
}

EstimatedShape shape_of(const TubeEstimate& estimate) {
  EstimatedShape shape;
  shape.validity = estimate.validity;
  if (estimate.point_count < 2) {
    return shape;
  }
  const UniformCubicBSpline spline(static_cast<int>(estimate.coefficient_count),
                                   static_cast<double>(estimate.length_mm));
  const Eigen::Matrix3Xd C = coefficients_of(estimate);
  const auto count = static_cast<Eigen::Index>(estimate.length_mm) + 1;
  shape.centreline.p_world_mm.resize(3, count);
  shape.sigma_world_mm.resize(3, count);
  shape.covariance_world_mm2.resize(6, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const auto s_mm = static_cast<double>(i);
    const CubicBasis basis = spline.basis(s_mm);
    const Covariance covariance = covariance_at(estimate, s_mm);
    shape.centreline.s_mm.push_back(s_mm);
    shape.centreline.p_world_mm.col(i) = combine(C, basis.first, basis.value);
    shape.sigma_world_mm.col(i) = Eigen::Array3d(covariance[0], covariance[3], covariance[5]).max(0).sqrt();
    shape.covariance_world_mm2.col(i) = covariance;
    shape.held_by.push_back(held_by_at(estimate, s_mm));
  }
  return shape;
}

void write_estimate_header(std::ostream& out) {
  out << "frame,s_mm,x,y,z,sigma_x,sigma_y,sigma_z,validity,"
         "cov_xx,cov_xy,cov_xz,cov_yy,cov_yz,cov_zz,held_by\n";
}

void write_estimate_rows(std::ostream& out, std::uint32_t frame, const TubeEstimate& estimate) {
  const EstimatedShape shape = shape_of(estimate);
  if (shape.centreline.s_mm.empty()) {
    out << frame << ",,,,,,,," << name_of(shape.validity) << ",,,,,,,\n";
    return;
  }
  std::array<char, 384> row{};
  for (Eigen::Index i = 0; i < shape.sigma_world_mm.cols(); ++i) {
    const Eigen::Vector3d p = shape.centreline.p_world_mm.col(i);
    const Eigen::Vector3d sigma = shape.sigma_world_mm.col(i);
    const Covariance c = shape.covariance_world_mm2.col(i);
    std::snprintf(row.data(), row.size(),
                  "%u,%d,%.4f,%.4f,%.4f,%.4f,%.4f,%.4f,%s,%.7g,%.7g,%.7g,%.7g,%.7g,%.7g,%u\n", frame,
                  static_cast<int>(i), p.x(), p.y(), p.z(), sigma.x(), sigma.y(), sigma.z(),
                  name_of(shape.validity).data(), c[0], c[1], c[2], c[3], c[4], c[5],
                  shape.held_by[static_cast<std::size_t>(i)]);
    out << row.data();
  }
}

}  // namespace tubed
