// Which prior explains residuals of a linear model best?
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <vector>

#include "daemon/estimator/dense_cholesky.hpp"

namespace tubed {

/// Residuals r_k = a_k . x + noise of variance v_k over unknowns x, kept as the information matrix
/// L = sum a_k a_k^T / v_k and the vector h = sum a_k r_k / v_k, which may be forgotten. An explanation is a
/// prior x ~ N(0, D^2) with a diagonal D. With A = I + D L D and g = D h, by completing the square,
///   log p(r | D) = -1/2 log det A + 1/2 g^T A^-1 g + what all explanations share,
///   E(x) = D A^-1 g,   Cov(x) = D A^-1 D.
/// A zero in D fixes that unknown at zero. What is added to a part can be taken back as a whole, until it is
/// kept. Of one thread; memory is taken in the constructor.
class LinearEvidence {
 public:
  explicit LinearEvidence(Eigen::Index unknowns, std::size_t parts = 0);

  [[nodiscard]] Eigen::Index unknowns() const { return for_good_.vector.size(); }

  /// What was seen counts this much of what it did, 0 .. 1.
  void forget(double kept);

  /// One residual: its row a, its value and its variance (> 0), for good or to this part.
  void add(const Eigen::VectorXd& row, double residual, double variance,
           std::optional<std::size_t> part = std::nullopt);

  /// All that was added to this part turns out to say nothing.
  void retract(std::size_t part);
  /// All that was added to this part goes to that one, or counts for good.
  void keep(std::size_t part, std::optional<std::size_t> in = std::nullopt);

  /// Everything seen so far, as explain() is going to ask about it, until the next call of this.
  void freeze();

  /// log p(r | D) of what is frozen, up to what all explanations share; fills mean(). Returns
  /// minus infinity where the matrix is not positive definite (numbers that are not finite).
  double explain(const Eigen::VectorXd& D);

  /// E(x) of the newest explanation.
  [[nodiscard]] const Eigen::VectorXd& mean() const { return mean_; }
  /// Cov(x) of the first six unknowns of the newest explanation. False when it is not finite. Precondition:
  /// explain() returned a number.
  bool covariance_of_first(Eigen::Matrix<double, 6, 6>& covariance);

 private:
  /// L and h.
  struct Sums {
    Eigen::MatrixXd information;
    Eigen::VectorXd vector;
    bool is_empty = true;
    void clear();
    void take(Sums& other);
  };

  Sums for_good_;
  std::vector<Sums> parts_;
  Sums frozen_;
  DenseCholesky cholesky_;
  Eigen::MatrixXd inverse_;
  Eigen::VectorXd D_;
  Eigen::VectorXd scaled_;
  Eigen::VectorXd mean_;
};

}  // namespace tubed
