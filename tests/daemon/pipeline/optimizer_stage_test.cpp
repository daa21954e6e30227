#include "daemon/pipeline/optimizer_stage.hpp"

#include <gtest/gtest.h>

#include "tests/daemon/pipeline/optimizer_bench.hpp"

namespace tubed {
namespace {

using std::chrono::milliseconds;

TEST(OptimizerStage, AnImageIsEstimatedAtOnce) {
  OptimizerBench bench;
  bench.clock.advance(milliseconds(5));
  const MonotonicTime exposure = bench.clock.now() - milliseconds(4);
  bench.measure(0, exposure);
  EXPECT_TRUE(bench.stage->step(bench.clock));
  ASSERT_EQ(bench.asked[0].size(), 1U);
  EXPECT_EQ(bench.asked[0][0].instant, exposure);
  EXPECT_TRUE(bench.asked[0][0].is_image_instant);
  EXPECT_NE(bench.asked[0][0].images[0], nullptr);
}

TEST(OptimizerStage, WithoutAnImageTheClockMakesAnEstimateAndNothingIsDoneBefore) {
  OptimizerBench bench;
  bench.clock.advance(milliseconds(20));
  EXPECT_FALSE(bench.stage->step(bench.clock));
  bench.clock.advance(milliseconds(40));
  EXPECT_TRUE(bench.stage->step(bench.clock));
  EXPECT_FALSE(bench.asked[0][0].is_image_instant);
}

TEST(OptimizerStage, TwoViewsOfOneInstantMakeOneEstimate) {
  OptimizerBench bench;
  const MonotonicTime exposure = bench.clock.now();
  bench.announce(0, exposure);
  bench.announce(1, exposure);
  bench.measure(0, exposure);
  EXPECT_FALSE(bench.stage->step(bench.clock)) << "the second view is on its way";
  bench.clock.advance(milliseconds(3));
  bench.measure(1, exposure);
  EXPECT_TRUE(bench.stage->step(bench.clock));
  ASSERT_EQ(bench.asked[0].size(), 1U);
  EXPECT_NE(bench.asked[0][0].images[0], nullptr);
  EXPECT_NE(bench.asked[0][0].images[1], nullptr);
}

/// An optimizer with one camera of 96 x 96 px whose images come in bands.
struct PredictingBench {
  explicit PredictingBench(ImageNeed need, std::optional<RidgePolarity> polarity = std::nullopt) {
    CameraCalibration camera;
    camera.width = camera.height = 96;
    camera.fx = camera.fy = 100;
    prediction = std::make_unique<AreaPrediction>(camera, FrangiSettings{});
    measurements.for_each_slot([](ImageMeasurement& m) { m.reserve(96, 96); });
    predictions.for_each_slot([](PredictedArea& p) { p.area = ImageArea(96, 96); });
    std::vector<std::unique_ptr<Estimator>> estimators;
    auto estimator = std::make_unique<FakeEstimator>(asked);
    estimator->need = need;
    estimator->polarity = polarity;
    estimators.push_back(std::move(estimator));
    stage = std::make_unique<OptimizerStage>(
        std::move(estimators), std::vector<TripleBuffer<TubeEstimate>*>{&estimates},
        std::vector<CameraInlet>{{&measurements, &announcements, &predictions, prediction.get()}}, em,
        PipelineSettings{}, bell, publisher_bell);
  }

  void show() {
    clock.advance(milliseconds(33));
    measurements.back().exposure = measurements.back().frangi_finished = clock.now();
    measurements.back().state = ImageState::kMeasured;
    measurements.publish();
    EXPECT_TRUE(stage->step(clock));
  }

  FakeClock clock;
  std::vector<Observation> asked;
  TripleBuffer<TubeEstimate> estimates;
  TripleBuffer<ImageMeasurement> measurements;
  TripleBuffer<MonotonicTime> announcements;
  TripleBuffer<PredictedArea> predictions;
  std::unique_ptr<AreaPrediction> prediction;
  EmRing em;
  Doorbell bell;
  Doorbell publisher_bell;
  std::unique_ptr<OptimizerStage> stage;
};

TEST(OptimizerStage, TellsTheFrangiStageWithEveryEstimateWhereTheNextImageIsRead) {
  PredictingBench bench({ImageNeed::Kind::kWhole});
  bench.show();
  ASSERT_TRUE(bench.predictions.fetch());
  EXPECT_EQ(bench.predictions.front().area.share(), 1);
  EXPECT_GT(bench.predictions.front().until, bench.clock.now());
  bench.clock.advance(milliseconds(60));
  EXPECT_TRUE(bench.stage->step(bench.clock)) << "a tick";
  EXPECT_TRUE(bench.predictions.fetch());
}

TEST(OptimizerStage, TellsTheFrangiStageWhatTubesLookLikeWhereThatWasFound) {
  for (const std::optional<RidgePolarity> found : {std::optional(RidgePolarity::kBright), {}}) {
    PredictingBench bench({ImageNeed::Kind::kWhole}, found);
    bench.show();
    ASSERT_TRUE(bench.predictions.fetch());
    EXPECT_EQ(bench.predictions.front().polarity, found);
  }
}

TEST(OptimizerStage, WhatTheEstimatorsAskOfAnImageIsMeasuredAndExpectedOfTheNext) {
  PredictingBench bench({ImageNeed::Kind::kNothing});
  bench.show();
  ASSERT_TRUE(bench.predictions.fetch());
  EXPECT_TRUE(bench.predictions.front().area.empty());
  ASSERT_NE(bench.asked.back().on_demand[0], nullptr);
  ImageArea some(96, 96);
  some.add_box({5, 5}, {20, 10});
  bench.asked.back().on_demand[0]->filter_missing(*bench.asked.back().images[0], some);
  bench.clock.advance(milliseconds(60));
  EXPECT_TRUE(bench.stage->step(bench.clock)) << "a tick";
  ASSERT_TRUE(bench.predictions.fetch());
  EXPECT_EQ(bench.predictions.front().area, some);
}

TEST(OptimizerStage, ASecondViewThatDoesNotComeIsNotWaitedForLong) {
  OptimizerBench bench;
  const MonotonicTime exposure = bench.clock.now();
  bench.announce(1, exposure);
  bench.measure(0, exposure);
  EXPECT_FALSE(bench.stage->step(bench.clock));
  bench.clock.advance(milliseconds(21));
  EXPECT_TRUE(bench.stage->step(bench.clock));
  EXPECT_EQ(bench.asked[0][0].images[1], nullptr);
}

TEST(OptimizerStage, AnImageFromBeforeAStallIsNotPublishedAfterIt) {
  OptimizerBench bench;
  bench.measure(0, bench.clock.now());
  bench.clock.advance(std::chrono::seconds(3));
  EXPECT_TRUE(bench.stage->step(bench.clock));
  ASSERT_EQ(bench.asked[0].size(), 1U);
  EXPECT_FALSE(bench.asked[0][0].is_image_instant) << "a tick, not the old image";
  EXPECT_FALSE(bench.stage->step(bench.clock)) << "one estimate, no burst";
  StageReport report;
  bench.stage->describe(report);
  EXPECT_EQ(report.dropped, 1U);
}

TEST(OptimizerStage, NoEstimateWaitsForWhatIsLookedForAfterwards) {
  OptimizerBench bench(2);
  int looked = 0;
  for (FakeEstimator* const fake : bench.fakes) {
    fake->looks_further = [&](const Observation& observation) {
      for (auto& buffer : bench.estimates) {
        EXPECT_EQ(buffer.fetch(), looked == 0) << "had left before";
        EXPECT_EQ(buffer.front().valid_time_ns, to_ns(observation.instant));
      }
      ++looked;
    };
  }
  bench.clock.advance(milliseconds(50));
  bench.stage->step(bench.clock);
  EXPECT_EQ(looked, 2);
}

TEST(OptimizerStage, WhatIsLookedForLongerThanAPeriodIsADeadlineOfTheNextEstimateMissed) {
  OptimizerBench bench;
  const auto misses = [&bench] {
    bench.clock.advance(milliseconds(50));
    bench.stage->step(bench.clock);
    EXPECT_TRUE(bench.estimates[0].fetch());
    return bench.estimates[0].front().reasons.has(Reason::kDeadlineMissed);
  };
  bench.fakes[0]->looks_further = [&](const Observation&) { bench.clock.advance(milliseconds(40)); };
  EXPECT_FALSE(misses());
  bench.fakes[0]->looks_further = nullptr;
  EXPECT_TRUE(misses());
  EXPECT_FALSE(misses());
}

TEST(OptimizerStage, EverySampleHasTheNextSequenceNumberOfItsInstrument) {
  OptimizerBench bench(2);
  for (std::uint64_t expected = 2; expected < 5; ++expected) {
    bench.clock.advance(milliseconds(50));
    bench.stage->step(bench.clock);
    for (auto& buffer : bench.estimates) {
      ASSERT_TRUE(buffer.fetch());
      EXPECT_EQ(buffer.front().sequence_number, expected);
    }
  }
  bench.estimates[1].back();
  EXPECT_EQ(bench.estimates[0].front().instrument, 0U);
  EXPECT_EQ(bench.estimates[1].front().instrument, 1U);
}

TEST(OptimizerStage, TheNewestWordOfTheImageSourcesReachesTheEstimator) {
  OptimizerBench bench;
  bench.measure(0, bench.clock.now(), ImageState::kOff);
  bench.stage->step(bench.clock);
  EXPECT_TRUE(bench.asked[0].back().fluoroscopy_off);
  bench.clock.advance(milliseconds(33));
  bench.measure(0, bench.clock.now(), ImageState::kRejected);
  bench.stage->step(bench.clock);
  EXPECT_TRUE(bench.asked[0].back().image_rejected);
  EXPECT_FALSE(bench.asked[0].back().fluoroscopy_off);
}

TEST(OptimizerStage, ImagesOfAViewThatMovedAreLeftOutAndThoseOfTheOtherAreUsed) {
  OptimizerBench bench;
  for (const ViewState state :
       {ViewState::kSuspect, ViewState::kMoved, ViewState::kStill, ViewState::kUnjudged}) {
    const bool is_moved = state == ViewState::kSuspect || state == ViewState::kMoved;
    bench.clock.advance(milliseconds(33));
    bench.judge_view(0, state);
    bench.measure(0, bench.clock.now());
    bench.measure(1, bench.clock.now());
    bench.stage->step(bench.clock);
    const Observation& observation = bench.asked[0].back();
    EXPECT_TRUE(observation.is_image_instant);
    EXPECT_EQ(observation.images[0] == nullptr, is_moved);
    EXPECT_EQ(observation.moved[0].image != nullptr, is_moved);
    EXPECT_EQ(observation.moved[1].image, nullptr);
    EXPECT_NE(observation.images[1], nullptr);
    EXPECT_EQ(observation.geometry_changed, is_moved);
  }
}

TEST(OptimizerStage, AnImageThatIsLeftOutIsNotTheNewestThatWasUsed) {
  OptimizerBench bench;
  bench.clock.advance(milliseconds(33));
  const MonotonicTime used = bench.clock.now();
  bench.measure(0, used);
  bench.stage->step(bench.clock);
  bench.clock.advance(milliseconds(33));
  bench.judge_view(0, ViewState::kMoved);
  bench.measure(0, bench.clock.now());
  bench.stage->step(bench.clock);
  EXPECT_EQ(bench.asked[0].back().newest_image, used);
  EXPECT_EQ(bench.asked[0].back().newest_left_out, used + milliseconds(33));
  bench.clock.advance(milliseconds(60));
  bench.stage->step(bench.clock);
  EXPECT_TRUE(bench.asked[0].back().geometry_changed) << "between images too";
}

// A period of 33 ms later it would be more than a tenth of a second.
TEST(OptimizerStage, ThatMeasurementsHaveBecomeStaleIsEstimatedAtOnceAndOnce) {
  OptimizerBench bench;
  EmFrame frame;
  for (int i = 0; i < 40; ++i) {
    frame.measured = bench.clock.now();
    frame.received = frame.measured + milliseconds(20);
    bench.em.push(frame);
    bench.stage->step(bench.clock);
    bench.clock.advance(milliseconds(25));
  }
  constexpr std::chrono::microseconds kTimeout{2300 * 25 + 20'000};
  int at_once = 0;
  bench.asked[0].clear();
  while (bench.clock.now() < frame.measured + milliseconds(500)) {
    bench.clock.advance(milliseconds(1));
    bench.stage->step(bench.clock);
  }
  for (const Observation& asked : bench.asked[0]) {
    const auto age = asked.now - frame.measured;
    at_once += age > kTimeout && age < kTimeout + milliseconds(2) ? 1 : 0;
  }
  EXPECT_EQ(at_once, 1);
  EXPECT_LE(bench.asked[0].size(), 17U) << "475 ms at 30 Hz and that one";
}

TEST(OptimizerStage, AMeasurementThatCameBeforeTheImageIsInTheHistoryWhenTheImageIsTakenIn) {
  OptimizerBench bench;
  EmFrame frame;
  frame.measured = bench.clock.now();
  bench.em.push(frame);
  bench.bell.ring();
  bench.clock.advance(milliseconds(2));
  bench.stage->wait(bench.clock);
  EXPECT_FALSE(bench.stage->step(bench.clock)) << "no estimate is made for it";
  EXPECT_TRUE(bench.asked[0].empty());
  EXPECT_FALSE(bench.em.pop(frame)) << "it waits for the image no longer";
  bench.measure(0, bench.clock.now());
  EXPECT_TRUE(bench.stage->step(bench.clock));
  ASSERT_EQ(bench.asked[0].size(), 1U);
  EXPECT_EQ(bench.asked[0][0].em->size(), 1U);
}

/// When estimates are made within a second, with images every 50 ms and measurements every 25.
std::vector<MonotonicTime> made_in_a_second(bool is_woken_by_measurements) {
  OptimizerBench bench;
  EmFrame frame;
  for (int ms = 1; ms <= 1000; ++ms) {
    bench.clock.advance(milliseconds(1));
    const bool is_image = ms % 50 == 17;
    const bool is_measurement = ms % 25 == 8;
    if (is_image) {
      bench.measure(0, bench.clock.now());
    }
    if (is_measurement) {
      frame.measured = frame.received = bench.clock.now();
      bench.em.push(frame);
    }
    if (is_image || ms % 11 == 0 || (is_measurement && is_woken_by_measurements)) {
      bench.stage->step(bench.clock);
    }
  }
  std::vector<MonotonicTime> made;
  for (const Observation& asked : bench.asked[0]) {
    made.push_back(asked.now);
  }
  return made;
}

TEST(OptimizerStage, MeasurementsWakeItButNoEstimateIsMadeForThem) {
  const std::vector<MonotonicTime> woken = made_in_a_second(true);
  EXPECT_GT(woken.size(), 25U);
  EXPECT_LE(woken.size(), 31U);
  EXPECT_EQ(woken.size(), made_in_a_second(false).size());
}

TEST(OptimizerStage, EmMeasurementsReachTheEstimatorInOrderOfTheirTime) {
  OptimizerBench bench;
  EmFrame frame;
  frame.measured = bench.clock.now();
  bench.em.push(frame);
  frame.measured -= milliseconds(25);  // goes backwards: refused and counted
  bench.em.push(frame);
  bench.clock.advance(milliseconds(50));
  bench.stage->step(bench.clock);
  EXPECT_EQ(bench.asked[0].back().em->size(), 1U);
  StageReport report;
  bench.stage->describe(report);
  EXPECT_EQ(report.refused, 1U);
}

TEST(OptimizerStage, WhatCoilsAndImagesDisagreeAboutIsSaidAndItsAmountsSeldom) {
  OptimizerBench bench;
  EXPECT_EQ(bench.why_after_a_tick(), "");
  bench.fakes[0]->disagreement = "about 4 mm";
  EXPECT_EQ(bench.why_after_a_tick(), "about 4 mm");
  bench.fakes[0]->disagreement = "about 5 mm";
  EXPECT_EQ(bench.why_after_a_tick(), "about 4 mm");
  bench.clock.advance(std::chrono::seconds(5));
  EXPECT_EQ(bench.why_after_a_tick(), "about 5 mm");
  bench.fakes[0]->disagreement.clear();
  EXPECT_EQ(bench.why_after_a_tick(), "");
}

TEST(OptimizerStage, ThatAllCoilsHaveJumpedIsSaidWhereNothingElseIs) {
  OptimizerBench bench;
  bench.fakes[0]->jump = "all coils have jumped by 8 mm";
  EXPECT_EQ(bench.why_after_a_tick(), "all coils have jumped by 8 mm");
  bench.fakes[0]->disagreement = "about 4 mm";
  bench.clock.advance(std::chrono::seconds(5));
  EXPECT_EQ(bench.why_after_a_tick(), "about 4 mm");
  bench.fakes[0]->disagreement.clear();
  bench.fakes[0]->jump.clear();
  EXPECT_EQ(bench.why_after_a_tick(), "");
}

}  // namespace
}  // namespace tubed
