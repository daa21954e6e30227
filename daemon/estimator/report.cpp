#include "daemon/estimator/report.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

namespace tubed {

std::array<float, 6> upper_triangle(const Eigen::Matrix3d& m) {
  return {static_cast<float>(m(0, 0)), static_cast<float>(m(0, 1)), static_cast<float>(m(0, 2)),
          static_cast<float>(m(1, 1)), static_cast<float>(m(1, 2)), static_cast<float>(m(2, 2))};
}

namespace {

/// Adds what the coils say; the number of those that could not be used.
int judge_coils(const CoilObservations& coils, TubeEstimate& estimate) {
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
  return lost;
}

/// Adds what the images say; true when that is a reason for doubt.
bool judge_images(const Observation& observation, const Findings& findings, TubeEstimate& estimate) {
  if (!findings.uses_images || observation.fluoroscopy_off) {
    estimate.reasons.add(Reason::kImageOff);
    const bool is_lost = findings.uses_images && findings.images == ImageVerdict::kLost;
    if (is_lost) estimate.reasons.add(Reason::kImageLostTube);
    return is_lost;
  }
  for (const ImageMeasurement* image : observation.images) {
    if (image != nullptr && image->origin != Origin::kDevice) {
      estimate.reasons.add(image->origin == Origin::kSimulated ? Reason::kDemoData : Reason::kReplayData);
    }
  }
  bool doubtful = observation.geometry_changed;
  if (observation.geometry_changed) {
    estimate.reasons.add(Reason::kGeometryChanged);
  }
  if (observation.image_rejected) {
    estimate.reasons.add(Reason::kImageRejected);
    doubtful = true;
  } else if (observation.now - std::max(observation.newest_image, observation.newest_left_out) >
             observation.image_timeout) {
    estimate.reasons.add(Reason::kImageStale);
    doubtful = true;
  }
  if (findings.images == ImageVerdict::kLost) {
    estimate.reasons.add(Reason::kImageLostTube);
    doubtful = true;
  } else if (findings.images == ImageVerdict::kContradicts) {
    estimate.reasons.add(Reason::kCoilOutlier);
    doubtful = true;
  }
  return doubtful;
}

constexpr double kLostMemory_s = 3;  // of which images showed the tube
constexpr double kMostlyLost = 0.7;
constexpr double kMoreThanHalf = 0.5;
constexpr double kLostInOneFor_s = 10;  // of a camera that brings no further image

}  // namespace

// An image that shows the tube for once, where most before it did not, may show something else there.
ImageVerdict LostTube::standing(const Observation& observation, ImageVerdict images, const TubeViews* views) {
  if (observation.is_image_instant && images != ImageVerdict::kNone) {
    const bool lost_now = images == ImageVerdict::kLost;
    const double dt_s =
        to_ns(judged_) == 0 ? 0 : std::max(seconds_between(judged_, observation.instant), 0.0);
    const double kept = std::exp(-dt_s / kLostMemory_s);
    lost_share_ = kept * lost_share_ + (1 - kept) * (lost_now ? 1 : 0);
    judged_ = std::max(judged_, observation.instant);
    is_lost_ = lost_now || lost_share_ > kMostlyLost;
    if (views != nullptr) ask_each(*views, observation.instant, images);
  }
  const bool is_lost = observation.fluoroscopy_off ? lost_share_ > kMoreThanHalf
                                                   : is_lost_ || is_lost_in_one(observation.instant);
  return is_lost ? ImageVerdict::kLost : images;
}

// A short piece takes nothing back by itself, but where the images together are believed it was confirmed.
void LostTube::ask_each(const TubeViews& views, MonotonicTime instant, ImageVerdict images) {
  for (std::size_t view = 0; view < std::min(views.count(), lost_in_.size()); ++view) {
    const auto shows = views.shows_tube(view, instant);
    const bool shows_piece = images == ImageVerdict::kShowsTube &&
                             views.agreeing(view, instant).value_or(0) >= TubeViews::kMinFound;
    if (shows.value_or(false) || shows_piece) {
      lost_in_[view] = MonotonicTime{};
    } else if (shows) {
      lost_in_[view] = instant;
    }
  }
}

bool LostTube::is_lost_in_one(MonotonicTime now) const {
  return std::ranges::any_of(lost_in_, [now](MonotonicTime lost) {
    return to_ns(lost) != 0 && std::abs(seconds_between(lost, now)) < kLostInOneFor_s;
  });
}

void begin_report(const Observation& observation, TubeEstimate& estimate) {
  estimate.reasons = Reasons{};
  estimate.has_image = false;
  estimate.is_image_instant = observation.is_image_instant;
  estimate.iterations = 0;
  estimate.image_inlier_ratio = 0;
  estimate.in_view_ratio = 0;
}

bool is_stale(const EmFrame* frame, const Observation& observation, const EstimatorSettings& settings) {
  const EmFrame* const newest = observation.em->newest_until(observation.now);
  if (frame == nullptr || newest == nullptr) {
    return true;
  }
  const std::chrono::nanoseconds timeout = observation.em->timeout(
      std::chrono::nanoseconds(static_cast<std::int64_t>(settings.em_stale_ms * 1e6)));
  return observation.now - newest->measured > timeout || observation.instant - frame->measured > timeout;
}

void write_shape(const FoundShape& shape, const InstrumentDescription& instrument, TubeEstimate& estimate) {
  estimate.valid_time_ns = to_ns(shape.time);
  estimate.radius_mm = static_cast<float>(instrument.diameter_mm / 2);
  estimate.length_mm = static_cast<float>(instrument.length_mm);
  estimate.point_count = shape.C != nullptr ? kMaxCentrelinePoints : 0;
  estimate.coefficient_count =
      shape.C != nullptr ? static_cast<std::uint32_t>(shape.spline->coefficient_count()) : 0;
  estimate.coefficient_spacing_mm = static_cast<float>(shape.spline->spacing_mm());
  estimate.agreement = shape.agreement != nullptr ? shape.agreement->summary() : EmImageAgreement{};
  for (std::size_t i = 0; i < estimate.coefficient_count; ++i) {
    Eigen::Map<Eigen::Vector3d>(estimate.coefficients_mm[i].data()) =
        shape.C->col(static_cast<Eigen::Index>(i));
  }
  Eigen::Matrix3d jumped_mm2 = Eigen::Matrix3d::Zero();
  if (shape.common_jump != nullptr) jumped_mm2 = shape.common_jump->square_mm2(shape.time);
  for (std::size_t i = 0; i < estimate.point_count; ++i) {
    CentrelinePoint& point = estimate.points[i];
    const double s_mm = instrument.length_mm * static_cast<double>(i) / (kMaxCentrelinePoints - 1);
    const CubicBasis basis = shape.spline->basis(s_mm);
    Eigen::Map<Eigen::Vector3d>(point.p_world_mm.data()) = combine(*shape.C, basis.first, basis.value);
    const Eigen::Vector3d derivative = combine(*shape.C, basis.first, basis.first_derivative);
    Eigen::Map<Eigen::Vector3f>(point.tangent_world.data()) = (-derivative.normalized()).cast<float>();
    if (shape.covariance != nullptr) {
      Eigen::Matrix3d covariance_mm2 = shape.variance_factor * shape.covariance->covariance(s_mm);
      if (shape.rival != nullptr) {
        const Eigen::Vector3d way_mm = combine(*shape.rival, basis.first, basis.value);
        covariance_mm2 += way_mm * way_mm.transpose();
      }
      if (shape.agreement != nullptr) {
        covariance_mm2 += shape.agreement->doubt(
            {s_mm, Eigen::Map<Eigen::Vector3d>(point.p_world_mm.data()), derivative.normalized(), jumped_mm2},
            shape.time);
      } else {
        covariance_mm2 += jumped_mm2;
      }
      if (shape.loose_ends != nullptr) {
        covariance_mm2 += shape.loose_ends->square_mm2(
            s_mm, Eigen::Map<Eigen::Vector3d>(point.p_world_mm.data()), shape.time);
      }
      if (shape.end_jumps != nullptr) {
        covariance_mm2 += shape.end_jumps->square_mm2(s_mm, shape.time);
      }
      point.covariance_mm2 = upper_triangle(covariance_mm2);
    } else {
      point.covariance_mm2.fill(std::numeric_limits<float>::infinity());
    }
  }
}

double place_of_point_mm(std::size_t point, const TubeEstimate& estimate) {
  return static_cast<double>(estimate.length_mm) * static_cast<double>(point) / (kMaxCentrelinePoints - 1);
}

void write_held_by_coils(const CoilObservations& coils, TubeEstimate& estimate) {
  estimate.view_count = 0;
  const bool is_of_now = !estimate.reasons.has(Reason::kEmStale);
  for (std::size_t i = 0; i < estimate.point_count; ++i) {
    estimate.points[i].held_by = is_of_now && coils.hold(place_of_point_mm(i, estimate)) ? kHeldByCoil : 0;
  }
}

void release_tip(double coil_mm, TubeEstimate& estimate) {
  for (std::size_t i = 0; i < estimate.point_count; ++i) {
    if (place_of_point_mm(i, estimate) < coil_mm) estimate.points[i].held_by &= ~kHeldByCoil;
  }
}

void write_held_by_images(const Observation& observation, const TubeViews& views, TubeEstimate& estimate) {
  if (estimate.reasons.has(Reason::kEmStale)) {
    return;  // the shape is an old one
  }
  for (std::size_t view = 0; view < views.count(); ++view) {
    if (const auto used = views.used(view, observation)) {
      estimate.views[estimate.view_count++] = *used;
    }
  }
  for (std::size_t i = 0; estimate.view_count > 0 && i < estimate.point_count; ++i) {
    if (views.shows(place_of_point_mm(i, estimate), observation)) {
      estimate.points[i].held_by |= kHeldByImage;
    }
  }
}

void add_reference_error(const EmFrame* frame, const EmHistory& history, const RigidTransform& T_world_em,
                         TubeEstimate& estimate) {
  const ReferenceError error = history.placement(frame).error.in(T_world_em);
  for (std::size_t i = 0; i < estimate.point_count; ++i) {
    CentrelinePoint& point = estimate.points[i];
    const Eigen::Vector3d p_world_mm = Eigen::Map<const Eigen::Vector3d>(point.p_world_mm.data());
    const std::array<float, 6> added = upper_triangle(error.covariance_at(p_world_mm));
    std::transform(added.begin(), added.end(), point.covariance_mm2.begin(), point.covariance_mm2.begin(),
                   std::plus<>());
  }
}

void write_coils(const CoilObservations& coils, const FoundShape& shape, TubeEstimate& estimate) {
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
  estimate.coil_count = static_cast<std::uint32_t>(coils.count);
  for (std::size_t i = 0; i < estimate.coil_count; ++i) {
    const CoilObservation& coil = coils.coils[i];
    CoilResidual& residual = estimate.coils[i];
    residual = {coil.state, static_cast<float>(coil.s_mm), kNaN, kNaN};
    const bool posed = coil.used() || coil.state == CoilState::kOutlier || coil.state == CoilState::kStuck;
    if (!posed || shape.C == nullptr) {
      continue;
    }
    const CubicBasis basis = shape.spline->basis(coil.s_mm);
    const Eigen::Vector3d tangent = -combine(*shape.C, basis.first, basis.first_derivative).normalized();
    residual.position_mm =
        static_cast<float>((combine(*shape.C, basis.first, basis.value) - coil.p_world_mm).norm());
    residual.angle_rad =
        static_cast<float>(std::acos(std::clamp(tangent.dot(coil.tangent_world), -1.0, 1.0)));
  }
}

namespace {

/// Of a measurement at the instant of the shape.
std::int64_t age_at(std::int64_t valid_time_ns, MonotonicTime measured) {
  return valid_time_ns != 0 && to_ns(measured) != 0 ? valid_time_ns - to_ns(measured) : kNoAge;
}

}  // namespace

void write_measurements(const EmFrame* frame, MonotonicTime newest_image, TubeEstimate& estimate) {
  estimate.em_frame = frame != nullptr ? frame->tracker_frame : 0;
  estimate.em_age_ns = frame != nullptr ? age_at(estimate.valid_time_ns, frame->measured) : kNoAge;
  estimate.stamps.em_measured_ns = frame != nullptr ? to_ns(frame->measured) : 0;
  estimate.stamps.em_received_ns = frame != nullptr ? to_ns(frame->received) : 0;
  estimate.image_age_ns = age_at(estimate.valid_time_ns, newest_image);
  if (frame != nullptr && frame->origin != Origin::kDevice) {
    estimate.reasons.add(frame->origin == Origin::kSimulated ? Reason::kDemoData : Reason::kReplayData);
  }
}

void judge(const Observation& observation, const CoilObservations& coils, const Findings& findings,
           TubeEstimate& estimate) {
  const bool has_shape = estimate.point_count > 0;
  bool doubtful = judge_coils(coils, estimate) > 0;
  doubtful = judge_images(observation, findings, estimate) || doubtful;
  if (!findings.registered) {
    estimate.reasons.add(Reason::kNoRegistration);
    doubtful = true;
  }
  const ReferenceDoubt reference = observation.em->reference().doubt(observation.now);
  if (reference != ReferenceDoubt::kNone) {
    estimate.reasons.add(Reason::kReferenceLost);
    doubtful = true;
  }
  if (has_shape && !findings.converged) {
    estimate.reasons.add(Reason::kNotConverged);
    doubtful = true;
  }
  if (has_shape && findings.em_image_disagree) {
    estimate.reasons.add(Reason::kEmImageDisagree);
    doubtful = true;
  }
  if (has_shape && findings.lost_ends.tip) {
    estimate.reasons.add(Reason::kTipNotSeen);
    release_tip(coils.first_used_mm(), estimate);
    doubtful = true;
  }
  if (has_shape && findings.lost_ends.tail) {
    estimate.reasons.add(Reason::kImageLostTube);
    doubtful = true;
  }
  if (has_shape && findings.ambiguous) {
    estimate.reasons.add(Reason::kAmbiguous);
    release_tip(coils.first_used_mm(), estimate);
    doubtful = true;
  }
  if (!has_shape) {
    estimate.reasons.add(Reason::kInitialising);
    estimate.validity = Validity::kNotAvailable;
  } else if (estimate.reasons.has(Reason::kEmStale) || coils.used_count() < 2 ||
             reference == ReferenceDoubt::kLost) {
    estimate.validity = Validity::kInvalid;
  } else {
    estimate.validity = doubtful ? Validity::kQuestionable : Validity::kValid;
  }
}

}  // namespace tubed
