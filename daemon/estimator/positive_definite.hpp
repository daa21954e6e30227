// The inverse of a symmetric positive definite matrix, as fast as its triangular factor allows.
#pragma once

#include <Eigen/Core>

namespace tubed {

/// Replaces `matrix` (of which only the lower triangle is read) by its inverse, both triangles. False when it
/// is not positive definite; `matrix` is then undefined. `scratch` has the same size. By Cholesky's factor L:
/// L^-1 in place by halves, then L^-T L^-1; both skip the zeros of the triangle, so that it costs a third of
/// solving for the identity. Never allocates.
bool invert_positive_definite(Eigen::MatrixXd& matrix, Eigen::MatrixXd& scratch);

}  // namespace tubed
