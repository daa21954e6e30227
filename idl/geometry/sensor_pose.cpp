#include "idl/geometry/sensor_pose.hpp"

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "idl/geometry/squared.hpp"

namespace tubed {

namespace {

constexpr double kUnitTolerance = 0.1;
constexpr double kMinSineOfAxes = 0.2;
constexpr double kMinLine_mm = 5;
const double kMinSineOfTurn = std::sin(10 * std::numbers::pi / 180);

bool is_unit(const Eigen::Vector3d& v) { return std::abs(v.norm() - 1) < kUnitTolerance; }  // false for NaN

double sine_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return a.cross(b).norm() / (a.norm() * b.norm());
}

double angle_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

Eigen::Vector3d line_of(const TwoCoils& coils) { return coils[1].p_mm - coils[0].p_mm; }

Eigen::Vector3d middle_of(const TwoCoils& coils) { return (coils[0].p_mm + coils[1].p_mm) / 2; }

bool has_direction(const Eigen::Vector3d& line_mm) { return line_mm.norm() >= kMinLine_mm; }

/// The rotation nearest to B: U diag(1, 1, det(U V^T)) V^T.
Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& B) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(B, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double sign = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
  return svd.matrixU() * Eigen::Vector3d(1, 1, sign).asDiagonal() * svd.matrixV().transpose();
}

}  // namespace

std::optional<SensorPose> pose_of_sensor(const Eigen::Vector3d& p_em_mm, const Eigen::Vector3d& z_axis_em,
                                         const Eigen::Vector3d& x_axis_em, const SensorSigma& sigma) {
  if (!p_em_mm.allFinite() || !is_unit(z_axis_em) || !is_unit(x_axis_em) ||
      sine_between(z_axis_em, x_axis_em) < kMinSineOfAxes) {
    return std::nullopt;
  }
  SensorPose pose;
  const Eigen::Vector3d z = z_axis_em.normalized();
  const Eigen::Vector3d y = z.cross(x_axis_em).normalized();
  pose.T_em_body.linear() << y.cross(z), y, z;
  pose.T_em_body.translation() = p_em_mm;
  pose.covariance.topLeftCorner<3, 3>().diagonal().setConstant(squared(sigma.angle_rad));
  pose.covariance.bottomRightCorner<3, 3>().diagonal().setConstant(squared(sigma.position_mm));
  return pose;
}

SensorPose pose_of_two_coils(const TwoCoils& body, const TwoCoils& measured, const SensorSigma& sigma) {
  const double position_weight = 1 / squared(sigma.position_mm);
  const double axis_weight = 1 / squared(sigma.angle_rad);
  const Eigen::Vector3d middle_body_mm = middle_of(body);
  const Eigen::Vector3d middle_em_mm = middle_of(measured);
  Eigen::Matrix3d B = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < body.size(); ++i) {
    const Eigen::Vector3d d_mm = measured[i].p_mm - middle_em_mm;
    const Eigen::Vector3d& u = measured[i].axis;
    B += position_weight * d_mm * (body[i].p_mm - middle_body_mm).transpose();
    B += axis_weight * u * body[i].axis.transpose();
    information +=
        position_weight * (d_mm.squaredNorm() * Eigen::Matrix3d::Identity() - d_mm * d_mm.transpose());
    information += axis_weight * (Eigen::Matrix3d::Identity() - u * u.transpose());
  }
  SensorPose pose;
  pose.T_em_body.linear() = nearest_rotation(B);
  pose.T_em_body.translation() = middle_em_mm - pose.T_em_body.linear() * middle_body_mm;
  pose.covariance.topLeftCorner<3, 3>() = information.inverse();
  pose.covariance.bottomRightCorner<3, 3>().diagonal().setConstant(squared(sigma.position_mm) / 2);
  return pose;
}

TwoCoils body_of(const TwoCoils& coils) {
  const Eigen::Vector3d middle_mm = middle_of(coils);
  TwoCoils body = coils;
  for (CoilPose& coil : body) {
    coil.p_mm -= middle_mm;
  }
  return body;
}

TwoCoilMisfit misfit_of(const TwoCoils& body, const TwoCoils& measured) {
  const Eigen::Vector3d line_body_mm = line_of(body);
  const Eigen::Vector3d line_mm = line_of(measured);
  TwoCoilMisfit misfit;
  misfit.distance_mm = std::abs(line_mm.norm() - line_body_mm.norm());
  misfit.angle_rad =
      std::abs(angle_between(measured[0].axis, measured[1].axis) - angle_between(body[0].axis, body[1].axis));
  if (has_direction(line_body_mm)) {
    for (std::size_t i = 0; i < body.size(); ++i) {
      const double angle_rad =
          std::abs(angle_between(measured[i].axis, line_mm) - angle_between(body[i].axis, line_body_mm));
      misfit.angle_rad = std::max(misfit.angle_rad, angle_rad);
    }
  }
  return misfit;
}

bool knows_turn(const TwoCoils& coils) {
  const Eigen::Vector3d line_mm = line_of(coils);
  return sine_between(coils[0].axis, coils[1].axis) >= kMinSineOfTurn ||
         (has_direction(line_mm) && (sine_between(coils[0].axis, line_mm) >= kMinSineOfTurn ||
                                     sine_between(coils[1].axis, line_mm) >= kMinSineOfTurn));
}

PoseError difference_of(const RigidTransform& from, const RigidTransform& to) {
  const Eigen::AngleAxisd turn(Eigen::Matrix3d(to.linear() * from.linear().transpose()));
  PoseError difference;
  difference << turn.angle() * turn.axis(), to.translation() - from.translation();
  return difference;
}

RigidTransform moved_by(const PoseError& error, const RigidTransform& pose) {
  RigidTransform moved = RigidTransform::Identity();
  moved.linear() = rotation_by(error.head<3>()) * pose.linear();
  moved.translation() = pose.translation() + error.tail<3>();
  return moved;
}

Eigen::Matrix3d rotation_by(const Eigen::Vector3d& w_rad) {
  const double angle_rad = w_rad.norm();
  return angle_rad == 0 ? Eigen::Matrix3d(Eigen::Matrix3d::Identity())
                        : Eigen::AngleAxisd(angle_rad, w_rad / angle_rad).toRotationMatrix();
}

}  // namespace tubed
