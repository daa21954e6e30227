// Where the recursive estimator begins: at a shape of one instant.
#include "daemon/estimator/recursive_estimator.hpp"

namespace tubed {

namespace {

constexpr double kNoStrain = 1e3;  // sigma factor that switches it off

}  // namespace

bool RecursiveEstimator::initialise(const Observation& observation, CoilObservations& coils,
                                    const EmFrame& frame, TubeEstimate& estimate) {
  forget_doubts();
  state_.begun = false;
  if (!start_.solve_em(coils, estimate)) {
    return false;
  }
  views_.forget();  // lines of older images may be what led the shape away
  if (registered_) {
    images_ = start_.fuse_images(observation, coils, views_, ShortPiece::kLost, estimate);
    state_.images_with_tube = images_ == ImageVerdict::kShowsTube ? kConfirming : 0;
  }
  suppose_coil_errors();
  const auto lines = views_.constraints(observation, 1, false);
  if (!begin_with(coils, lines, estimate)) {
    return false;
  }
  state_.time = observation.is_image_instant ? observation.instant : frame.measured;
  state_.newest_em = frame.measured;
  state_.begun = true;
  state_.began = frame.measured;
  state_.asked = frame.measured;
  state_.bending_learnt = state_.time;
  leave_out_as_found(coils);
  place_coils();
  covariance_ = map_.invert_at(coils, lines, &prior_, state_.C) ? &map_ : nullptr;
  shape_ = state_.C;
  remember();
  return true;
}

void RecursiveEstimator::forget_doubts() {
  state_.images_without_tube = 0;
  state_.images_with_tube = 0;
  state_.tip_is_missed = false;
  state_.doubted_times = 0;
  state_.contradicted = false;
  state_.disowned = false;
  state_.freedom = 1;
  state_.last_freedom = 1;
  state_.drift = {};
  state_.bending.setOnes();
}

// What the coils have shown of their noise so far decides how much of their error stays.
void RecursiveEstimator::suppose_coil_errors() {
  const CoilNoise& noise = state_.noise;
  if (!state_.began_with_known_noise) {
    state_.usual = UsualSurprise{};  // while all was taken for noise nothing surprised
  }
  state_.began_with_known_noise = noise.known();
  state_.lasting_position_mm = noise.lasting_position_mm(state_.error_scale.position_mm());
  state_.lasting_tangent = noise.lasting_tangent(state_.error_scale.tangent());
  state_.min_lasting_position_mm = state_.lasting_position_mm;
  state_.min_lasting_tangent = state_.lasting_tangent;
  prior_.mean.setZero();
  prior_.information.setZero();
  const auto know = [this](int column, double sigma) {
    prior_.information.diagonal().segment<3>(3 * column).setConstant(1 / (sigma * sigma));
  };
  for (int coil = 0; coil < static_cast<int>(instrument_.coils.size()); ++coil) {
    know(map_.position_error_column(coil), state_.lasting_position_mm);
    know(map_.tangent_error_column(coil), state_.lasting_tangent);
  }
  for (int column = map_.first_further_column(); column < map_.column_count(); ++column) {
    know(column, 1);  // of the motion, which begin_with() sets
  }
}

// Mean and covariance of what was measured, from the shape that start_ has found.
bool RecursiveEstimator::begin_with(const CoilObservations& coils, std::span<const ViewConstraints> lines,
                                    TubeEstimate& estimate) {
  const CoilNoise& noise = state_.noise;
  Eigen::Matrix3Xd& C = state_.C;
  C.setZero();
  C.leftCols(start_.C().cols()) = start_.C();
  state_.bending = start_.bending();
  state_.rival = start_.rival();
  state_.is_ambiguous = start_.is_ambiguous();
  map_.set_bending(state_.bending);
  map_.set_strain_slack(kStrainSlack);
  map_.set_coil_noise(noise.noise_position_mm(), noise.noise_tangent());
  estimate.iterations +=
      static_cast<std::uint32_t>(map_.refine(coils, lines, &prior_, settings_.iterations, C, converged_));
  map_.set_strain_slack(kNoStrain);
  const bool inverted = map_.invert_at(coils, lines, &prior_, C);
  map_.set_strain_slack(kStrainSlack);
  if (!inverted) {
    return false;
  }
  state_.P = map_.coefficient_covariance();
  motion_.begin(C, state_.P);
  state_.m = C;
  return true;
}

}  // namespace tubed
