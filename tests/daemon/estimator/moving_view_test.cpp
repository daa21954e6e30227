// A view that turns while the tube is watched.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "daemon/estimator/images/area_prediction.hpp"
#include "idl/geometry/degree.hpp"
#include "tests/daemon/estimator/simulated_tube.hpp"

namespace tubed {
namespace {

constexpr double kIsocentre_mm = 1200;

/// The camera at rest, turned about the vertical axis through the world's origin.
CameraCalibration turned(const CameraCalibration& at_rest, double turn_deg) {
  CameraCalibration camera = at_rest;
  const Eigen::Translation3d isocentre(0, 0, kIsocentre_mm);
  camera.T_camera_world = isocentre * Eigen::AngleAxisd(turn_deg * kDegree, Eigen::Vector3d::UnitY()) *
                          isocentre.inverse() * at_rest.T_camera_world;
  return camera;
}

/// What an image says of how it was taken, the camera standing as given.
using Announcement = std::function<std::optional<ViewGeometry>(const CameraCalibration& camera)>;

std::optional<ViewGeometry> nothing(const CameraCalibration&) { return std::nullopt; }
std::optional<ViewGeometry> truth(const CameraCalibration& camera) { return geometry_of(camera); }

/// The pose with an error about the isocentre, and the standard deviations it was drawn with if it says so.
class NoisyPose {
 public:
  NoisyPose(double sigma_rad, double sigma_mm, bool says_so)
      : sigma_rad_(sigma_rad), sigma_mm_(sigma_mm), says_so_(says_so) {}

  std::optional<ViewGeometry> operator()(const CameraCalibration& camera) {
    const Eigen::Vector3d turn = sigma_rad_ * draw();
    const Eigen::Vector3d shift_mm = sigma_mm_ * draw();
    CameraCalibration said = camera;
    const Eigen::Translation3d pivot(0, 0, kIsocentre_mm);
    said.T_camera_world = pivot * Eigen::AngleAxisd(turn.norm(), turn.normalized()) * pivot.inverse() *
                          Eigen::Translation3d(shift_mm) * camera.T_camera_world;
    ViewGeometry geometry = geometry_of(said);
    if (says_so_) {
      geometry.sigma.rotation_rad.fill(sigma_rad_);
      geometry.sigma.translation_mm.fill(sigma_mm_);
      geometry.sigma.pivot_depth_mm = kIsocentre_mm;
    }
    return geometry;
  }

 private:
  Eigen::Vector3d draw() {
    const double x = normal_(random_);
    const double y = normal_(random_);
    return {x, y, normal_(random_)};
  }
  std::mt19937 random_{11};
  std::normal_distribution<double> normal_;
  double sigma_rad_;
  double sigma_mm_;
  bool says_so_;
};

struct Outcome {
  double rms_mm = 0;    ///< in view, all instants with an image together
  int lost_images = 0;  ///< IMAGE_LOST_TUBE
  double sigmas = 0;    ///< root mean square of error over sigma, of the coordinates
};

/// How a still tube is watched: a measurement of the coils every 25 ms, an image every 100 ms.
struct Scene {
  EstimatorMode mode = EstimatorMode::kFilter;
  std::function<double(int)> turn_deg;  ///< of the view, at that instant
  Announcement announce;
  double noise_mm = 4;                                     ///< amplitude, of a coil's position
  Eigen::Vector3d coils_off_mm = Eigen::Vector3d::Zero();  ///< all of them, always; world
  int judged_from = 60;
  int instants = 240;
};

Outcome watch(const Scene& scene) {
  const RoomDescription room = one_view_room();
  EstimatorSettings settings;
  settings.mode = scene.mode;
  const auto estimator = make_estimator(settings, room.instruments.front(), room);
  const auto history = std::make_unique<EmHistory>();
  const auto estimate = std::make_unique<TubeEstimate>();
  Outcome outcome;
  double squares_mm2 = 0;
  double squares = 0;
  int points = 0;
  for (int k = 1; k <= scene.instants; ++k) {
    const MonotonicTime now = from_ns(10'000'000'000 + k * std::int64_t{25'000'000});
    EmFrame frame = measure_coils(room, now, scene.noise_mm, static_cast<unsigned>(k));
    for (CoilSample& coil : frame.coils) coil.p_em_mm += scene.coils_off_mm;
    history->add(frame);
    Observation observation;
    observation.instant = observation.now = now;
    observation.em = history.get();
    observation.is_image_instant = k % 4 == 0;
    observation.image_timeout = std::chrono::milliseconds(220);
    RoomDescription seen = room;
    seen.cameras[0] = turned(room.cameras[0], scene.turn_deg(k));
    ImageMeasurement image;
    if (observation.is_image_instant) {
      image = image_of_arc(seen, now);
      image.geometry = scene.announce(seen.cameras[0]);
      observation.images[0] = &image;
    }
    observation.newest_image = now - std::chrono::milliseconds(25 * (k % 4));
    estimator->estimate(observation, *estimate);
    if (!observation.is_image_instant || k < scene.judged_from) {
      continue;
    }
    outcome.lost_images += estimate->reasons.has(Reason::kImageLostTube) ? 1 : 0;
    const Camera camera(seen.cameras[0]);
    for (std::size_t i = 0; i < estimate->point_count; ++i) {
      const double s_mm =
          static_cast<double>(estimate->length_mm) * static_cast<double>(i) / (estimate->point_count - 1);
      const Eigen::Vector3d true_mm = arc_point(s_mm);
      const auto projection = camera.project(true_mm);
      if (s_mm > 370 || !projection || !camera.contains(projection->p_image_px)) {
        continue;
      }
      const CentrelinePoint& point = estimate->points[i];
      const Eigen::Vector3d off_mm = Eigen::Map<const Eigen::Vector3d>(point.p_world_mm.data()) - true_mm;
      squares_mm2 += off_mm.squaredNorm();
      squares += off_mm.x() * off_mm.x() / static_cast<double>(point.covariance_mm2[0]) +
                 off_mm.y() * off_mm.y() / static_cast<double>(point.covariance_mm2[3]) +
                 off_mm.z() * off_mm.z() / static_cast<double>(point.covariance_mm2[5]);
      ++points;
    }
  }
  outcome.rms_mm = std::sqrt(squares_mm2 / points);
  outcome.sigmas = std::sqrt(squares / (3 * points));
  return outcome;
}

/// For 6 s, while the view stands or turns by `turn_deg`.
Outcome watch(EstimatorMode mode, double turn_deg, const Announcement& announce) {
  const auto turning = [turn_deg](int k) { return turn_deg * std::clamp((k - 60) / 120.0, 0.0, 1.0); };
  return watch({.mode = mode, .turn_deg = turning, .announce = announce});
}

class MovingView : public ::testing::TestWithParam<EstimatorMode> {};
INSTANTIATE_TEST_SUITE_P(Modes, MovingView, ::testing::Values(EstimatorMode::kFilter, EstimatorMode::kJoint),
                         [](const auto& mode) { return std::string(name_of(mode.param)); });

TEST_P(MovingView, ThatSaysHowItStandsIsAsGoodAsOneThatStands) {
  const Outcome fixed = watch(GetParam(), 0, nothing);
  const Outcome moving = watch(GetParam(), 30, truth);
  EXPECT_LT(moving.rms_mm, 1.1 * fixed.rms_mm);
  EXPECT_EQ(moving.lost_images, 0);
}

TEST_P(MovingView, ThatSaysNothingIsFarWorse) {
  const Outcome fixed = watch(GetParam(), 0, nothing);
  EXPECT_GT(watch(GetParam(), 30, nothing).rms_mm, 1.3 * fixed.rms_mm);
}

TEST_P(MovingView, AStatedPoseThatIsTheConfigurationsChangesNothing) {
  EXPECT_NEAR(watch(GetParam(), 0, truth).rms_mm, watch(GetParam(), 0, nothing).rms_mm, 1e-6);
}

// What is known of the pose's error keeps the images from being believed too far.
TEST(MovingViewWithPoseError, AStatedErrorOfThePoseMakesTheShapeBetterAndSigmaHonest) {
  constexpr double kSigma_rad = 0.2 * kDegree;
  constexpr double kSigma_mm = 2;
  const Outcome silent = watch(EstimatorMode::kFilter, 30, NoisyPose(kSigma_rad, kSigma_mm, false));
  const Outcome stated = watch(EstimatorMode::kFilter, 30, NoisyPose(kSigma_rad, kSigma_mm, true));
  EXPECT_LT(stated.rms_mm, 0.9 * silent.rms_mm);
  EXPECT_LT(stated.sigmas, 1.3);
  EXPECT_GT(silent.sigmas, 1.3 * stated.sigmas);
}

// All coils lie 2.5 mm nearer to the camera than the tube, which one view does not see. The view swings by 30
// degrees and back, between 2 and 8 s, and the last 4 of 20 s are judged.
TEST(ViewFromAnotherDirection, WhatItShowedOfAllCoilsHoldsAfterwards) {
  Scene scene{.turn_deg = [](int) { return 0.0; },
              .announce = truth,
              .noise_mm = 0.5,
              .coils_off_mm = {0, 0, -2.5},
              .judged_from = 640,
              .instants = 800};
  const Outcome one_view = watch(scene);
  EXPECT_GT(one_view.rms_mm, 2);  // nothing tells
  scene.turn_deg = [](int k) { return 30 * std::clamp(1 - std::abs(k - 200) / 120.0, 0.0, 1.0); };
  const Outcome two_views = watch(scene);
  EXPECT_LT(two_views.rms_mm, 0.65 * one_view.rms_mm);
  EXPECT_LT(two_views.sigmas, 1.3);
}

TEST(AreaPredictionOfAMovingView, IsWhereTheNewestImageWasTakenFrom) {
  const CameraCalibration at_rest = one_view_room().cameras[0];
  FrangiSettings settings;
  AreaPrediction prediction(at_rest, settings);
  CameraCalibration moved = at_rest;
  moved.T_camera_world.translation().x() += 60;  // 100 px
  const auto estimate = std::make_unique<TubeEstimate>();
  estimate->point_count = 2;
  estimate->points[1].p_world_mm = {0, 5, 0};
  const auto area_at = [&](double x_px) {
    prediction.begin(from_ns(1'000'000'000), std::chrono::milliseconds(50));
    prediction.add({ImageNeed::Kind::kAroundTube, 10, 20}, *estimate);
    return prediction.end().area.covers_box({x_px - 2, 298}, {x_px + 2, 302});
  };
  EXPECT_TRUE(area_at(200));
  EXPECT_FALSE(area_at(300));
  prediction.look_from(geometry_of(moved));
  EXPECT_FALSE(area_at(200));
  EXPECT_TRUE(area_at(300));
  prediction.look_from(std::nullopt);
  EXPECT_TRUE(area_at(200));
}

}  // namespace
}  // namespace tubed
