#include "daemon/estimator/paper/paper_estimator.hpp"

#include <algorithm>
#include <cmath>
#include <exception>

#include "daemon/image/measured_view.hpp"
#include "daemon/image/vesselness_meter.hpp"

namespace tubed {

namespace {

constexpr int kPublishedCoefficients = 48;
constexpr double kRested_mm =
    0.05;  // root mean square of the knot points' move in a round that ends the rounds
constexpr double kTrustedAgreeing = 0.8;

Eigen::MatrixXd sampled_weights(const KnotCurve& curve, int count) {
  Eigen::MatrixXd weights(count, curve.count());
  for (int i = 0; i < count; ++i) {
    weights.row(i) = curve.weights(curve.length_mm() * i / (count - 1)).transpose();
  }
  return weights;
}

Eigen::MatrixXd basis_at_samples(const UniformCubicBSpline& spline, Eigen::Index count) {
  Eigen::MatrixXd B = Eigen::MatrixXd::Zero(count, spline.coefficient_count());
  for (Eigen::Index i = 0; i < count; ++i) {
    const CubicBasis basis =
        spline.basis(spline.length_mm() * static_cast<double>(i) / static_cast<double>(count - 1));
    for (int k = 0; k < 4; ++k) B(i, basis.first + k) = basis.value[static_cast<std::size_t>(k)];
  }
  return B;
}

int millimetres(double length_mm) {
  return std::max(8 * kPublishedCoefficients, static_cast<int>(length_mm)) + 1;
}

}  // namespace

PaperEstimator::PaperEstimator(const EstimatorSettings& settings, const InstrumentDescription& instrument,
                               const RoomDescription& room)
    : settings_(settings),
      instrument_(instrument),
      T_world_em_(room.T_world_em),
      registered_(room.registered),
      curve_(settings.paper.knot_point_count, instrument.length_mm),
      samples_(sampled_weights(curve_, millimetres(instrument.length_mm))),
      spline_(kPublishedCoefficients, instrument.length_mm),
      fit_(basis_at_samples(spline_, samples_.rows())) {
  for (const CameraCalibration& camera : room.cameras) {
    cameras_.emplace_back(camera);
    searches_.emplace_back(settings, instrument, camera, curve_);
  }
}

void PaperEstimator::reset() noexcept {
  for (PaperImageMle& search : searches_) search.forget();
  lost_tube_.forget();
  published_.time.reset();
  seen_.exposure = MonotonicTime{};
}

void PaperEstimator::update(const Observation& observation, TubeEstimate& estimate) noexcept {
  begin_report(observation, estimate);
  images_ = ImageVerdict::kNone;
  const EmFrame* frame = observation.em->newest_until(observation.instant);
  const CoilObservations coils = observe_coils(frame, *observation.em, instrument_, T_world_em_,
                                               static_cast<std::int64_t>(settings_.em_stuck_ms * 1e6));
  if (is_stale(frame, observation, settings_)) {
    estimate.reasons.add(Reason::kEmStale);
  } else {
    try {
      if (solve(observation, coils, estimate)) {
        keep();
        published_.time = observation.is_image_instant ? observation.instant : frame->measured;
      }
    } catch (const std::exception&) {
      shape_.converged = false;  // out of memory: the last shape stays, and is said to be none of now
    }
  }
  // No covariance: what single cubics between coils cannot follow is in none that Eq. (14) and (18) give.
  const FoundShape found{&spline_, published_.time ? &published_.C : nullptr, nullptr,
                         published_.time.value_or(MonotonicTime{})};
  write_shape(found, instrument_, estimate);
  add_reference_error(frame, *observation.em, T_world_em_, estimate);
  write_coils(coils, found, estimate);
  write_held_by_coils(coils, estimate);
  write_held_by_image(estimate);
  write_measurements(frame, seen_.exposure, estimate);
  judge(observation, coils, {true, registered_, shape_.converged, lost_tube_.standing(observation, images_)},
        estimate);
}

bool PaperEstimator::solve(const Observation& observation, const CoilObservations& coils,
                           TubeEstimate& estimate) {
  const auto em = solve_paper_em_map(settings_, instrument_.length_mm, coils);
  if (!em) {
    return false;
  }
  estimate.iterations += static_cast<std::uint32_t>(em->iterations);
  shape_ = {em->points(curve_.count(), instrument_.length_mm), em->converged};
  if (!registered_) {
    return true;
  }
  for (std::size_t camera = 0; camera < cameras_.size(); ++camera) {
    ImageMeasurement* image = observation.images[camera];
    if (image != nullptr && image->state == ImageState::kMeasured) {
      if (observation.on_demand[camera] != nullptr) {
        ImageArea whole = image->measured;
        whole.add_whole();
        observation.on_demand[camera]->filter_missing(*image, whole);
      }
      images_ = fuse(*image, camera, coils, *em, estimate);
      break;
    }
  }
  return true;
}

ImageVerdict PaperEstimator::fuse(const ImageMeasurement& image, std::size_t camera,
                                  const CoilObservations& coils, const PaperEmShape& em,
                                  TubeEstimate& estimate) {
  cameras_[camera].look_from(image.geometry);
  searches_[camera].look_from(image.geometry);
  const Eigen::Matrix3Xd K_em = shape_.K;
  Shape fused = shape_;
  fused.converged = false;
  PaperMleOutcome outcome;
  for (int round = 0; round < settings_.paper.rounds && !fused.converged; ++round) {
    const Eigen::Matrix3Xd K_before = fused.K;
    outcome = searches_[camera].search(image, K_em, round == 0, fused.K);
    estimate.iterations += static_cast<std::uint32_t>(outcome.iterations);
    estimate.in_view_ratio = static_cast<float>(outcome.in_view_ratio);
    estimate.image_inlier_ratio = static_cast<float>(outcome.agreeing_ratio);
    if (!outcome.looked) return ImageVerdict::kNone;
    if (outcome.agreeing_ratio < PaperImageMle::kMinAgreeing) return ImageVerdict::kLost;
    if (!solve_depths(cameras_[camera], coils, em, fused, estimate)) return ImageVerdict::kLost;
    fused.converged = (fused.K - K_before).norm() < kRested_mm * std::sqrt(curve_.count());
  }
  shape_ = std::move(fused);
  estimate.has_image = true;
  seen_.exposure = image.exposure;
  seen_.camera = camera;
  seen_.own_pose = image.brought_geometry ? std::optional(image.geometry->sigma) : std::nullopt;
  if (outcome.agreeing_ratio >= kTrustedAgreeing) searches_[camera].adapt(image, shape_.K);
  return ImageVerdict::kShowsTube;
}

// Knot points go along their viewing rays: what the image said of them stays.
bool PaperEstimator::solve_depths(const Camera& camera, const CoilObservations& coils, const PaperEmShape& em,
                                  Shape& shape, TubeEstimate& estimate) const {
  const RigidTransform& T_camera_world = camera.calibration().T_camera_world;
  const RigidTransform T_world_camera = T_camera_world.inverse();
  const Eigen::Matrix3Xd samples_mm = T_camera_world * (shape.K * samples_.transpose());
  const double spacing_mm = instrument_.length_mm / static_cast<double>(samples_.rows() - 1);
  const PointAtDepth point = [&](double s_mm, double depth_mm) -> Eigen::Vector3d {
    const double place = std::clamp(s_mm / spacing_mm, 0.0, static_cast<double>(samples_.rows()) - 1.001);
    const auto before = static_cast<Eigen::Index>(place);
    const double t = place - static_cast<double>(before);
    const Eigen::Vector3d p_mm = (1 - t) * samples_mm.col(before) + t * samples_mm.col(before + 1);
    return T_world_camera * (p_mm * (depth_mm / p_mm.z()));
  };
  Eigen::RowVectorXd start = T_camera_world.linear().row(2) * em.nodes;
  for (Eigen::Index node = 0; node < start.size(); node += 2) start(node) += T_camera_world.translation().z();
  const auto depths = solve_paper_depth_map(settings_, instrument_.length_mm, coils, point, start);
  if (!depths) {
    return false;
  }
  estimate.iterations += static_cast<std::uint32_t>(depths->iterations);
  for (int i = 0; i < curve_.count(); ++i) {
    const GapBasis at = depths->cubics.basis(curve_.knot_point_s_mm(i));
    const Eigen::Vector3d K_camera = T_camera_world * shape.K.col(i).eval();
    const double depth_mm = combine(depths->nodes, at, at.value)(0);
    shape.K.col(i) = T_world_camera * (K_camera * (depth_mm / K_camera.z()));
  }
  return shape.K.allFinite();
}

// Between images this mode's shape is that of the coils alone.
void PaperEstimator::write_held_by_image(TubeEstimate& estimate) const {
  if (!estimate.has_image) {
    return;
  }
  estimate.views[estimate.view_count++] =
      used_view(seen_.camera, cameras_[seen_.camera].calibration(), seen_.exposure,
                seen_.own_pose ? &*seen_.own_pose : nullptr);
  for (std::size_t i = 0; i < estimate.point_count; ++i) {
    if (searches_[seen_.camera].seen().at(place_of_point_mm(i, estimate))) {
      estimate.points[i].held_by |= kHeldByImage;
    }
  }
}

// From knot points to the coefficients that are published: least squares over samples every millimetre.
void PaperEstimator::keep() {
  const Eigen::Matrix3Xd samples_mm = shape_.K * samples_.transpose();
  published_.C = fit_.solve(samples_mm.transpose()).transpose();
}

}  // namespace tubed
