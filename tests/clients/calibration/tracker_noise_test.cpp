#include "clients/calibration/tracker_noise.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "tests/clients/calibration/synthetic_coils.hpp"

namespace tubed {
namespace {

const std::vector<double> kOffsets{10, 90, 170, 270, 370};

/// Adds `of(t)` to the first coil.
CoilRecording with(CoilRecording recording, const std::function<Eigen::Vector3d(double)>& of) {
  for (SequenceMeasurement& measurement : recording.measurements) {
    measurement.coils[0].p_em_mm += of(measurement.t_s);
  }
  return recording;
}

TEST(TrackerNoise, WhiteNoiseOfStillCoilsIsFoundAxisByAxis) {
  auto recording = straight_recording(kOffsets, {}, 1, 1200);
  Draw draw(2);
  for (SequenceMeasurement& measurement : recording.measurements) {
    for (std::size_t k = 0; k < kOffsets.size(); ++k) {
      measurement.coils[k].p_em_mm += Eigen::Vector3d(draw.normal(0.1), draw.normal(0.2), draw.normal(0.4));
    }
  }
  const StillNoise noise = measure_still(recording);
  EXPECT_NEAR(noise.rate_hz, 40, 0.1);
  for (const StillCoil& coil : noise.coils) {
    // Standard deviation of one from successive differences: sigma sqrt(3 / (4 n)).
    const double relative = 5 * std::sqrt(3.0 / (4 * 1200));
    EXPECT_NEAR(coil.white_mm.x(), 0.1, 0.1 * relative);
    EXPECT_NEAR(coil.white_mm.y(), 0.2, 0.2 * relative);
    EXPECT_NEAR(coil.white_mm.z(), 0.4, 0.4 * relative);
  }
}

TEST(TrackerNoise, TheNoiseOfDirectionsIsThatOfTheUnitVectorsAxes) {
  const StillNoise noise = measure_still(straight_recording(kOffsets, {0.1, 0, 0.004}, 3, 1200));
  EXPECT_NEAR(noise.tangent, 0.004, 0.0002);
}

TEST(TrackerNoise, ItsSigmaCovers) {
  Coverage coverage;
  constexpr int kDraws = 200;
  for (unsigned seed = 0; seed < kDraws; ++seed) {
    const StillNoise noise =
        measure_still(straight_recording({10, 90, 170}, {0.3, 0, 0.003}, 700 + seed, 210));
    coverage.add(noise.coils[0].white_rms_mm() - 0.3, noise.coils[0].white_sigma_mm);
  }
  EXPECT_NEAR(coverage.share(1), 0.683, 3 * std::sqrt(0.683 * 0.317 / kDraws));
  EXPECT_NEAR(coverage.share(2), 0.954, 3 * std::sqrt(0.954 * 0.046 / kDraws));
  EXPECT_GT(coverage.share(3), 0.997 - 3 * std::sqrt(0.997 * 0.003 / kDraws));
}

TEST(TrackerNoise, WhiteNoiseAloneGivesNoRemark) {
  for (unsigned seed = 0; seed < 40; ++seed) {
    EXPECT_TRUE(
        measure_still(straight_recording(kOffsets, {0.3, 0, 0.003}, 900 + seed, 400)).remarks.empty());
  }
}

TEST(TrackerNoise, APeriodicInterferenceIsFoundWithItsFrequency) {
  const auto recording = with(straight_recording(kOffsets, {0.2, 0, 0.003}, 4, 1200), [](double t_s) {
    return Eigen::Vector3d(0, 0.15 * std::sin(2 * std::numbers::pi * 7.3 * t_s), 0);
  });
  const StillNoise noise = measure_still(recording);
  EXPECT_NEAR(noise.coils[0].interference_hz, 7.3, 0.04);
  EXPECT_NEAR(noise.coils[0].interference_mm, 0.15, 0.04);
  EXPECT_EQ(noise.coils[1].interference_hz, 0);
  ASSERT_EQ(noise.remarks.size(), 1U);
  EXPECT_NE(noise.remarks[0].find("sensor 1 shakes at 7.3"), std::string::npos) << noise.remarks[0];
}

TEST(TrackerNoise, ADriftIsFoundAndNotTakenForNoise) {
  const auto recording = with(straight_recording(kOffsets, {0.05, 0, 0.003}, 5, 1200), [](double t_s) {
    return Eigen::Vector3d(0.02 * t_s, 0, 0);  // 1.2 mm a minute
  });
  const StillNoise noise = measure_still(recording);
  EXPECT_NEAR(noise.coils[0].drift_mm_min, 1.2, 0.05);
  EXPECT_NEAR(noise.coils[0].white_mm.x(), 0.05, 0.01);
  ASSERT_EQ(noise.remarks.size(), 1U);
  EXPECT_NE(noise.remarks[0].find("drifts"), std::string::npos);
}

TEST(TrackerNoise, AveragingThatDoesNotHelpIsTold) {
  Draw draw(6);
  double wander = 0;
  const auto recording = with(straight_recording(kOffsets, {0.1, 0, 0.003}, 7, 1200), [&](double) {
    wander = 0.97 * wander + draw.normal(0.03);
    return Eigen::Vector3d(wander, 0, 0);
  });
  const StillNoise noise = measure_still(recording);
  EXPECT_GT(noise.coils[0].averaged_mm, 2 * noise.coils[0].expected_mm);
  EXPECT_LT(noise.coils[1].averaged_mm, 2 * noise.coils[1].expected_mm);
  ASSERT_FALSE(noise.remarks.empty());
}

TEST(TrackerNoise, CoilsThatMovedAreRefused) {
  const auto recording = with(straight_recording(kOffsets, {0.3, 0, 0.003}, 8, 400),
                              [](double t_s) { return Eigen::Vector3d(4 * std::sin(t_s), 0, 0); });
  EXPECT_THROW(measure_still(recording), CalibrationError);
}

TEST(TrackerNoise, AStuckCoilIsLeftOutAndTold) {
  auto recording = straight_recording(kOffsets, {0.3, 0, 0.003}, 9, 400);
  for (SequenceMeasurement& measurement : recording.measurements) {
    measurement.coils[3] = recording.measurements.front().coils[3];
  }
  const StillNoise noise = measure_still(recording);
  EXPECT_EQ(noise.coils.size(), 4U);
  ASSERT_EQ(noise.remarks.size(), 1U);
  EXPECT_NE(noise.remarks[0].find("stuck"), std::string::npos);
}

TEST(TrackerNoise, WithAllCoilsMissingItIsRefused) {
  auto recording = straight_recording(kOffsets, {0.3, 0, 0.003}, 10, 400);
  for (SequenceMeasurement& measurement : recording.measurements) {
    measurement.coils.fill(CoilSample{});
  }
  EXPECT_THROW(measure_still(recording), CalibrationError);
}

}  // namespace
}  // namespace tubed
