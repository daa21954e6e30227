#include "daemon/estimator/single_frame_estimator.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace tubed {

namespace {

constexpr double kLineSpacing_mm = 2.0;
constexpr double kTransition_px = 0.7;  // change of the offset from one line to the next
constexpr double kViewMargin_px = 3.0;  // lines whose base is nearer to the border are not searched
constexpr std::array<int, 3> kRoundDivisors = {1, 2,
                                               3};  // reach of each round's lines: image_search_px / this
constexpr double kOutlierGain = 30.0;  // cost one coil must save to be called an outlier (chi^2, 5 dof, 1e-5)
constexpr double kLostInlierRatio = 0.5;  // fewer agreeing lines: the image does not show the tube
constexpr int kFewestLines = 10;          // with fewer lines in view an image says nothing
constexpr double kTubeSpeed_mm_s = 20.0;  // how fast an aged image line loses its worth

std::array<float, 6> upper_triangle(const Eigen::Matrix3d& m) {
  return {static_cast<float>(m(0, 0)), static_cast<float>(m(0, 1)), static_cast<float>(m(0, 2)),
          static_cast<float>(m(1, 1)), static_cast<float>(m(1, 2)), static_cast<float>(m(2, 2))};
}

}  // namespace

std::string_view name_of(EstimatorMode mode) { return mode == EstimatorMode::kEm ? "em" : "joint"; }

std::unique_ptr<Estimator> make_estimator(const EstimatorSettings& settings,
                                          const InstrumentDescription& instrument,
                                          const RoomDescription& room) {
  if (instrument.coils.empty() || instrument.coils.size() > static_cast<std::size_t>(kMaxCoils)) {
    throw std::invalid_argument("instrument '" + instrument.id + "' needs 1 to " + std::to_string(kMaxCoils) +
                                " coils");
  }
  return std::make_unique<SingleFrameEstimator>(settings, instrument, room);
}

SingleFrameEstimator::SingleFrameEstimator(const EstimatorSettings& settings,
                                           const InstrumentDescription& instrument,
                                           const RoomDescription& room)
    : settings_(settings),
      instrument_(instrument),
      T_world_em_(room.T_world_em),
      registered_(room.registered),
      map_(settings, instrument.length_mm),
      C_(Eigen::Matrix3Xd::Zero(3, settings.coefficient_count)),
      C_without_(C_) {
  line_count_ = std::min(LineSearch::kMaxLines, static_cast<int>(instrument.length_mm / kLineSpacing_mm) + 1);
  line_spacing_mm_ = instrument.length_mm / (line_count_ - 1);
  for (const CameraCalibration& calibration : room.cameras) {
    views_.push_back(View{Camera(calibration)});
  }
}

void SingleFrameEstimator::reset() noexcept {
  for (View& view : views_) {
    view.count = 0;
    view.exposure = MonotonicTime{};
  }
  has_shape_ = false;
  has_covariance_ = false;
}

void SingleFrameEstimator::estimate(const Observation& observation, TubeEstimate& estimate) noexcept {
  estimate.reasons = Reasons{};
  estimate.has_image = false;
  estimate.is_image_instant = observation.is_image_instant;
  estimate.iterations = 0;
  estimate.image_inlier_ratio = 0;
  estimate.in_view_ratio = 0;
  const EmFrame* frame = observation.em->newest_until(observation.instant);
  const bool stale =
      frame == nullptr || seconds_between(frame->measured, observation.now) * 1e3 > settings_.em_stale_ms;
  CoilObservations coils = observe_coils(frame, *observation.em, instrument_, T_world_em_,
                                         static_cast<std::int64_t>(settings_.em_stuck_ms * 1e6));
  if (frame != nullptr && frame->origin != Origin::kDevice) {
    estimate.reasons.add(frame->origin == Origin::kSimulated ? Reason::kDemoData : Reason::kReplayData);
  }
  if (stale) {
    estimate.reasons.add(Reason::kEmStale);
  } else if (solve_em(coils, estimate)) {
    if (settings_.mode == EstimatorMode::kJoint && registered_) {
      fuse_images(observation, coils, estimate);
    }
    has_covariance_ = map_.invert_at(coils, constraints_.data(), gather_views(observation.instant), C_);
    has_shape_ = true;
    // A tick's shape is of its newest measurement; the instant of an image is its exposure.
    shape_time_ = observation.is_image_instant ? observation.instant : frame->measured;
  }
  write_shape(estimate);
  write_coils(coils, estimate);
  write_ages(observation, frame, estimate);
  judge(observation, coils, estimate);
}

bool SingleFrameEstimator::solve_em(CoilObservations& coils, TubeEstimate& estimate) {
  if (!map_.solve_linear(coils, C_)) {
    return false;
  }
  estimate.iterations +=
      static_cast<std::uint32_t>(map_.refine(coils, nullptr, 0, settings_.iterations, C_, converged_));
  reject_outlier(coils);
  return true;
}

// A coil that reports OK but contradicts the others: leaving it out must save far more than its own five
// residuals can explain. With fewer than four usable coils there is no majority to ask.
void SingleFrameEstimator::reject_outlier(CoilObservations& coils) {
  if (coils.used_count() < 4) {
    return;
  }
  const double cost = map_.contradiction(coils, C_);
  double best_cost = cost - kOutlierGain;
  int outlier = -1;
  // Cheap way out: the whole cost is too small for any coil to save so much.
  for (int i = 0; i < coils.count && best_cost > 0; ++i) {
    CoilObservation& coil = coils.coils[static_cast<std::size_t>(i)];
    if (!coil.used()) {
      continue;
    }
    coil.state = CoilState::kOutlier;
    bool converged = false;
    if (map_.solve_linear(coils, C_without_)) {
      map_.refine(coils, nullptr, 0, settings_.iterations, C_without_, converged);
      const double cost_without = map_.contradiction(coils, C_without_);
      if (cost_without < best_cost) {
        best_cost = cost_without;
        outlier = i;
      }
    }
    coil.state = CoilState::kUsed;
  }
  if (outlier >= 0) {
    coils.coils[static_cast<std::size_t>(outlier)].state = CoilState::kOutlier;
    map_.solve_linear(coils, C_);
    map_.refine(coils, nullptr, 0, settings_.iterations, C_, converged_);
  }
}

void SingleFrameEstimator::fuse_images(const Observation& observation, const CoilObservations& coils,
                                       TubeEstimate& estimate) {
  for (const int divisor : kRoundDivisors) {
    const int reach =
        std::clamp(static_cast<int>(settings_.image_search_px) / divisor, 3, LineSearch::kMaxReach);
    const bool looked = measure_images(observation, reach, estimate);
    const int view_count = gather_views(observation.instant);
    if (view_count == 0) {
      return;
    }
    estimate.iterations += static_cast<std::uint32_t>(
        map_.refine(coils, constraints_.data(), view_count, settings_.iterations, C_, converged_));
    if (!looked) {
      return;  // only lines of an earlier image: one round is all they can give
    }
  }
}

// Looks for the tube in every image of the instant; false when there was none to look at.
bool SingleFrameEstimator::measure_images(const Observation& observation, int reach_px,
                                          TubeEstimate& estimate) {
  bool looked = false;
  estimate.has_image = false;
  estimate.image_inlier_ratio = 0;
  estimate.in_view_ratio = 0;
  for (std::size_t v = 0; v < views_.size(); ++v) {
    const ImageMeasurement* image = observation.images[v];
    if (image == nullptr || image->state != ImageState::kMeasured) {
      continue;
    }
    View& view = views_[v];
    measure_view(*image, view, reach_px);
    looked = true;
    estimate.has_image = estimate.has_image || view.count > 0;
    estimate.image_inlier_ratio =
        std::max(estimate.image_inlier_ratio, static_cast<float>(view.inlier_ratio));
    estimate.in_view_ratio = std::max(estimate.in_view_ratio, static_cast<float>(view.in_view_ratio));
  }
  return looked;
}

void SingleFrameEstimator::project_lines(View& view, int& in_view) {
  in_view = 0;
  for (int i = 0; i < line_count_; ++i) {
    CorrespondenceLine& line = lines_[static_cast<std::size_t>(i)];
    const CubicBasis basis = map_.spline().basis(i * line_spacing_mm_);
    const auto projection = view.camera.project(combine(C_, basis.first, basis.value));
    line.in_view = projection && view.camera.contains(projection->p_image_px, kViewMargin_px);
    if (!line.in_view) {
      continue;
    }
    const Eigen::Vector2d along =
        projection->J_image_world * combine(C_, basis.first, basis.first_derivative);
    const double length = along.norm();
    // A tube running straight toward the source has no side to look to.
    line.in_view = length > 0.2;
    line.base_px = projection->p_image_px;
    line.normal = Eigen::Vector2d(-along.y(), along.x()) / std::max(length, 1e-9);
    in_view += line.in_view ? 1 : 0;
  }
}

void SingleFrameEstimator::measure_view(const ImageMeasurement& image, View& view, int reach_px) {
  view.count = 0;
  view.exposure = image.exposure;
  int in_view = 0;
  project_lines(view, in_view);
  view.in_view_ratio = static_cast<double>(in_view) / line_count_;
  view.inlier_ratio = 0;
  if (in_view < kFewestLines) {
    return;
  }
  const LineSearch::Outcome outcome = search_.search(image, lines_, line_count_, reach_px, kTransition_px);
  view.inlier_ratio = outcome.inlier_ratio;
  if (outcome.inlier_ratio < kLostInlierRatio) {
    return;
  }
  for (int i = 0; i < line_count_; ++i) {
    const CorrespondenceLine& line = lines_[static_cast<std::size_t>(i)];
    if (line.in_view) {
      const double variance =
          (line.variance_px2 + settings_.sigma_image_px * settings_.sigma_image_px) * settings_.image_temper;
      view.constraints[static_cast<std::size_t>(view.count++)] = {
          i * line_spacing_mm_, line.base_px + line.offset_px * line.normal, line.normal, variance};
    }
  }
}

// Lines of this instant count as measured; those of an earlier image lose their worth with the way the tube
// may have gone since, and are dropped once they are older than image_stale_ms.
int SingleFrameEstimator::gather_views(MonotonicTime instant) {
  int gathered = 0;
  for (View& view : views_) {
    const double age_s = std::abs(seconds_between(view.exposure, instant));
    if (view.count == 0 || to_ns(view.exposure) == 0 || age_s * 1e3 > settings_.image_stale_ms) {
      continue;
    }
    const double pixels_per_mm = view.camera.calibration().fx / 1000.0;
    const double drift_px = kTubeSpeed_mm_s * age_s * pixels_per_mm;
    for (std::size_t i = 0; i < static_cast<std::size_t>(view.count); ++i) {
      view.aged[i] = view.constraints[i];
      view.aged[i].variance_px2 += drift_px * drift_px * settings_.image_temper;
    }
    constraints_[static_cast<std::size_t>(gathered++)] = {&view.camera, view.aged.data(), view.count};
  }
  return gathered;
}

void SingleFrameEstimator::write_shape(TubeEstimate& estimate) const {
  estimate.valid_time_ns = to_ns(shape_time_);
  estimate.radius_mm = static_cast<float>(instrument_.diameter_mm / 2);
  estimate.length_mm = static_cast<float>(instrument_.length_mm);
  estimate.point_count = has_shape_ ? kMaxCentrelinePoints : 0;
  estimate.coefficient_count = has_shape_ ? static_cast<std::uint32_t>(C_.cols()) : 0;
  estimate.coefficient_spacing_mm = static_cast<float>(map_.spline().spacing_mm());
  for (std::size_t i = 0; i < estimate.coefficient_count; ++i) {
    Eigen::Map<Eigen::Vector3d>(estimate.coefficients_mm[i].data()) = C_.col(static_cast<Eigen::Index>(i));
  }
  for (std::size_t i = 0; i < estimate.point_count; ++i) {
    CentrelinePoint& point = estimate.points[i];
    const double s_mm = instrument_.length_mm * static_cast<double>(i) / (kMaxCentrelinePoints - 1);
    const CubicBasis basis = map_.spline().basis(s_mm);
    Eigen::Map<Eigen::Vector3d>(point.p_world_mm.data()) = combine(C_, basis.first, basis.value);
    const Eigen::Vector3d derivative = combine(C_, basis.first, basis.first_derivative);
    Eigen::Map<Eigen::Vector3f>(point.tangent_world.data()) = (-derivative.normalized()).cast<float>();
    if (has_covariance_) {
      point.covariance_mm2 = upper_triangle(map_.covariance(s_mm));
    } else {
      point.covariance_mm2.fill(std::numeric_limits<float>::infinity());
    }
  }
}

void SingleFrameEstimator::write_coils(const CoilObservations& coils, TubeEstimate& estimate) const {
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
  estimate.coil_count = static_cast<std::uint32_t>(coils.count);
  for (std::size_t i = 0; i < estimate.coil_count; ++i) {
    const CoilObservation& coil = coils.coils[i];
    CoilResidual& residual = estimate.coils[i];
    residual = {coil.state, static_cast<float>(coil.s_mm), kNaN, kNaN};
    const bool posed = coil.used() || coil.state == CoilState::kOutlier || coil.state == CoilState::kStuck;
    if (!posed || !has_shape_) {
      continue;
    }
    const CubicBasis basis = map_.spline().basis(coil.s_mm);
    const Eigen::Vector3d tangent = -combine(C_, basis.first, basis.first_derivative).normalized();
    residual.position_mm =
        static_cast<float>((combine(C_, basis.first, basis.value) - coil.p_world_mm).norm());
    residual.angle_rad =
        static_cast<float>(std::acos(std::clamp(tangent.dot(coil.tangent_world), -1.0, 1.0)));
  }
}

void SingleFrameEstimator::write_ages(const Observation& observation, const EmFrame* frame,
                                      TubeEstimate& estimate) const {
  estimate.em_frame = frame != nullptr ? frame->tracker_frame : 0;
  estimate.em_age_ns = frame != nullptr ? to_ns(observation.now) - to_ns(frame->measured) : -1;
  estimate.stamps.em_measured_ns = frame != nullptr ? to_ns(frame->measured) : 0;
  estimate.stamps.em_received_ns = frame != nullptr ? to_ns(frame->received) : 0;
  MonotonicTime newest{};
  for (const View& view : views_) {
    newest = view.count > 0 ? std::max(newest, view.exposure) : newest;
  }
  estimate.image_age_ns = to_ns(newest) != 0 ? to_ns(observation.now) - to_ns(newest) : -1;
}

// The word of contract.md. INVALID: there is no shape of now. QUESTIONABLE: something that should have helped
// did not.
void SingleFrameEstimator::judge(const Observation& observation, const CoilObservations& coils,
                                 TubeEstimate& estimate) const {
  int lost = 0;
  for (int i = 0; i < coils.count; ++i) {
    const CoilState state = coils.coils[static_cast<std::size_t>(i)].state;
    lost += state == CoilState::kUsed ? 0 : 1;
    switch (state) {
      case CoilState::kUsed:
        break;
      case CoilState::kMissing:
      case CoilState::kDisabled:
        estimate.reasons.add(Reason::kCoilLost);
        break;
      case CoilState::kOutOfVolume:
        estimate.reasons.add(Reason::kOutOfVolume);
        break;
      case CoilState::kOutlier:
        estimate.reasons.add(Reason::kCoilOutlier);
        break;
      case CoilState::kStuck:
        estimate.reasons.add(Reason::kEmStuck);
        break;
    }
  }
  bool doubtful = lost > 0;
  for (const ImageMeasurement* image : observation.images) {
    if (image != nullptr && image->origin != Origin::kDevice) {
      estimate.reasons.add(image->origin == Origin::kSimulated ? Reason::kDemoData : Reason::kReplayData);
    }
  }
  if (settings_.mode == EstimatorMode::kJoint) {
    const bool stale =
        seconds_between(observation.newest_image, observation.now) * 1e3 > settings_.image_stale_ms;
    if (observation.fluoroscopy_off) {
      estimate.reasons.add(Reason::kImageOff);
    } else if (observation.image_rejected) {
      estimate.reasons.add(Reason::kImageRejected);
      doubtful = true;
    } else if (stale) {
      estimate.reasons.add(Reason::kImageStale);
      doubtful = true;
    }
    const bool looked = observation.is_image_instant && estimate.in_view_ratio > 0;
    if (looked && estimate.image_inlier_ratio < kLostInlierRatio) {
      estimate.reasons.add(Reason::kImageLostTube);
      doubtful = true;
    }
  } else {
    estimate.reasons.add(Reason::kImageOff);
  }
  if (!registered_) {
    estimate.reasons.add(Reason::kNoRegistration);
    doubtful = true;
  }
  if (!converged_ && has_shape_) {
    estimate.reasons.add(Reason::kNotConverged);
    doubtful = true;
  }
  if (!has_shape_) {
    estimate.reasons.add(Reason::kInitialising);
    estimate.validity = Validity::kNotAvailable;
  } else if (estimate.reasons.has(Reason::kEmStale) || coils.used_count() < 2) {
    estimate.validity = Validity::kInvalid;
  } else {
    estimate.validity = doubtful ? Validity::kQuestionable : Validity::kValid;
  }
}

}  // namespace tubed
