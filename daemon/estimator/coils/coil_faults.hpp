// Which coils say where they are: a probability for each, from what all of them say together.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>

#include "daemon/estimator/coils/coil_fault_model.hpp"
#include "daemon/estimator/coils/coil_innovations.hpp"

namespace tubed {

/// Belief of each coil as a chain of two states, right or wrong. A measurement is judged by the joint
/// innovation of all its coils under every subset of wrong ones: right coils N(0, S), wrong ones N(0, S +
/// distance^2 I). So a coil that the others contradict is told from a tube that has moved otherwise than
/// expected, for which their innovations are correlated. What is carried on is the marginal of each coil.
/// Working memory is taken in the constructor.
class CoilFaults {
 public:
  /// Of more coils not all subsets are asked: those that differ in at most kMaxChanges from what was likelier
  /// before, and that all are wrong. More that go wrong in one measurement are taken for all.
  static constexpr int kMaxExhaustiveCoils = 8;
  static constexpr int kMaxChanges = 3;

  CoilFaults(const CoilFaultModel& model, int max_coils);

  [[nodiscard]] const CoilFaultModel& model() const { return model_; }

  /// Bayes' rule over the subsets; of coils not in `innovations` nothing changes, and of none if the
  /// covariance is not positive definite or anything is no number.
  void weigh(const CoilInnovations& innovations, CoilBeliefs& beliefs) noexcept;

 private:
  struct Subset {
    std::uint32_t wrong = 0;  ///< a bit for each of the coils visited
    int wrong_count = 0;
    int changes = 0;
    double log_weight = 0;
  };
  /// What the coils before leave of one: its innovation and covariance given theirs.
  struct Rest {
    Eigen::Vector3d innovation_mm;
    Eigen::Matrix3d covariance_mm2;
  };

  void visit(const CoilInnovations& all, int k, const Subset& subset) noexcept;
  Rest eliminate(const CoilInnovations& all, int k) noexcept;
  double log_likelihood(const Rest& rest, int k, bool is_wrong) noexcept;
  void add(const Subset& subset, int count) noexcept;

  CoilFaultModel model_;
  std::array<double, kMaxCoils> log_right_{}, log_wrong_{};    ///< of the prior
  Eigen::MatrixXd cholesky_;                                   ///< lower, below the diagonal blocks
  std::array<Eigen::Matrix3d, kMaxCoils> inverse_diagonal_{};  ///< of its diagonal blocks
  std::array<Eigen::Vector3d, kMaxCoils> whitened_{};
  double max_log_ = 0;  ///< sums are relative to it
  double sum_ = 0;
  std::array<double, kMaxCoils> sum_right_{};
};

}  // namespace tubed
