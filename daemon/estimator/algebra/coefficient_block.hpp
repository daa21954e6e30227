// J^T J and J^T r of the residuals that touch the same four coefficients.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>

#include "daemon/estimator/algebra/line_kernels.hpp"

namespace tubed {

/// Sums residuals r with dr/dC_k = w_k g for four neighbouring coefficients C_k (3-vectors): of J^T J the
/// blocks w_a w_b g g^T, of J^T r the columns w_k r g. Residuals wait until there are enough of them for the
/// kernel, so that squares() is only right after sum_up(). Never allocates.
class CoefficientBlock {
 public:
  static constexpr int kNone = -1;

  /// Forgets all residuals. `first`: the first of the four coefficients from here on; kNone: of none yet.
  void begin(int first) {
    first_ = first;
    waiting_ = 0;
    squares_.setZero();
    pull_.setZero();
  }

  void add(const std::array<double, 4>& weights, const Eigen::Vector3d& gradient, double residual) {
    if (waiting_ == kMaxWaiting) sum_up();
    double* const outer = outer_.data() + 8 * waiting_;
    outer[0] = gradient[0] * gradient[0];
    outer[1] = gradient[0] * gradient[1];
    outer[2] = gradient[0] * gradient[2];
    outer[3] = gradient[1] * gradient[1];
    outer[4] = gradient[1] * gradient[2];
    outer[5] = gradient[2] * gradient[2];
    Eigen::Map<Products>(products_.data() + 12 * waiting_) = products_of(weights);
    ++waiting_;
    pull_.noalias() += (residual * gradient) * Eigen::Map<const Eigen::RowVector4d>(weights.data());
  }

  /// Three residuals at once: r with dr/dC_k = w_k scale I.
  void add_isotropic(const std::array<double, 4>& weights, double scale, const Eigen::Vector3d& residual) {
    // J^T J has w_a w_b scale^2 on the diagonal of each 3 x 3 block (elements xx, yy, zz: rows 0, 3, 5), J^T
    // r is scale w_k r.
    const Products products = scale * scale * products_of(weights);
    squares_.row(0) += products;
    squares_.row(3) += products;
    squares_.row(5) += products;
    pull_.noalias() += (scale * residual) * Eigen::Map<const Eigen::RowVector4d>(weights.data());
  }

  void sum_up() {
    add_outer_products(outer_.data(), products_.data(), waiting_, squares_.data());
    waiting_ = 0;
  }

  [[nodiscard]] int first() const { return first_; }
  /// Of J^T J: a column for each pair of coefficients a >= b, by columns of the lower triangle; rows xx, xy,
  /// xz, yy, yz, zz of the block's symmetric part, and two of zeros.
  [[nodiscard]] const Eigen::Matrix<double, 8, 10>& squares() const { return squares_; }
  /// J^T r, a coefficient a column.
  [[nodiscard]] const Eigen::Matrix<double, 3, 4>& pull() const { return pull_; }

 private:
  using Products = Eigen::Matrix<double, 10, 1>;

  /// w_a w_b of the pairs a >= b, by columns of the lower triangle.
  static Products products_of(const std::array<double, 4>& w) {
    return {w[0] * w[0], w[1] * w[0], w[2] * w[0], w[3] * w[0], w[1] * w[1],
            w[2] * w[1], w[3] * w[1], w[2] * w[2], w[3] * w[2], w[3] * w[3]};
  }

  static constexpr std::size_t kMaxWaiting = 24;
  int first_ = kNone;
  std::size_t waiting_ = 0;                          ///< residuals not yet in squares_
  std::array<double, 8 * kMaxWaiting> outer_{};      ///< upper triangle of g g^T, row by row, and two zeros
  std::array<double, 12 * kMaxWaiting> products_{};  ///< products_of() their weights
  Eigen::Matrix<double, 8, 10> squares_ = Eigen::Matrix<double, 8, 10>::Zero();
  Eigen::Matrix<double, 3, 4> pull_ = Eigen::Matrix<double, 3, 4>::Zero();
};

}  // namespace tubed
