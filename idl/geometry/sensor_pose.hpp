// The pose of a body from what the sensors on it measured: one of 6 degrees of freedom, or two 5-DOF coils.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "idl/geometry/rigid_transform.hpp"

namespace tubed {

/// Of a small turn w and shift v, in this order; rad and mm.
using PoseCovariance = Eigen::Matrix<double, 6, 6>;
using PoseError = Eigen::Matrix<double, 6, 1>;

/// T_em_body with its covariance: the true pose turns the body's axes by a further w about the tracker's
/// axes, w and v of N(0, covariance), and moves the body's origin by a further v.
struct SensorPose {
  RigidTransform T_em_body = RigidTransform::Identity();
  PoseCovariance covariance = PoseCovariance::Zero();
};

/// What is assumed of one sensor: standard deviation of its position an axis, and of its direction about an
/// axis.
struct SensorSigma {
  double position_mm = 0.5;
  double angle_rad = 0.005;
};

/// Position and z axis of a coil; a rotation about that axis is not measured.
struct CoilPose {
  Eigen::Vector3d p_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  ///< of length 1
};

/// Two coils in some frame, and what a turn and a shift of both leaves as it is.
using TwoCoils = std::array<CoilPose, 2>;

/// Of a sensor of 6 degrees of freedom, from position, z axis and x axis. What of x is along z is left out.
/// Nothing when they are not finite, or z is not of length 1 or x nearly along z. Never allocates.
std::optional<SensorPose> pose_of_sensor(const Eigen::Vector3d& p_em_mm, const Eigen::Vector3d& z_axis_em,
                                         const Eigen::Vector3d& x_axis_em, const SensorSigma& sigma);

/// The pose that takes `body` to `measured`: R and t that minimise
///   sum_i |p_i - R b_i - t|^2 / sigma_position^2 + |u_i - R a_i|^2 / sigma_angle^2
/// over both coils' positions and axes. t = mean(p) - R mean(b); what is left is Wahba's problem, whose
/// minimum is found in closed form from the singular value decomposition of
///   B = sum_i (p_i - mean p) (b_i - mean b)^T / sigma_position^2 + u_i a_i^T / sigma_angle^2
/// (Markley, "Attitude determination using vector observations and the singular value decomposition", 1988):
/// no iteration improves it. The covariance is the inverse of the information of that minimum,
///   sum_i (|d_i|^2 I - d_i d_i^T) / sigma_position^2 + (I - u_i u_i^T) / sigma_angle^2   for the turn,
/// d_i = p_i - mean p, and sigma_position^2 / 2 an axis for the shift of the coils' middle. The covariance is
/// that of the body's origin when that is the middle of its coils: body_of() makes it so.
/// Precondition: knows_turn(body). Never allocates.
SensorPose pose_of_two_coils(const TwoCoils& body, const TwoCoils& measured, const SensorSigma& sigma);

/// The same coils, their middle at the origin.
TwoCoils body_of(const TwoCoils& coils);

/// How far two pairs of coils are from being the same body: no pose explains it.
struct TwoCoilMisfit {
  double distance_mm = 0;  ///< difference of the distances between the coils
  double angle_rad = 0;    ///< greatest difference of the angles between the axes, and of each and the line
};
TwoCoilMisfit misfit_of(const TwoCoils& body, const TwoCoils& measured);

/// Can a turn of the two be known? False where the axes and the line between them are parallel within 10
/// degrees. A line shorter than 5 mm has no direction worth speaking of.
bool knows_turn(const TwoCoils& coils);

/// The turn w and shift v that take `from` to `to`: R_to = exp(w) R_from, t_to = t_from + v.
PoseError difference_of(const RigidTransform& from, const RigidTransform& to);

/// `pose` turned by exp(w) and shifted by v.
RigidTransform moved_by(const PoseError& error, const RigidTransform& pose);

/// exp of a rotation vector, rad.
Eigen::Matrix3d rotation_by(const Eigen::Vector3d& w_rad);

}  // namespace tubed
