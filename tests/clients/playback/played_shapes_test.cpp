#include "clients/playback/played_shapes.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <thread>

#include "clients/evaluation/offline_reconstruction.hpp"

namespace tubed {
namespace {

/// A straight catheter along y that rises by 0.1 mm an instant, without fluoroscopy.
ConfiguredSequence recorded(std::size_t instants) {
  ConfiguredSequence run{{}, {}, {}, kUsualMaxImageTimeout};
  CameraCalibration camera;
  camera.name = "A";
  camera.width = 400;
  camera.height = 600;
  camera.fx = camera.fy = 2000;
  camera.cx = 200;
  camera.cy = 300;
  camera.T_camera_world.translation().z() = 1200;
  run.sequence.room.cameras = {camera};
  InstrumentDescription catheter;
  catheter.id = "cath-1";
  catheter.coils = {{1, 10, false}, {2, 90, false}, {3, 170, true}};
  run.sequence.room.instruments = {catheter};
  run.sequence.room.T_world_em.translation().x() = 5;
  for (std::size_t i = 0; i < instants; ++i) {
    const double t_s = 0.1 * static_cast<double>(i);
    SequenceFrame frame;
    frame.frame = static_cast<std::uint32_t>(100 + i);
    frame.t_s = t_s;
    run.sequence.frames.push_back(frame);
    SequenceMeasurement measurement;
    measurement.t_s = t_s;
    measurement.em_frame = static_cast<std::uint32_t>(i);
    measurement.coil_count = 3;
    for (std::size_t coil = 0; coil < 3; ++coil) {
      CoilSample& sample = measurement.coils[coil];
      sample.status = CoilStatus::kOk;
      // Not the same numbers again and again: those of a stuck tracker.
      sample.p_em_mm = {-5 + 1e-3 * std::sin(static_cast<double>(i)), catheter.coils[coil].offset_from_tip_mm,
                        0.1 * static_cast<double>(i)};
      sample.tangent_em = {0, coil == 2 ? 1.0 : -1.0, 0};
    }
    run.sequence.measurements.push_back(measurement);
    SequenceTruth truth;
    truth.frame = frame.frame;
    truth.points_world_mm.resize(3, 381);
    for (Eigen::Index s = 0; s <= 380; ++s) {
      truth.points_world_mm.col(s) = Eigen::Vector3d(0, static_cast<double>(s), 0.1 * static_cast<double>(i));
    }
    run.sequence.truth.push_back(truth);
  }
  return run;
}

void wait_for(const PlayedShapes& shapes) {
  for (int i = 0; i < 3000 && shapes.ready() < shapes.instants().size() && shapes.trouble().empty(); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
}

TEST(PlayedShapes, AreThoseOfTheReconstruction) {
  const ConfiguredSequence run = recorded(12);
  const PlayedShapes shapes(run);
  wait_for(shapes);
  ASSERT_EQ(shapes.ready(), 12U);
  EXPECT_EQ(shapes.trouble(), "");
  const auto played = std::make_unique<PlayedInstant>();
  std::size_t i = 0;
  reconstruct(
      run.sequence, run.estimator, run.frangi, [&](const SequenceInstant&, const TubeEstimate& estimate) {
        shapes.read(i++, *played);
        EXPECT_STREQ(played->fused.instrument_id, "cath-1");
        EXPECT_STREQ(played->coils_only.instrument_id, "cath-1-em");
        EXPECT_EQ(played->fused.sequence_number, i);
        EXPECT_EQ(played->fused.validity, static_cast<std::uint32_t>(estimate.validity));
        EXPECT_EQ(played->fused.reasons, estimate.reasons.bits());
        EXPECT_NE(played->fused.reasons & tubed_REASON_REPLAY_DATA, 0U);
        ASSERT_EQ(played->fused.point_count, estimate.point_count);
        ASSERT_GT(estimate.point_count, 0U);
        for (std::uint32_t point = 0; point < estimate.point_count; ++point) {
          EXPECT_EQ(played->fused.points[point].p_world_mm[1], estimate.points[point].p_world_mm[1]);
          EXPECT_EQ(played->fused.points[point].covariance_mm2[5], estimate.points[point].covariance_mm2[5]);
        }
      });
  EXPECT_EQ(i, 12U);
}

TEST(PlayedShapes, CoilsAreThoseOfTheNewestMeasurementTowardTheTip) {
  const ConfiguredSequence run = recorded(3);
  const PlayedShapes shapes(run);
  wait_for(shapes);
  const auto played = std::make_unique<PlayedInstant>();
  shapes.read(2, *played);
  ASSERT_EQ(played->coils.coil_count, 3U);
  EXPECT_NEAR(played->coils.coils[1].p_em_mm[1], 90, 1e-9);
  EXPECT_NEAR(played->coils.coils[1].p_em_mm[2], 0.2, 1e-9);
  EXPECT_EQ(played->coils.coils[1].tangent_em[1], -1);
  EXPECT_EQ(played->coils.coils[2].tangent_em[1], -1);  // mounted the other way round
}

TEST(PlayedShapes, SummariesComeInOrderAndOnce) {
  const ConfiguredSequence run = recorded(5);
  const PlayedShapes shapes(run);
  wait_for(shapes);
  std::vector<InstantSummary> summaries;
  shapes.add_summaries(summaries);
  shapes.add_summaries(summaries);
  ASSERT_EQ(summaries.size(), 5U);
  const auto played = std::make_unique<PlayedInstant>();
  for (std::size_t i = 0; i < summaries.size(); ++i) {
    shapes.read(i, *played);
    EXPECT_EQ(static_cast<std::uint32_t>(summaries[i].validity), played->fused.validity);
    EXPECT_LT(summaries[i].error_mm, 1) << "a straight catheter that coils hold";
    EXPECT_GE(summaries[i].error_mm, 0);
    EXPECT_GT(summaries[i].sigma_mm, 0);
    EXPECT_LT(summaries[i].residual_mm, 1);
  }
}

TEST(PlayedShapes, AnImageThatCannotBeReadEndsThemInWords) {
  ConfiguredSequence run = recorded(6);
  run.sequence.folder = "/nonexistent";
  run.sequence.frames[4].file = "gone.png";
  const PlayedShapes shapes(run);
  wait_for(shapes);
  EXPECT_EQ(shapes.ready(), 4U);
  EXPECT_NE(shapes.trouble().find("gone.png"), std::string::npos) << shapes.trouble();
}

TEST(PlayedShapes, ModeEmNeedsNoSecondShapeAndReadsNoImage) {
  ConfiguredSequence run = recorded(6);
  run.sequence.folder = "/nonexistent";
  run.sequence.frames[4].file = "gone.png";
  run.estimator.mode = EstimatorMode::kEm;
  const PlayedShapes shapes(run);
  wait_for(shapes);
  EXPECT_EQ(shapes.ready(), 6U) << shapes.trouble();
  const auto played = std::make_unique<PlayedInstant>();
  shapes.read(5, *played);
  EXPECT_GT(played->fused.point_count, 0U);
  EXPECT_EQ(played->coils_only.point_count, 0U);
}

TEST(PlayedShapes, NobodyWaitsForTheLastOneToEnd) {
  const ConfiguredSequence run = recorded(20000);
  const auto began = std::chrono::steady_clock::now();
  { const PlayedShapes shapes(run); }
  const PlayedShapes again(run);
  EXPECT_LT(again.ready(), 20000U);
  EXPECT_LT(std::chrono::steady_clock::now() - began, std::chrono::minutes(1));
}

}  // namespace
}  // namespace tubed
