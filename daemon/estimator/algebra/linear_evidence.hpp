// Which prior explains residuals of a linear model best?
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "daemon/estimator/algebra/dense_cholesky.hpp"

namespace tubed {

/// Residuals r_k = a_k . x + noise of variance v_k over unknowns x, kept as the information matrix
/// L = sum a_k a_k^T / v_k and the vector h = sum a_k r_k / v_k, which may be forgotten. An explanation is a
/// prior x ~ N(0, D^2) with a diagonal D. With A = I + D L D and g = D h, by completing the square,
///   log p(r | D) = -1/2 log det A + 1/2 g^T A^-1 g + what all explanations share,
///   E(x) = D A^-1 g,   Cov(x) = D A^-1 D.
/// A zero in D fixes that unknown at zero. What is added to a part can be taken back as a whole, until it is
/// kept.
///
/// A prior that differs from another one in a few unknowns J costs a factorisation of that size only. With
/// V = D A^-1 D and m = V h of the other one, and what the change takes away from the prior's information,
/// Delta = D_J^-2 - D'_J^-2, and S = Delta^(1/2),
///   C  = I - S V_JJ S,   which is positive definite: V_JJ <= D_J^2 < Delta^-1,
///   log p(r | D') = log p(r | D) - sum log(D'_j / D_j) - 1/2 log det C + 1/2 (S m_J)^T C^-1 (S m_J),
///   m' = m + V_:J S C^-1 S m_J,   V' = V + V_:J S C^-1 S V_J:
/// (Woodbury's identity and Sylvester's on determinants). Of one thread; memory is taken in the constructor.
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

  /// Takes the newest explanation as the one that widened() widens. False when its covariance is not finite,
  /// or explain() did not return a number.
  bool take_as_base();

  static constexpr std::size_t kMaxWidened = 6;
  struct Widened {
    Eigen::Index unknown = 0;
    double sigma = 0;  ///< instead of the base's; where it is not larger, the base's stays
  };
  /// The same as explain() of the base's D with these unknowns, kMaxWidened of them at most, allowed more.
  /// Precondition: take_as_base() was true, the base's D is positive there.
  double widened(std::span<const Widened> unknowns);

  /// E(x) of the newest explanation, of either kind.
  [[nodiscard]] const Eigen::VectorXd& mean() const { return mean_; }
  /// Cov(x) of the first six unknowns of the newest explanation, which is one of widened().
  [[nodiscard]] Eigen::Matrix<double, 6, 6> covariance_of_first() const;
  /// Var(x) of that unknown, likewise.
  [[nodiscard]] double variance_of(Eigen::Index unknown) const;

 private:
  /// L and h.
  struct Sums {
    Eigen::MatrixXd information;
    Eigen::VectorXd vector;
    bool is_empty = true;
    void clear();
    void take(Sums& other);
  };

  using Small = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxWidened, kMaxWidened>;
  struct Base {
    double log_evidence = 0;
    Eigen::VectorXd D;
    Eigen::VectorXd mean;        ///< m
    Eigen::MatrixXd covariance;  ///< V
  };

  Sums for_good_;
  std::vector<Sums> parts_;
  Sums frozen_;
  DenseCholesky cholesky_;
  Eigen::VectorXd D_;
  Eigen::VectorXd scaled_;
  Eigen::VectorXd mean_;
  double log_evidence_ = 0;
  Base base_;
  /// Of the newest widened(): J, and S C^-1 S.
  std::array<Eigen::Index, kMaxWidened> J_{};
  Small gained_;
};

}  // namespace tubed
