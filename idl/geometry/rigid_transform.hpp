// Rigid transforms between frames. T_a_b maps b to a: p_a = T_a_b * p_b, and neighbouring names must match.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <string>

namespace tubed {

using RigidTransform = Eigen::Isometry3d;

/// Takes a 4 x 4 matrix written by a person: last row 0 0 0 1 and a rotation orthonormal within `tolerance`
/// (determinant + 1); the rotation is then made exactly orthonormal (nearest in the Frobenius norm, by SVD).
/// Returns nothing and says in `why` what is wrong otherwise.
std::optional<RigidTransform> rigid_from_matrix(const Eigen::Matrix4d& matrix, double tolerance,
                                                std::string& why);

/// How far the 3 x 3 part is from orthonormal: the greatest element of |R^T R - 1|. Numbers rounded to d
/// decimals have up to 2 * 10^-d.
double orthonormality_error(const Eigen::Matrix4d& matrix);

/// The shortest rotation that turns +z onto `direction` (any length but 0), as unit quaternion; for -z, about
/// x.
Eigen::Quaterniond rotation_from_z_to(const Eigen::Vector3d& direction);

}  // namespace tubed
