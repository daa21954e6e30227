// Reads the estimates that `tubectl reconstruct` writes: frame,s_mm,x,y,z,sigma_x,sigma_y,sigma_z,validity,
// cov_xx,cov_xy,cov_xz,cov_yy,cov_yz,cov_zz,held_by.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <map>
#include <vector>

#include "clients/evaluation/shape_error.hpp"
#include "idl/estimate.hpp"
#include "idl/validity.hpp"

namespace tubed {

/// The shape estimated for one instant, world frame.
struct EstimatedShape {
  SampledCentreline centreline;     ///< empty when the estimate has no shape
  Eigen::Matrix3Xd sigma_world_mm;  ///< 3 x n, one standard deviation an axis and point
  Validity validity = Validity::kNotAvailable;
  /// 6 x n: xx xy xz yy yz zz of each point, mm^2; without columns where they are not known.
  Eigen::Matrix<double, 6, Eigen::Dynamic> covariance_world_mm2{};
  /// One a point, kHeldByCoil and kHeldByImage; empty where it is not known.
  std::vector<std::uint32_t> held_by{};
};

/// The matrix of xx xy xz yy yz zz.
Eigen::Matrix3d symmetric(const Eigen::Ref<const Eigen::VectorXd>& upper_triangle);

/// By frame number.
using Estimates = std::map<std::uint32_t, EstimatedShape>;

/// The columns cov_.. and held_by may be missing, as in files of before. The rows of a frame stand together,
/// s_mm rising. A row with frame and validity alone is an estimate without a shape. Throws SequenceError
/// "FILE:LINE:COLUMN: ..." for whatever CsvReader refuses, a negative sigma, an unknown validity word, two
/// validities in one frame, a held_by above 3, arc length that does not rise, a frame that comes twice, a
/// file without any row.
Estimates read_estimates(const std::filesystem::path& file);

}  // namespace tubed
