#include "daemon/estimator/tip/preshaped_estimator.hpp"

#include <algorithm>
#include <cmath>

#include "daemon/estimator/report.hpp"
#include "idl/geometry/image_mask.hpp"
#include "idl/geometry/squared.hpp"

namespace tubed {

namespace {

// Not of the instrument: what is said then moves all of the tube.
bool is_of_the_room(const EmImageAgreement& agreement) {
  const Discord explanation = agreement.explanation;
  return agreement.disagree &&
         (explanation == Discord::kRegistration || explanation == Discord::kMagnification);
}

}  // namespace

EstimatorSettings PreshapedEstimator::settings_for_hooks(const EstimatorSettings& settings,
                                                         double length_mm) {
  EstimatorSettings denser = settings;
  const int wanted = static_cast<int>(std::ceil(length_mm / kHookSpacing_mm)) + 3;
  denser.coefficient_count = std::clamp(wanted, settings.coefficient_count, kMaxCoefficients);
  return denser;
}

PreshapedEstimator::PreshapedEstimator(const EstimatorSettings& settings,
                                       const InstrumentDescription& instrument, const RoomDescription& room)
    : settings_(settings),
      instrument_(instrument),
      T_world_em_(room.T_world_em),
      registered_(room.registered),
      tip_shape_(settings_for_hooks(settings, instrument.length_mm), instrument, room),
      C_(Eigen::Matrix3Xd::Zero(3, settings_for_hooks(settings, instrument.length_mm).coefficient_count)) {
  for (const CameraCalibration& camera : room.cameras) {
    cameras_.emplace_back(camera);
  }
}

void PreshapedEstimator::reset() noexcept {
  tip_shape_.reset();
  hooked_->set_rest(tip_shape_.rest());
  straight_->reset();
  hooked_->reset();
  doubt_ = TipDoubt::kNone;
  is_room_wrong_ = false;
}

CoilObservations PreshapedEstimator::observe(const Observation& observation) const {
  return observe_coils(observation.em->newest_until(observation.instant), *observation.em, instrument_,
                       T_world_em_, static_cast<std::int64_t>(settings_.em_stuck_ms * 1e6));
}

void PreshapedEstimator::update(const Observation& observation, TubeEstimate& estimate) noexcept {
  const CoilObservations coils = observe(observation);
  active().update(observation, estimate);
  note_shape(estimate);
  is_room_wrong_ = is_of_the_room(estimate.agreement);
  if (estimate.is_image_instant && estimate.has_image && estimate.point_count > 0) {
    note_views(observation, estimate);
  }
  add_error_of_making(coils, estimate);
  doubt_ = estimate.point_count > 0 ? tip_shape_.doubt(coils) : TipDoubt::kNone;
  if (doubt_ != TipDoubt::kNone) {
    estimate.reasons.add(is_ambiguous(doubt_) ? Reason::kAmbiguous : Reason::kTipNotSeen);
    release_tip(coils.first_used_mm(), estimate);
    if (estimate.validity == Validity::kValid) estimate.validity = Validity::kQuestionable;
  }
}

void PreshapedEstimator::look_further(const Observation& observation) noexcept {
  // Where the room is wrong coils and images contradict each other at the tip, too, whatever its shape.
  if (is_room_wrong_) return;
  if (registered_ && observation.is_image_instant && tip_shape_.ask(observation, observe(observation))) {
    // What was bent by another rest shape than it has predicts nothing.
    hooked_->set_rest(tip_shape_.rest());
    active().reset();
  }
}

void PreshapedEstimator::note_shape(const TubeEstimate& estimate) {
  if (tip_shape_.rest() == nullptr || static_cast<Eigen::Index>(estimate.coefficient_count) != C_.cols()) {
    return;
  }
  for (Eigen::Index i = 0; i < C_.cols(); ++i) {
    C_.col(i) =
        Eigen::Map<const Eigen::Vector3d>(estimate.coefficients_mm[static_cast<std::size_t>(i)].data());
  }
  tip_shape_.note_shape(C_);
}

void PreshapedEstimator::add_error_of_making(const CoilObservations& coils, TubeEstimate& estimate) const {
  const Eigen::Matrix3d unseen = tip_shape_.unseen_directions();
  for (std::size_t i = 0; i < estimate.point_count; ++i) {
    const double s_mm = place_of_point_mm(i, estimate);
    const double making_mm = tip_shape_.sigma_of_making_mm(s_mm, coils);
    const double unknown_mm = tip_shape_.sigma_of_unknown_tip_mm(s_mm, coils);
    if (making_mm == 0 && unknown_mm == 0) return;  // nor behind it
    CentrelinePoint& point = estimate.points[i];
    const bool is_seen = (point.held_by & kHeldByImage) != 0;
    const Eigen::Matrix3d all = Eigen::Matrix3d::Identity();
    const Eigen::Matrix3d added = squared(making_mm) * all + squared(unknown_mm) * (is_seen ? unseen : all);
    std::size_t at = 0;
    for (Eigen::Index row = 0; row < 3; ++row) {
      for (Eigen::Index column = row; column < 3; ++column) {
        point.covariance_mm2[at++] += static_cast<float>(added(row, column));
      }
    }
  }
}

// Which cameras look at the tip.
void PreshapedEstimator::note_views(const Observation& observation, const TubeEstimate& estimate) {
  const Eigen::Vector3d tip_world_mm =
      Eigen::Map<const Eigen::Vector3d>(estimate.points[0].p_world_mm.data());
  for (std::size_t view = 0; view < cameras_.size(); ++view) {
    const ImageMeasurement* const image = observation.images[view];
    if (image == nullptr || image->state != ImageState::kMeasured) {
      continue;
    }
    Camera& camera = cameras_[view];
    camera.look_from(image->geometry);
    const auto at = camera.project(tip_world_mm);
    if (at && camera.contains(at->p_image_px) && !is_masked(camera.calibration(), at->p_image_px)) {
      tip_shape_.note_view(view, observation.instant,
                           camera.calibration().T_camera_world.linear().row(2).transpose());
    }
  }
}

bool PreshapedEstimator::describe_disagreement(std::span<char> words) const noexcept {
  if (active().describe_disagreement(words)) {
    return true;
  }
  if (doubt_ == TipDoubt::kNone) {
    return false;
  }
  write_tip_doubt(doubt_, instrument_, words);
  return true;
}

}  // namespace tubed
