#include "daemon/estimator/images/area_prediction.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <random>

#include "tests/daemon/estimator/simulated_tube.hpp"

namespace tubed {
namespace {

using std::chrono::milliseconds;

constexpr int kImages = 36;
constexpr int kSnapAt = 12;    // the tube jumps between this image and the one before
constexpr int kGoneFrom = 22;  // images that show no tube at all ..
constexpr int kGoneTo = 27;    // .. until this one
constexpr milliseconds kPeriod{33};
constexpr milliseconds kTimeout{75};

MonotonicTime exposure_of(int image) { return from_ns(1'000'000'000) + (image + 1) * kPeriod; }

/// Where the arc of simulated_tube.hpp has gone: drifts at 15 mm/s, then snaps 18 mm aside.
Eigen::Vector3d displacement_mm(MonotonicTime time) {
  const double t_s = std::chrono::duration<double>(time - exposure_of(0)).count();
  const bool snapped = time > exposure_of(kSnapAt) - kPeriod;
  return {15 * t_s + (snapped ? 18 : 0), 5 * t_s, 0};
}

EmFrame coils_at(const RoomDescription& room, MonotonicTime time, unsigned number) {
  EmFrame frame = measure_coils(room, time, 1.0, number);
  for (CoilSample& coil : frame.coils) coil.p_em_mm += displacement_mm(time);
  return frame;
}

/// Grey values of a fluoroscope of 8 bits: noise, and the arc dark on it.
void render(const RoomDescription& room, int number, ImageMeasurement& image) {
  const CameraCalibration& calibration = room.cameras.front();
  const Camera camera(calibration);
  std::mt19937 random(static_cast<unsigned>(number));
  std::vector<float> darkness(image.grey.size(), 0.0F);
  const bool gone = number >= kGoneFrom && number < kGoneTo;
  for (double s = 0; s <= 380 && !gone; s += 0.25) {
    const auto p = camera.project(arc_point(s) + displacement_mm(exposure_of(number)));
    if (!p || !camera.contains(p->p_image_px, 8)) continue;
    const int centre_x = static_cast<int>(std::lround(p->p_image_px.x()));
    const int centre_y = static_cast<int>(std::lround(p->p_image_px.y()));
    for (int y = centre_y - 6; y <= centre_y + 6; ++y) {
      for (int x = centre_x - 6; x <= centre_x + 6; ++x) {
        const double d2 = (Eigen::Vector2d(x, y) - p->p_image_px).squaredNorm();
        float& dark = darkness[static_cast<std::size_t>(y * calibration.width + x)];
        dark = std::max(dark, static_cast<float>(60 * std::exp(-0.5 * d2 / 3)));
      }
    }
  }
  image.brightest = 0;
  for (std::size_t i = 0; i < darkness.size(); ++i) {
    image.grey[i] = std::round(150 + static_cast<float>(random() % 17) - darkness[i]);
    image.brightest = std::max(image.brightest, image.grey[i]);
  }
}

enum class Feeding { kPredicted, kWhole, kWrong, kWrongAndNobodyToAsk };

struct TubeRun {
  std::vector<TubeEstimate> estimates;
  std::vector<double> measured_share;  ///< of each image before it was read
  std::uint64_t completed = 0;
};

TubeRun run(FrangiArea kind, Feeding feeding) {
  const RoomDescription room = one_view_room();
  const CameraCalibration& camera = room.cameras.front();
  FrangiSettings settings;
  settings.area = kind;
  VesselnessMeter meter(camera.width, camera.height, settings);
  AreaPrediction prediction(camera, settings);
  const auto estimator = make_estimator(EstimatorSettings{}, room.instruments.front(), room);
  const auto history = std::make_unique<EmHistory>();
  const auto estimate = std::make_unique<TubeEstimate>();
  ImageMeasurement image;
  image.reserve(camera.width, camera.height);
  image.state = ImageState::kMeasured;
  ImageArea whole = image.measured;
  ImageArea wrong(camera.width, camera.height);
  wrong.add_box({0, 0}, {40, 40});
  PredictedArea predicted{wrong, {}, {}};
  TubeRun result;
  MonotonicTime next_em = exposure_of(0) - milliseconds(400);
  unsigned em_number = 0;
  for (int number = 0; number < kImages; ++number) {
    for (; next_em <= exposure_of(number); next_em += milliseconds(25)) {
      history->add(coils_at(room, next_em, ++em_number));
    }
    render(room, number, image);
    image.exposure = exposure_of(number);
    const bool foreseen = image.exposure <= predicted.until;
    meter.take(image, feeding == Feeding::kPredicted ? (foreseen ? predicted.area : whole)
                      : feeding == Feeding::kWhole   ? whole
                                                     : wrong);
    result.measured_share.push_back(image.measured.share());
    Observation observation;
    observation.instant = observation.now = observation.newest_image = image.exposure;
    observation.is_image_instant = true;
    observation.em = history.get();
    observation.image_timeout = kTimeout;
    observation.images[0] = &image;
    prediction.on_demand().begin();
    observation.on_demand[0] = feeding == Feeding::kWrongAndNobodyToAsk ? nullptr : &prediction.on_demand();
    prediction.begin(observation.instant, observation.image_timeout);
    estimator->estimate(observation, *estimate);
    prediction.add(estimator->image_need(), *estimate);
    predicted = prediction.end();
    result.estimates.push_back(*estimate);
  }
  result.completed = prediction.on_demand().completed_images();
  return result;
}

/// The same run is not made twice: rendering takes its time.
const TubeRun& run_of(FrangiArea kind, Feeding feeding) {
  static std::map<std::pair<FrangiArea, Feeding>, TubeRun> runs;
  const auto [found, is_new] = runs.try_emplace({kind, feeding});
  if (is_new) found->second = run(kind, feeding);
  return found->second;
}

double max_distance_mm(const TubeEstimate& a, const TubeEstimate& b) {
  if (a.point_count != b.point_count) return std::numeric_limits<double>::infinity();
  double greatest = 0;
  for (std::size_t i = 0; i < a.point_count; ++i) {
    greatest = std::max(greatest, (Eigen::Map<const Eigen::Vector3d>(a.points[i].p_world_mm.data()) -
                                   Eigen::Map<const Eigen::Vector3d>(b.points[i].p_world_mm.data()))
                                      .norm());
  }
  return greatest;
}

/// Greatest over the images.
double max_distance_mm(const TubeRun& a, const TubeRun& b) {
  double greatest = 0;
  for (std::size_t i = 0; i < a.estimates.size(); ++i) {
    greatest = std::max(greatest, max_distance_mm(a.estimates[i], b.estimates[i]));
    EXPECT_EQ(a.estimates[i].validity, b.estimates[i].validity) << "image " << i;
    EXPECT_EQ(a.estimates[i].reasons.bits(), b.estimates[i].reasons.bits()) << "image " << i;
  }
  return greatest;
}

double across_view_mm(const TubeRun& of, int image) {
  const TubeEstimate& estimate = of.estimates[static_cast<std::size_t>(image)];
  double worst = 0;
  for (double s = 40; s < 340; s += 20) {
    const auto i = static_cast<std::size_t>(std::lround(s / 380 * (estimate.point_count - 1)));
    const double s_mm = 380.0 * static_cast<double>(i) / (estimate.point_count - 1);
    const Eigen::Vector3d off = Eigen::Map<const Eigen::Vector3d>(estimate.points[i].p_world_mm.data()) -
                                arc_point(s_mm) - displacement_mm(exposure_of(image));
    worst = std::max(worst, off.head<2>().norm());
  }
  return worst;
}

TEST(AreaPrediction, BandsGiveTheEstimatesOfWholeImagesThroughASnapAndALoss) {
  const TubeRun& band = run_of(FrangiArea::kBand, Feeding::kPredicted);
  const TubeRun& whole = run_of(FrangiArea::kBand, Feeding::kWhole);
  EXPECT_EQ(max_distance_mm(band, whole), 0) << "bit by bit: pixels do not depend on the band";
  // The sequence is what it says: lost while there is no tube, on it before, and found again after both.
  EXPECT_TRUE(band.estimates[kGoneFrom].reasons.has(Reason::kImageLostTube));
  EXPECT_EQ(band.estimates[kSnapAt - 2].validity, Validity::kValid);
  EXPECT_EQ(band.estimates[kImages - 1].validity, Validity::kValid);
  EXPECT_LT(across_view_mm(band, kSnapAt - 2), 1.0);
  EXPECT_LT(across_view_mm(band, kGoneFrom - 2), 1.0);
  EXPECT_LT(across_view_mm(band, kImages - 1), 1.0);
}

TEST(AreaPrediction, BandsMeasureAFractionOfTheImageAndNearlyAlwaysAllThatIsRead) {
  const TubeRun& band = run_of(FrangiArea::kBand, Feeding::kPredicted);
  EXPECT_EQ(band.measured_share[0], 1) << "nothing is known at the start";
  EXPECT_EQ(band.measured_share[kGoneFrom + 1], 1) << "the newest image did not show the tube";
  for (const int settled : {kSnapAt - 2, kGoneFrom - 2, kImages - 1}) {
    EXPECT_LT(band.measured_share[static_cast<std::size_t>(settled)], 0.3) << "image " << settled;
  }
  EXPECT_LE(band.completed, 3U) << "the snap, and what follows it";
}

// c of whole frames is that of the very image, c of bands is carried on where nobody reads: that changes the
// vesselness a little. After a loss the shapes begin again from different images' noise.
TEST(AreaPrediction, BandsAndFramesWithTheirOwnStructurenessAgreeWithinATenthOfAMillimetre) {
  const TubeRun& band = run_of(FrangiArea::kBand, Feeding::kPredicted);
  const TubeRun& frame = run_of(FrangiArea::kFrame, Feeding::kWhole);
  for (int image = 0; image < kImages; ++image) {
    const auto i = static_cast<std::size_t>(image);
    const double tolerance_mm = image < kGoneFrom ? 0.1 : (image < kGoneTo + 3 ? 1.0 : 0.4);
    EXPECT_LT(max_distance_mm(band.estimates[i], frame.estimates[i]), tolerance_mm) << "image " << i;
    EXPECT_EQ(band.estimates[i].validity, frame.estimates[i].validity) << "image " << i;
  }
}

TEST(AreaPrediction, AWrongBandCostsTimeAndNothingElse) {
  const TubeRun& wrong = run_of(FrangiArea::kBand, Feeding::kWrong);
  const TubeRun& whole = run_of(FrangiArea::kBand, Feeding::kWhole);
  EXPECT_EQ(max_distance_mm(wrong, whole), 0);
  EXPECT_EQ(wrong.completed, static_cast<std::uint64_t>(kImages))
      << "each image was measured where it was read";
}

TEST(AreaPrediction, WhatNobodyMeasuredIsNotInViewAndNoTubeIsMissedThere) {
  const TubeRun& blind = run_of(FrangiArea::kBand, Feeding::kWrongAndNobodyToAsk);
  for (const TubeEstimate& estimate : blind.estimates) {
    EXPECT_EQ(estimate.in_view_ratio, 0);
    EXPECT_FALSE(estimate.has_image);
    EXPECT_FALSE(estimate.reasons.has(Reason::kImageLostTube)) << "no word about what was not looked at";
  }
}

/// A straight tube along the image's rows, as an estimate, with a standard deviation of `sigma_mm`.
TubeEstimate straight_estimate(double sigma_mm) {
  TubeEstimate estimate;
  estimate.point_count = 11;
  for (std::uint32_t i = 0; i < estimate.point_count; ++i) {
    estimate.points[i].p_world_mm = {-60.0 + 12.0 * i, 0, 0};
    const auto variance = static_cast<float>(sigma_mm * sigma_mm);
    estimate.points[i].covariance_mm2 = {0, 0, 0, variance, 0, 0};
  }
  return estimate;
}

constexpr double kAtOnce = 0;  // until the next image

/// Columns 100 .. 300 and row 300 of the camera of Sec. 3.1, 2000/1200 px a mm.
ImageArea predicted_of(const ImageNeed& need, const TubeEstimate& estimate, double timeout_ms) {
  AreaPrediction prediction(one_view_room().cameras.front(), FrangiSettings{});
  prediction.begin(exposure_of(0), milliseconds(static_cast<int>(timeout_ms)));
  prediction.add(need, estimate);
  return prediction.end().area;
}

constexpr ImageNeed kAround{ImageNeed::Kind::kAroundTube, 10, 20};

TEST(AreaPrediction, TheBandIsAsWideAsTheReachTheSpreadAndTheMotionTogether) {
  // 300 / 16 is row 18 of the cells, 288 .. 303. 10 + 1 px to either side: 289 .. 311.
  const ImageArea narrow = predicted_of(kAround, straight_estimate(0), kAtOnce);
  EXPECT_TRUE(narrow.covers_box({200, 289}, {250, 311}));
  EXPECT_FALSE(narrow.covers_box({200, 287}, {200, 300}));
  EXPECT_FALSE(narrow.covers_box({200, 300}, {200, 320}));
  // 3 sigma of 3 mm are 15 px more: 274 .. 326.
  const ImageArea spread = predicted_of(kAround, straight_estimate(3), kAtOnce);
  EXPECT_TRUE(spread.covers_box({200, 274}, {250, 326}));
  EXPECT_FALSE(spread.covers_box({200, 255}, {200, 300}));
  // 30 mm/s for 300 ms are 15 px as well.
  const ImageArea moved = predicted_of(kAround, straight_estimate(0), 300);
  EXPECT_TRUE(moved.covers_box({200, 274}, {250, 326}));
  EXPECT_FALSE(moved.covers_box({200, 255}, {200, 300}));
}

TEST(AreaPrediction, AroundTheTipMoreIsRead) {
  const ImageArea area = predicted_of(kAround, straight_estimate(0), kAtOnce);
  EXPECT_TRUE(area.covers_box({100 - 31, 300}, {100, 300})) << "the tip is at column 100";
  EXPECT_FALSE(area.covers_box({100 - 37, 300}, {100, 300}));
  EXPECT_FALSE(area.covers_box({300, 300}, {300 + 21, 300})) << "nothing is sought beyond the other end";
}

TEST(AreaPrediction, WhoReadsAnythingGetsTheWholeImageAndWhoReadsNothingNone) {
  EXPECT_EQ(predicted_of({ImageNeed::Kind::kWhole}, straight_estimate(0), kAtOnce).share(), 1);
  EXPECT_EQ(predicted_of(kAround, TubeEstimate{}, kAtOnce).share(), 1) << "there is no shape yet";
  EXPECT_TRUE(predicted_of({ImageNeed::Kind::kNothing}, straight_estimate(0), kAtOnce).empty());
}

TEST(AreaPrediction, APlaceThatIsHardlyKnownIsNoPlace) {
  EXPECT_TRUE(predicted_of(kAround, straight_estimate(12), kAtOnce).empty()) << "60 px are 3 sigma";
  EXPECT_TRUE(
      predicted_of(kAround, straight_estimate(std::numeric_limits<double>::infinity()), kAtOnce).empty());
}

TEST(AreaPrediction, WhatWasAskedOfTheLastImageIsExpectedAgain) {
  const RoomDescription room = one_view_room();
  AreaPrediction prediction(room.cameras.front(), FrangiSettings{});
  ImageMeasurement image;
  image.reserve(400, 600);
  prediction.on_demand().begin();
  ImageArea asked(400, 600);
  asked.add_box({20, 500}, {40, 520});
  prediction.on_demand().filter_missing(image, asked);
  prediction.begin(exposure_of(0), kTimeout);
  EXPECT_EQ(prediction.end().area, asked);
  EXPECT_EQ(prediction.end().until, exposure_of(0) + kTimeout);
}

}  // namespace
}  // namespace tubed
