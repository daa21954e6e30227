#include "idl/geometry/rigid_transform.hpp"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <array>
#include <cmath>
#include <cstdio>

namespace tubed {
namespace {

std::string with_number(const char* format, double number) {
  std::array<char, 240> text{};
  std::snprintf(text.data(), text.size(), format, number);
  return text.data();
}

/// What is wrong with a matrix that should be a rigid transform; empty if nothing.
std::string fault_of(const Eigen::Matrix4d& matrix, double tolerance) {
  if (!matrix.allFinite()) return "the matrix has an element that is not a finite number";
  const double last_row_error = (matrix.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).cwiseAbs().maxCoeff();
  if (last_row_error > tolerance) {
    return with_number("the last row must be 0 0 0 1, it is off by %.3g", last_row_error);
  }
  const Eigen::Matrix3d R = matrix.topLeftCorner<3, 3>();
  const double error = orthonormality_error(matrix);
  if (error > tolerance) {
    const bool is_rounded = error < 0.05;
    return with_number(
        is_rounded ? "the 3 x 3 rotation is not orthonormal: R^T R differs from the identity by %.3g; "
                     "write its numbers with four decimals or more"
                   : "the 3 x 3 rotation is not orthonormal: R^T R differs from the identity by %.3g",
        error);
  }
  const double determinant = R.determinant();
  if (determinant < 0) {
    return with_number("the 3 x 3 part is a reflection, not a rotation: its determinant is %.3g, not 1",
                       determinant);
  }
  return {};
}

}  // namespace

double orthonormality_error(const Eigen::Matrix4d& matrix) {
  const Eigen::Matrix3d R = matrix.topLeftCorner<3, 3>();
  return (R.transpose() * R - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
}

std::optional<RigidTransform> rigid_from_matrix(const Eigen::Matrix4d& matrix, double tolerance,
                                                std::string& why) {
  why = fault_of(matrix, tolerance);
  if (!why.empty()) return std::nullopt;
  // The nearest rotation in the Frobenius norm is U V^T; its determinant is + 1 since that of R is positive.
  const Eigen::Matrix3d R = matrix.topLeftCorner<3, 3>();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(R, Eigen::ComputeFullU | Eigen::ComputeFullV);
  RigidTransform transform = RigidTransform::Identity();
  transform.linear() = svd.matrixU() * svd.matrixV().transpose();
  transform.translation() = matrix.topRightCorner<3, 1>();
  return transform;
}

Eigen::Quaterniond rotation_from_z_to(const Eigen::Vector3d& direction) {
  // The axis is z x direction. atan2 keeps full precision near +z and -z, where acos would lose half the
  // digits.
  const double across = std::hypot(direction.x(), direction.y());
  const Eigen::Vector3d axis = across > 0
                                   ? Eigen::Vector3d(-direction.y() / across, direction.x() / across, 0)
                                   : Eigen::Vector3d(Eigen::Vector3d::UnitX());
  return Eigen::Quaterniond(Eigen::AngleAxisd(std::atan2(across, direction.z()), axis));
}

}  // namespace tubed
