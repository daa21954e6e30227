#include "daemon/estimator/single_frame_estimator.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "tests/daemon/estimator/simulated_tube.hpp"

namespace tubed {
namespace {

using std::chrono::milliseconds;

/// RMS over the points that the camera sees: of the whole error, or (across) of its part in the image plane
/// and normal to the tube, which is what one view can tell.
double rms_to_arc(const TubeEstimate& estimate, bool across) {
  double sum = 0;
  int count = 0;
  for (std::size_t i = 0; i < estimate.point_count; ++i) {
    const double s =
        static_cast<double>(estimate.length_mm) * static_cast<double>(i) / (estimate.point_count - 1);
    const Eigen::Vector3d truth = arc_point(s);
    const Eigen::Vector3d error =
        Eigen::Map<const Eigen::Vector3d>(estimate.points[i].p_world_mm.data()) - truth;
    if (s <= 370 && std::abs(truth.x()) < 100 && std::abs(truth.y()) < 150) {
      const Eigen::Vector2d along = arc_tangent_to_tip(s).head<2>().normalized();
      const double normal_error = error.x() * -along.y() + error.y() * along.x();
      sum += across ? normal_error * normal_error : error.squaredNorm();
      ++count;
    }
  }
  return std::sqrt(sum / count);
}

struct EstimatorBench {
  explicit EstimatorBench(EstimatorMode mode) {
    settings.mode = mode;
    estimator = make_estimator(settings, room.instruments.front(), room);
  }
  TubeEstimate& tick(MonotonicTime now) {
    Observation observation;
    observation.instant = observation.now = now;
    observation.em = history.get();
    observation.newest_image = newest_image;
    observation.image_timeout = milliseconds(120);
    estimator->estimate(observation, *estimate);
    return *estimate;
  }
  TubeEstimate& image(ImageMeasurement measurement, MonotonicTime now) {
    Observation observation;
    observation.instant = measurement.exposure;
    observation.now = now;
    observation.is_image_instant = true;
    observation.em = history.get();
    observation.images[0] = &measurement;
    observation.newest_image = newest_image = measurement.exposure;
    observation.image_timeout = milliseconds(120);
    estimator->estimate(observation, *estimate);
    return *estimate;
  }
  RoomDescription room = one_view_room();
  EstimatorSettings settings;
  std::unique_ptr<EmHistory> history = std::make_unique<EmHistory>();
  std::unique_ptr<Estimator> estimator;
  std::unique_ptr<TubeEstimate> estimate = std::make_unique<TubeEstimate>();
  MonotonicTime newest_image{};
  MonotonicTime t0 = from_ns(10'000'000'000);
};

TEST(SingleFrameEstimator, WithoutAnyMeasurementThereIsNoShape) {
  EstimatorBench bench(EstimatorMode::kEm);
  const TubeEstimate& estimate = bench.tick(bench.t0);
  EXPECT_EQ(estimate.validity, Validity::kNotAvailable);
  EXPECT_TRUE(estimate.reasons.has(Reason::kInitialising));
  EXPECT_EQ(estimate.point_count, 0U);
  EXPECT_EQ(estimate.em_age_ns, -1);
}

TEST(SingleFrameEstimator, CoilsAloneAreValidWithImageOff) {
  EstimatorBench bench(EstimatorMode::kEm);
  bench.history->add(measure_coils(bench.room, bench.t0, 4, 1));
  const TubeEstimate& estimate = bench.tick(bench.t0 + milliseconds(12));
  EXPECT_EQ(estimate.validity, Validity::kValid);
  EXPECT_TRUE(estimate.reasons.has(Reason::kImageOff));
  EXPECT_TRUE(estimate.reasons.has(Reason::kDemoData)) << "simulated coils can never be hidden";
  EXPECT_EQ(estimate.em_age_ns, 0) << "valid_time is the measurement's";
  EXPECT_EQ(estimate.valid_time_ns, to_ns(bench.t0))
      << "a tick's shape is of its measurement, not of the tick";
}

TEST(SingleFrameEstimator, AnImageMovesTheTubeOntoItsProjection) {
  EstimatorBench em(EstimatorMode::kEm);
  EstimatorBench joint(EstimatorMode::kJoint);
  const EmFrame frame = measure_coils(em.room, em.t0, 4, 3);
  em.history->add(frame);
  joint.history->add(frame);
  const ImageMeasurement image = image_of_arc(em.room, em.t0);
  const double before = rms_to_arc(em.tick(em.t0), true);
  const TubeEstimate& estimate = joint.image(image, em.t0 + milliseconds(10));
  EXPECT_LT(rms_to_arc(estimate, true), 0.4 * before);
  EXPECT_TRUE(estimate.has_image);
  EXPECT_EQ(estimate.validity, Validity::kValid);
  EXPECT_GT(estimate.image_inlier_ratio, 0.9F);
  EXPECT_EQ(estimate.image_age_ns, 0) << "valid_time is the exposure";
}

/// How far the tip is from where it is seen, in the image plane.
double tip_aside_mm(const TubeEstimate& estimate) {
  const Eigen::Vector3d tip = Eigen::Map<const Eigen::Vector3d>(estimate.points[0].p_world_mm.data());
  return (tip - arc_point(0)).head<2>().norm();
}

// The shape of the coils alone goes straight on for 90 or 170 mm, and ends 50 or 180 px beside a tip that
// bends; lines reach 14.
TEST(SingleFrameEstimator, ATipThatNoCoilHoldsIsFollowedThroughTheImage) {
  for (const int coils_without : {1, 2}) {
    EstimatorBench em(EstimatorMode::kEm);
    EstimatorBench joint(EstimatorMode::kJoint);
    EmFrame frame = measure_coils(em.room, em.t0, 1, 3);
    for (int i = 0; i < coils_without; ++i) {
      frame.coils[static_cast<std::size_t>(i)] = CoilSample{};
    }
    em.history->add(frame);
    joint.history->add(frame);
    const double before_mm = tip_aside_mm(em.tick(em.t0));
    const TubeEstimate& estimate = joint.image(image_of_arc(em.room, em.t0), em.t0);
    EXPECT_GT(before_mm, 10) << coils_without;
    EXPECT_LT(tip_aside_mm(estimate), 4) << coils_without;
    EXPECT_GT(estimate.image_inlier_ratio, 0.95F) << coils_without;
    EXPECT_LT(rms_to_arc(estimate, true), 1) << coils_without;
  }
}

TEST(SingleFrameEstimator, AnImageWithoutTheTubeIsSaidAndDoesNotPull) {
  EstimatorBench em(EstimatorMode::kEm);
  EstimatorBench joint(EstimatorMode::kJoint);
  const EmFrame frame = measure_coils(em.room, em.t0, 4, 3);
  em.history->add(frame);
  joint.history->add(frame);
  ImageMeasurement empty = image_of_arc(em.room, em.t0);
  std::fill(empty.vesselness.begin(), empty.vesselness.end(), 0.0F);
  const double before = rms_to_arc(em.tick(em.t0), false);
  const TubeEstimate& estimate = joint.image(empty, em.t0);
  EXPECT_TRUE(estimate.reasons.has(Reason::kImageLostTube));
  EXPECT_EQ(estimate.validity, Validity::kQuestionable);
  EXPECT_NEAR(rms_to_arc(estimate, false), before, 1e-6);
}

// Another scene: the same tube upside down crosses the true one's place here and there.
TEST(SingleFrameEstimator, AnImageOfSomethingElseIsSaidAndDoesNotPull) {
  EstimatorBench em(EstimatorMode::kEm);
  EstimatorBench joint(EstimatorMode::kJoint);
  const EmFrame frame = measure_coils(em.room, em.t0, 4, 3);
  em.history->add(frame);
  joint.history->add(frame);
  ImageMeasurement other = image_of_arc(em.room, em.t0);
  std::reverse(other.vesselness.begin(), other.vesselness.end());
  const double before = rms_to_arc(em.tick(em.t0), false);
  const TubeEstimate& estimate = joint.image(other, em.t0);
  EXPECT_TRUE(estimate.reasons.has(Reason::kImageLostTube));
  EXPECT_FALSE(estimate.has_image);
  EXPECT_NEAR(rms_to_arc(estimate, false), before, 1e-6);
}

TEST(SingleFrameEstimator, ATrackerThatFellSilentIsInvalidAndTheShapeKeepsItsTime) {
  EstimatorBench bench(EstimatorMode::kEm);
  bench.history->add(measure_coils(bench.room, bench.t0, 0, 1));
  bench.tick(bench.t0);
  const TubeEstimate& estimate = bench.tick(bench.t0 + milliseconds(200));
  EXPECT_EQ(estimate.validity, Validity::kInvalid);
  EXPECT_TRUE(estimate.reasons.has(Reason::kEmStale));
  EXPECT_EQ(estimate.valid_time_ns, to_ns(bench.t0)) << "never re-stamped";
}

TEST(SingleFrameEstimator, ALostCoilIsFlaggedInTheNextSample) {
  EstimatorBench bench(EstimatorMode::kEm);
  EmFrame frame = measure_coils(bench.room, bench.t0, 0, 1);
  frame.coils[1] = CoilSample{};
  bench.history->add(frame);
  const TubeEstimate& estimate = bench.tick(bench.t0);
  EXPECT_TRUE(estimate.reasons.has(Reason::kCoilLost));
  EXPECT_EQ(estimate.validity, Validity::kQuestionable);
  EXPECT_TRUE(std::isnan(estimate.coils[1].position_mm));
}

TEST(SingleFrameEstimator, ACoilThatIsOffByTwentyFiveMillimetresIsFoundOut) {
  EstimatorBench bench(EstimatorMode::kEm);
  EmFrame frame = measure_coils(bench.room, bench.t0, 1, 1);
  frame.coils[2].p_em_mm += Eigen::Vector3d(0, 15, 20);
  bench.history->add(frame);
  const TubeEstimate& estimate = bench.tick(bench.t0);
  EXPECT_EQ(estimate.coils[2].state, CoilState::kOutlier);
  EXPECT_TRUE(estimate.reasons.has(Reason::kCoilOutlier));
  EXPECT_LT(rms_to_arc(estimate, false), 5);
}

TEST(SingleFrameEstimator, OrdinaryNoiseMakesNoOutlier) {
  EstimatorBench bench(EstimatorMode::kEm);
  int outliers = 0;
  for (unsigned seed = 1; seed <= 100; ++seed) {
    const MonotonicTime time = bench.t0 + milliseconds(25 * seed);
    bench.history->add(measure_coils(bench.room, time, 4, seed));
    outliers += bench.tick(time).reasons.has(Reason::kCoilOutlier) ? 1 : 0;
  }
  EXPECT_LE(outliers, 1);
}

TEST(SingleFrameEstimator, WhenImagesStopItSaysSo) {
  EstimatorBench bench(EstimatorMode::kJoint);
  bench.history->add(measure_coils(bench.room, bench.t0, 1, 1));
  bench.image(image_of_arc(bench.room, bench.t0), bench.t0 + milliseconds(5));
  bench.history->add(measure_coils(bench.room, bench.t0 + milliseconds(190), 1, 2));
  const TubeEstimate& estimate = bench.tick(bench.t0 + milliseconds(200));
  EXPECT_TRUE(estimate.reasons.has(Reason::kImageStale));
  EXPECT_EQ(estimate.validity, Validity::kQuestionable);
  EXPECT_FALSE(estimate.has_image);
}

TEST(SingleFrameEstimator, AViewThatMovedIsAReasonForDoubtAndNoStaleImage) {
  EstimatorBench bench(EstimatorMode::kJoint);
  bench.history->add(measure_coils(bench.room, bench.t0, 1, 1));
  Observation observation;
  observation.instant = observation.now = bench.t0 + milliseconds(10);
  observation.is_image_instant = true;
  observation.geometry_changed = true;
  observation.newest_left_out = observation.instant;
  observation.em = bench.history.get();
  bench.estimator->estimate(observation, *bench.estimate);
  EXPECT_TRUE(bench.estimate->reasons.has(Reason::kGeometryChanged));
  EXPECT_FALSE(bench.estimate->reasons.has(Reason::kImageStale));
  EXPECT_EQ(bench.estimate->validity, Validity::kQuestionable);
  EXPECT_FALSE(bench.estimate->has_image);
}

TEST(SingleFrameEstimator, WithoutRegistrationTheImageIsLeftOut) {
  EstimatorBench bench(EstimatorMode::kJoint);
  bench.room.registered = false;
  bench.estimator = make_estimator(bench.settings, bench.room.instruments.front(), bench.room);
  bench.history->add(measure_coils(bench.room, bench.t0, 1, 1));
  const TubeEstimate& estimate = bench.image(image_of_arc(bench.room, bench.t0), bench.t0);
  EXPECT_TRUE(estimate.reasons.has(Reason::kNoRegistration));
  EXPECT_FALSE(estimate.has_image);
}

TEST(SingleFrameEstimator, BetweenTwoImagesTheLastOneStillHelps) {
  EstimatorBench bench(EstimatorMode::kJoint);
  bench.history->add(measure_coils(bench.room, bench.t0, 4, 1));
  bench.image(image_of_arc(bench.room, bench.t0), bench.t0 + milliseconds(5));
  bench.history->add(measure_coils(bench.room, bench.t0 + milliseconds(25), 4, 2));
  const double bridged = rms_to_arc(bench.tick(bench.t0 + milliseconds(40)), true);
  EstimatorBench em(EstimatorMode::kEm);
  em.history->add(measure_coils(em.room, em.t0 + milliseconds(25), 4, 2));
  EXPECT_LT(bridged, 0.5 * rms_to_arc(em.tick(em.t0 + milliseconds(40)), true));
  EXPECT_FALSE(bench.estimate->has_image);
}

}  // namespace
}  // namespace tubed
