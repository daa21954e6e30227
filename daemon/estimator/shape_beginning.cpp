#include "daemon/estimator/shape_beginning.hpp"

#include "daemon/estimator/strain_slack.hpp"

namespace tubed {

namespace {

constexpr double kNoStrain = 1e3;  // sigma factor that switches it off

GaussianPrior nothing_known(Eigen::Index columns) {
  return {Eigen::MatrixXd::Zero(3 * columns, 3 * columns), Eigen::Matrix3Xd::Zero(3, columns)};
}

}  // namespace

ShapeBeginning::ShapeBeginning(const EstimatorSettings& settings, const InstrumentDescription& instrument)
    : max_iterations_(settings.iterations),
      solver_(settings, instrument),
      map_(settings, instrument.length_mm, static_cast<int>(instrument.coils.size()),
           TubeMotion::column_count_of_motion(instrument.length_mm)),
      prior_(nothing_known(map_.columns().count())) {
  map_.set_stiffness(instrument.stiffness_profile());
}

void ShapeBeginning::set_rest(RestHook* hook) {
  solver_.set_rest(hook);
  map_.set_rest(hook);
}

void ShapeBeginning::suppose_coil_errors(TubeState& state) {
  if (!state.errors.began_with_known_noise()) {
    state.freedom.forget_surprises();  // while all was taken for noise nothing surprised
  }
  state.errors.begin();
  prior_.mean.setZero();
  prior_.information.setZero();
  const auto know = [this](int column, double sigma) {
    prior_.information.diagonal().segment<3>(3 * column).setConstant(1 / (sigma * sigma));
  };
  const TubeColumns& columns = map_.columns();
  for (int coil = 0; coil < columns.coils_with_error; ++coil) {
    know(columns.position_error(coil), state.errors.position_mm());
    know(columns.tangent_error(coil), state.errors.tangent());
  }
  for (int column = columns.first_further(); column < columns.count(); ++column) {
    know(column, 1);  // of the motion, which begin_with() sets
  }
}

ShapeBeginning::Begun ShapeBeginning::begin_with(const CoilObservations& coils,
                                                 std::span<const ViewConstraints> lines, StateMotion& motion,
                                                 TubeState& state) {
  const CoilNoise& noise = state.errors.noise();
  TubeGaussian& tube = state.tube;
  tube.C.setZero();
  tube.C.leftCols(solver_.C().cols()) = solver_.C();
  state.bending = solver_.bending();
  state.images.rival = solver_.rival();
  state.images.is_ambiguous = solver_.is_ambiguous();
  map_.set_bending(state.bending);
  map_.set_strain_slack(kStrainSlack);
  map_.set_coil_noise(noise.noise_position_mm(), noise.noise_tangent());
  Begun begun;
  begun.iterations = map_.refine(coils, lines, &prior_, max_iterations_, tube.C, begun.converged);
  map_.set_strain_slack(kNoStrain);
  begun.is_possible = map_.invert_at(coils, lines, &prior_, tube.C);
  map_.set_strain_slack(kStrainSlack);
  if (begun.is_possible) {
    tube.P = map_.coefficient_covariance();
    motion.begin(tube);
    tube.m = tube.C;
  }
  return begun;
}

}  // namespace tubed
