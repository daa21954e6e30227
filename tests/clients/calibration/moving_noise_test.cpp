#include "clients/calibration/moving_noise.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "clients/calibration/coil_findings.hpp"
#include "tests/clients/calibration/synthetic_coils.hpp"

namespace tubed {
namespace {

const std::vector<double> kOffsets{10, 90, 170, 270, 370};

/// A catheter that goes to and fro by 40 mm in 4 s and is held still for as long, in turn: 0 or up to 63
/// mm/s.
Eigen::Vector3d way_mm(double t_s) {
  const double phase = std::fmod(t_s, 8);
  return phase < 4 ? Eigen::Vector3d(0, 0, 20 * (1 - std::cos(M_PI * phase / 2))) : Eigen::Vector3d::Zero();
}

bool is_moving(double t_s) { return std::fmod(t_s, 8) < 4; }

/// With `fast_mm` more noise while it moves, an axis.
CoilRecording to_and_fro(const CoilErrors& errors, double fast_mm, unsigned seed, int count = 1600) {
  CoilRecording recording = straight_recording(kOffsets, errors, seed, count);
  Draw draw(seed + 10000);
  for (SequenceMeasurement& measurement : recording.measurements) {
    for (std::size_t k = 0; k < kOffsets.size(); ++k) {
      measurement.coils[k].p_em_mm += way_mm(measurement.t_s);
      if (is_moving(measurement.t_s)) measurement.coils[k].p_em_mm += draw.normal3(fast_mm);
    }
  }
  return recording;
}

TEST(MovingNoise, IsThatOfStillCoils) {
  const MovingNoise noise = measure_moving(to_and_fro({0.3, 0.5, 0.004}, 0, 1));
  ASSERT_EQ(noise.coils.size(), kOffsets.size());
  EXPECT_NEAR(noise.position_mm, 0.3, 0.01);
  EXPECT_NEAR(noise.tangent, 0.004, 0.0002);
  EXPECT_TRUE(noise.remarks.empty()) << noise.remarks.front();
}

TEST(MovingNoise, ASnapOrAnOutlierNowAndThenChangesItLittle) {
  CoilRecording recording = to_and_fro({0.3, 0, 0.004}, 0, 2);
  for (std::size_t i = 100; i < recording.measurements.size(); i += 100) {
    recording.measurements[i].coils[0].p_em_mm += Eigen::Vector3d(15, 0, 0);
  }
  EXPECT_NEAR(measure_moving(recording).coils[0].noise_mm, 0.3, 0.03);
}

TEST(MovingNoise, ThatIsGreaterWhileACoilMovesIsSaid) {
  const MovingNoise noise = measure_moving(to_and_fro({0.3, 0, 0.004}, 0.4, 3));
  ASSERT_EQ(noise.remarks.size(), kOffsets.size());
  EXPECT_NE(noise.remarks[0].find("while it is faster"), std::string::npos) << noise.remarks[0];
  EXPECT_NEAR(noise.coils[0].slow_noise_mm, 0.3, 0.04);
  EXPECT_NEAR(noise.coils[0].fast_noise_mm, 0.5, 0.04);
}

TEST(MovingNoise, TheSameSlowAndFastIsSeldomTakenForMore) {
  Coverage coverage;
  for (unsigned seed = 0; seed < 60; ++seed) {
    for (const MovingCoil& coil : measure_moving(to_and_fro({0.3, 0, 0.003}, 0, 40 + seed, 640)).coils) {
      coverage.add(std::log(coil.fast_noise_mm / coil.slow_noise_mm), coil.ratio_sigma);
    }
  }
  const double draws = 60.0 * static_cast<double>(kOffsets.size());
  EXPECT_NEAR(coverage.share(1), 0.683, 4 * std::sqrt(0.683 * 0.317 / draws));
  EXPECT_NEAR(coverage.share(2), 0.954, 4 * std::sqrt(0.954 * 0.046 / draws));
}

TEST(MovingNoise, MeasurementsThatAreMissingAreNotTakenForMotion) {
  CoilRecording recording = to_and_fro({0.3, 0, 0.004}, 0, 4);
  for (std::size_t i = 0; i < recording.measurements.size(); i += 9) {
    recording.measurements[i].coils[0].status = CoilStatus::kMissing;
  }
  const MovingCoil coil = measure_moving(recording).coils[0];
  EXPECT_NEAR(coil.noise_mm, 0.3, 0.02);
  EXPECT_LT(coil.differences, 1100);
}

TEST(MovingNoise, StillCoilsAreSaidToBeStill) {
  const MovingNoise noise = measure_moving(straight_recording(kOffsets, {0.1, 0, 0.004}, 5, 1200));
  ASSERT_EQ(noise.remarks.size(), 1U);
  EXPECT_NE(noise.remarks[0].find("without --moving"), std::string::npos) << noise.remarks[0];
}

TEST(MovingNoise, TooLittleIsRefused) {
  EXPECT_THROW(measure_moving(straight_recording(kOffsets, {0.1, 0, 0.004}, 6, 100)), CalibrationError);
  CoilRecording recording = to_and_fro({0.3, 0, 0.004}, 0, 7);
  for (std::size_t i = 0; i < recording.measurements.size(); i += 3) {
    for (CoilSample& coil : recording.measurements[i].coils) coil.status = CoilStatus::kMissing;
  }
  EXPECT_THROW(measure_moving(recording), CalibrationError);
}

TEST(MovingNoise, GivesSigmaOnlyWithTheFieldsError) {
  const MovingNoise noise = measure_moving(to_and_fro({0.3, 0.5, 0.004}, 0, 8));
  EXPECT_TRUE(fragment_of(noise, -1).values.empty());
  const ConfigurationFragment fragment = fragment_of(noise, 0.4);
  ASSERT_EQ(fragment.values.size(), 1U);
  EXPECT_EQ(fragment.values[0].path, "estimator.sigma_position_mm");
  EXPECT_NE(page_of(noise, nullptr, fragment).find("faster half"), std::string::npos);
}

}  // namespace
}  // namespace tubed
