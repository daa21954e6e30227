// The part of a filter's state that images see: they update the coefficients, and the other columns follow.
#pragma once

#include <Eigen/Core>
#include <span>

#include "daemon/estimator/algebra/dense_cholesky.hpp"
#include "daemon/estimator/tube_gaussian.hpp"
#include "daemon/estimator/tube_map.hpp"

namespace tubed {

/// Images measure the coefficients alone, so that the information of these is all that has to be inverted;
/// what else is estimated (errors of coils, motion) follows by P_ec P_cc^-1, e the further columns, c the
/// coefficients. begin() first, then refine(), then follow() or take(). Memory is taken in the constructor.
class CoefficientUpdate {
 public:
  /// `column_count` of the TubeGaussian.
  CoefficientUpdate(const EstimatorSettings& settings, const InstrumentDescription& instrument,
                    int column_count);

  /// Bending is measured from this hook: TubeMap::set_rest().
  void set_rest(RestHook* hook) { map_.set_rest(hook); }

  /// Takes the coefficients' part of m and P as prior, and C's coefficients as where refine() begins; bending
  /// as in TubeMap::set_bending(). False when P is not positive definite: the state is numerically lost.
  bool begin(const TubeGaussian& tube, const Eigen::VectorXd& bending, const Eigen::Matrix3Xd& C);

  void set_bending(const Eigen::VectorXd& bending) { map_.set_bending(bending); }

  /// Gauss-Newton of prior, stiffness and lines from where the coefficients are; the iterations made.
  std::uint32_t refine(std::span<const ViewConstraints> lines);
  /// The same for other coefficients, with this many iterations at most.
  std::uint32_t refine(std::span<const ViewConstraints> lines, int max_iterations,
                       Eigen::Matrix3Xd& coefficients);
  [[nodiscard]] double cost() const { return map_.cost(); }

  /// 3 x coefficients, mm, world, as they are now.
  [[nodiscard]] Eigen::Matrix3Xd& coefficients() { return coefficients_; }
  void set_coefficients(const Eigen::Matrix3Xd& C) { coefficients_ = C.leftCols(coefficients_.cols()); }

  /// Writes the coefficients into C, and into its further columns what the coefficients' way from their prior
  /// mean says of them.
  void follow(const TubeGaussian& tube, Eigen::Matrix3Xd& C);

  /// The posterior of the measurements alone, without stiffness, into tube.m and tube.P. False when that
  /// fails.
  bool take(std::span<const ViewConstraints> lines, TubeGaussian& tube);

  /// chi^2 of the way of C's coefficients from their prior mean; columns that follow add nothing to it. With
  /// the right process noise an update pulls the mean by expected_pull() in expectation.
  double pull(const Eigen::Matrix3Xd& C);
  /// 3 n - tr(P-^-1 P+).
  [[nodiscard]] double expected_pull(const TubeGaussian& updated) const;

  /// The map with the covariance of the coefficients as they are now; nullptr when it cannot be had.
  const TubeMap* with_covariance(std::span<const ViewConstraints> lines);
  [[nodiscard]] const TubeMap& map() const { return map_; }

 private:
  void depart(const Eigen::Matrix3Xd& C);

  TubeMap map_;  ///< of the coefficients alone
  Eigen::Matrix3Xd coefficients_;
  GaussianPrior prior_;  ///< their m and P before the image, as the solver wants them
  DenseCholesky cholesky_;
  Eigen::MatrixXd following_;  ///< P_ec P_cc^-1
  Eigen::MatrixXd following_covariance_;
  Eigen::VectorXd departure_;
  Eigen::VectorXd information_times_departure_;
};

}  // namespace tubed
