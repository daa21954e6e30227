// Which coils say where they are: a probability for each, from what all of them say together.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>

#include "drivers/interface/room.hpp"

namespace tubed {

/// How coils go wrong: each on its own, and right again. A wrong one says nothing of the tube.
struct CoilFaultModel {
  double probability = 0.001;  ///< that a right one has gone wrong, at each measurement
  double lasting_s = 0.5;      ///< mean time that it stays wrong
  double distance_mm = 30;     ///< standard deviation of its additional error, an axis
};

/// chi^2 that leaving a coil out of a single measurement must save before that is the likelier explanation,
/// where it was believed so much and errs by `sigma_mm` on an axis when it is right.
[[nodiscard]] double gain_to_leave_out(const CoilFaultModel& model, double belief, double sigma_mm);

/// How far the coils of one measurement are off their prediction, and how far they may be.
struct CoilInnovations {
  explicit CoilInnovations(int most_coils);
  int count = 0;                      ///< coils that say something; of the rest nothing is read
  std::array<int, kMaxCoils> coil{};  ///< their indices
  Eigen::VectorXd innovation_mm;      ///< 3 a coil, world frame
  Eigen::MatrixXd covariance_mm2;     ///< 3 x 3 a pair of coils, noise included
};

/// Belief of each coil as a chain of two states, right or wrong. A measurement is judged by the joint
/// innovation of all its coils under every subset of wrong ones: right coils N(0, S), wrong ones N(0, S +
/// distance^2 I). So a coil that the others contradict is told from a tube that has moved otherwise than
/// expected, for which their innovations are correlated. A value but for its working memory, which is taken
/// in the constructor.
class CoilFaults {
 public:
  using Beliefs = std::array<double, kMaxCoils>;  ///< probability of each to be right

  /// Of more coils than so many at most kMaxApart are wrong, or all.
  static constexpr int kMaxSubsetsOf = 8;
  static constexpr int kMaxApart = 3;

  CoilFaults(const CoilFaultModel& model, int most_coils);

  [[nodiscard]] Beliefs at_first() const;
  /// What is still believed before the next measurement, `dt_s` after the last.
  void age(double dt_s, Beliefs& beliefs) const;
  /// Bayes' rule over the subsets; of coils not in `innovations` nothing changes, and of none if the
  /// covariance is not positive definite.
  void weigh(const CoilInnovations& innovations, Beliefs& beliefs) noexcept;

 private:
  void visit(int k, std::uint32_t wrong, int wrong_count, double log_weight) noexcept;
  double log_likelihood(int k, bool is_wrong) noexcept;
  void add_subset(std::uint32_t wrong, double log_weight) noexcept;

  CoilFaultModel model_;
  const CoilInnovations* innovations_ = nullptr;
  std::array<double, kMaxCoils> log_right_{}, log_wrong_{};  ///< of the prior
  Eigen::MatrixXd cholesky_;                                 ///< lower, of the coils visited so far
  Eigen::VectorXd whitened_;
  double max_log_ = 0;  ///< sums are relative to it
  double sum_ = 0;
  std::array<double, kMaxCoils> sum_right_{};
};

}  // namespace tubed
