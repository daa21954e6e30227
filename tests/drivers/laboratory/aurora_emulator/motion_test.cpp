#include "drivers/laboratory/aurora_emulator/motion.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

#include "tests/drivers/laboratory/aurora_emulator/emulated_room.hpp"

namespace tubed::aurora::emulator {
namespace {

RecordedCoils row(double t_s, double x_mm) {
  RecordedCoils row;
  row.t_s = t_s;
  row.coils[0].status = CoilStatus::kOk;
  row.coils[0].p_em_mm = {x_mm, 0, 0};
  row.coils[0].tangent_em = {0, 0, 1};
  return row;
}

TEST(ShortestRotation, BringsZToTheAxisWithoutATurnAboutIt) {
  for (const Eigen::Vector3d& axis :
       {Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, -1, 0),
        Eigen::Vector3d(0.48, -0.6, 0.64), Eigen::Vector3d(-0.6, 0, -0.8), Eigen::Vector3d(0, 0, -1)}) {
    const Quaternion rotation = min_rotation(axis);
    EXPECT_LT((coil_axis(rotation) - axis).norm(), 1e-12) << axis.transpose();
    EXPECT_EQ(rotation.qz, 0);
    EXPECT_GE(rotation.q0, 0);
  }
}

TEST(PlayRecording, GivesTheNewestRowAndBeginsAgainAfterTheLast) {
  const Motion motion = play_recording({row(7.0, 1), row(7.5, 2)}, kPowerOn);
  const auto x_after = [&motion](int ms) { return motion(0, kPowerOn + milliseconds(ms))[0].p_em_mm.x(); };
  EXPECT_EQ(x_after(-100), 1);
  EXPECT_EQ(x_after(100), 1);
  EXPECT_EQ(x_after(600), 2);
  EXPECT_EQ(x_after(1100), 1);
  EXPECT_EQ(x_after(1600), 2);
}

TEST(PlayRecording, RefusesRowsThatAreNoneOrOutOfOrder) {
  EXPECT_THROW((void)play_recording({}, kPowerOn), std::invalid_argument);
  EXPECT_THROW((void)play_recording({row(2, 0), row(1, 0)}, kPowerOn), std::invalid_argument);
}

TEST(Motion, IsWhatTheTrackerReportsFromTheTimeOfEachMeasurement) {
  Host host;
  std::uint64_t number = 0;
  MonotonicTime last{};
  host.device.measurements().on_measurement = [&](const Measurement& measured) {
    const MeasuredCoils asked = moving_coils(number++, 5);
    for (std::size_t i = 0; i < 5; ++i) {
      const CoilSample coil = coil_sample(measured.coils[i]);
      EXPECT_LT((coil.p_em_mm - asked[i].p_em_mm).norm(), 1e-9);
      EXPECT_LT((coil.tangent_em - asked[i].tangent_em).norm(), 1e-9);
    }
    EXPECT_EQ(measured.coils[5].report, Report::kMissing);
    EXPECT_TRUE(last == MonotonicTime{} || measured.time - last == milliseconds(25));
    last = measured.time;
  };
  host.start_tracking();
  host.now += seconds(1);
  host.ask(bx_command(kTransforms));
  EXPECT_GE(number, 40U);
}

}  // namespace
}  // namespace tubed::aurora::emulator
