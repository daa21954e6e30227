#include "drivers/aurora/tracking_reply.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <numbers>

namespace tubed::aurora {
namespace {

HandleReading good_reading() {
  HandleReading reading;
  reading.handle = 0x0A;
  reading.report = Report::kValid;
  reading.rotation = {1, 0, 0, 0};
  reading.p_em_mm = {10, -20, -200};
  reading.indicator = 0.05;
  reading.port_status.bits = 0x3F;
  reading.frame = 800;
  return reading;
}

TEST(CoilAxis, IsTheImageOfZ) {
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(
      1.1, Eigen::Vector3d(0.3, -0.5, 0.2).normalized()));  // with a qz, as a 6-DOF tool has
  const Quaternion q{turn.w(), turn.x(), turn.y(), turn.z()};
  EXPECT_LT((coil_axis(q) - turn * Eigen::Vector3d::UnitZ()).norm(), 1e-15);
}

TEST(SensorXAxis, IsTheImageOfX) {
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(1.1, Eigen::Vector3d(0.3, -0.5, 0.2).normalized()));
  const Quaternion q{turn.w(), turn.x(), turn.y(), turn.z()};
  EXPECT_LT((sensor_x_axis(q) - turn * Eigen::Vector3d::UnitX()).norm(), 1e-15);
  HandleReading reading = good_reading();
  reading.rotation = q;
  EXPECT_LT((coil_sample(reading).x_axis_em - turn * Eigen::Vector3d::UnitX()).norm(), 1e-15);
}

TEST(CoilAxis, IsOfUnitLengthWhateverTheRoundingOfTheQuaternion) {
  const Quaternion rounded{0.8157, -0.0068, 0.5783, 0};  // length 0.99992
  EXPECT_NEAR(coil_axis(rounded).norm(), 1, 1e-15);
}

TEST(CoilAxis, PointsTheOtherWayWhenReversed) {
  const double half = std::numbers::pi / 4;  // a quarter turn about y takes z to x
  const Quaternion q{std::cos(half), 0, std::sin(half), 0};
  EXPECT_LT((coil_axis(q) - Eigen::Vector3d::UnitX()).norm(), 1e-15);
  EXPECT_LT((coil_axis(q, AxisSense::kReversed) + Eigen::Vector3d::UnitX()).norm(), 1e-15);
}

TEST(CoilSample, OfAGoodCoilHasItsPose) {
  const CoilSample sample = coil_sample(good_reading());
  EXPECT_EQ(sample.status, CoilStatus::kOk);
  EXPECT_EQ(sample.p_em_mm, Eigen::Vector3d(10, -20, -200));
  EXPECT_EQ(sample.tangent_em, Eigen::Vector3d::UnitZ());
  EXPECT_EQ(sample.indicator, 0.05);
}

TEST(CoilSample, DoesNotMindBitsWithoutAName) {
  HandleReading reading = good_reading();
  for (const std::uint32_t bits : {0x3FU, 0x3DU, 0x31U, 0x0002003DU, 0xFFFEEE3FU}) {
    reading.port_status.bits = bits;
    EXPECT_EQ(coil_sample(reading).status, CoilStatus::kOk) << std::hex << bits;
  }
}

TEST(CoilSample, OutsideTheVolumeIsFlaggedAndKeepsAPoseIfThereIsOne) {
  HandleReading reading = good_reading();
  for (const std::uint32_t bit : {6U, 7U}) {
    reading.port_status.bits = 0x3F | 1U << bit;
    EXPECT_EQ(coil_sample(reading).status, CoilStatus::kOutOfVolume);
    EXPECT_EQ(coil_sample(reading).p_em_mm.x(), 10);
  }
  reading.report = Report::kMissing;
  EXPECT_EQ(coil_sample(reading).status, CoilStatus::kOutOfVolume);
  EXPECT_TRUE(std::isnan(coil_sample(reading).p_em_mm.x()));
}

TEST(CoilSample, OfABrokenCoilIsMissingWhateverCameWithIt) {
  HandleReading reading = good_reading();
  for (const std::uint32_t bit : {8U, 12U}) {
    reading.port_status.bits = 0x3F | 1U << bit;
    EXPECT_EQ(coil_sample(reading).status, CoilStatus::kMissing);
    EXPECT_TRUE(coil_sample(reading).p_em_mm.hasNaN());
    EXPECT_TRUE(coil_sample(reading).tangent_em.hasNaN());
  }
}

TEST(CoilSample, OfASensorThatIsNotSeenIsMissingNotAtTheOrigin) {
  HandleReading reading;
  reading.report = Report::kMissing;
  reading.port_status.bits = 0x3F;
  EXPECT_EQ(coil_sample(reading).status, CoilStatus::kMissing);
  EXPECT_TRUE(coil_sample(reading).p_em_mm.hasNaN());
}

TEST(CoilSample, OfAnEmptyPortIsDisabled) {
  HandleReading reading;
  for (const Report report : {Report::kDisabled, Report::kUnoccupied}) {
    reading.report = report;
    EXPECT_EQ(coil_sample(reading).status, CoilStatus::kDisabled);
  }
}

TEST(PlausiblePose, IsFiniteOfUnitLengthAndInTheRoom) {
  EXPECT_TRUE(plausible_pose(good_reading()));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinite = std::numeric_limits<double>::infinity();
  for (const double wrong : {nan, infinite, 1.0021, 0.9979, -3.697314e28}) {
    HandleReading reading = good_reading();
    reading.rotation.q0 = wrong;
    EXPECT_FALSE(plausible_pose(reading)) << wrong;
  }
  for (const double wrong : {nan, -infinite, 1e4, -1e9, -3.697314e28}) {
    HandleReading reading = good_reading();
    reading.p_em_mm.z() = wrong;
    EXPECT_FALSE(plausible_pose(reading)) << wrong;
  }
  HandleReading reading = good_reading();
  reading.indicator = nan;
  EXPECT_FALSE(plausible_pose(reading));
}

TEST(SettlePose, TakesAnImplausiblePoseAway) {
  HandleReading reading = good_reading();
  reading.p_em_mm.x() = 1e30;
  settle_pose(reading);
  EXPECT_EQ(reading.report, Report::kImplausible);
  EXPECT_TRUE(reading.p_em_mm.hasNaN());
  EXPECT_TRUE(std::isnan(reading.rotation.q0));
  EXPECT_EQ(coil_sample(reading).status, CoilStatus::kMissing);
}

TEST(CommonFrame, IsThatOfAllHandlesWithAPose) {
  TrackingReply reply;
  EXPECT_FALSE(common_frame(reply));
  reply.handle_count = 3;
  reply.handles[0] = good_reading();
  reply.handles[1] = HandleReading{};  // missing, never measured
  reply.handles[2] = good_reading();
  EXPECT_EQ(common_frame(reply), 800U);
  reply.handles[2].frame = 808;
  EXPECT_FALSE(common_frame(reply));
}

TEST(CommonFrame, IsThatOfTheMissingHandlesWhenNoneHasAPose) {
  TrackingReply reply;
  reply.handle_count = 2;
  reply.handles[0].report = Report::kDisabled;
  reply.handles[1].frame = 16;
  EXPECT_EQ(common_frame(reply), 16U);
}

TEST(ListsExactly, NeedsEachHandleOnce) {
  TrackingReply reply;
  reply.handle_count = 2;
  reply.handles[0].handle = 0x0A;
  reply.handles[1].handle = 0x0C;
  const std::uint8_t enabled[] = {0x0C, 0x0A};
  EXPECT_TRUE(lists_exactly(reply, enabled));
  reply.handles[1].handle = 0x0A;
  EXPECT_FALSE(lists_exactly(reply, enabled));
  reply.handle_count = 1;
  EXPECT_FALSE(lists_exactly(reply, enabled));
}

TEST(SystemStatus, NamesItsBits) {
  EXPECT_TRUE(SystemStatus{0x0080}.port_became_unoccupied());
  EXPECT_FALSE(SystemStatus{0x0080}.port_became_occupied());
  EXPECT_TRUE(SystemStatus{0x00C0}.port_became_occupied());
  EXPECT_TRUE(SystemStatus{0x0001}.synchronisation_error());
  EXPECT_TRUE(SystemStatus{0x0008}.processing_exception());
  EXPECT_TRUE(SystemStatus{0x0100}.diagnostic_pending());
  EXPECT_TRUE(SystemStatus{0x0200}.temperature_out_of_range());
  EXPECT_TRUE(SystemStatus{0x0400}.hardware_changed());
}

}  // namespace
}  // namespace tubed::aurora
