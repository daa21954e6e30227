#include "drivers/laboratory/simulated_world.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/drivers/laboratory/simulated_room.hpp"

namespace tubed {
namespace {

TEST(VesselCentreline, AQuarterCircleEndsWhereItShould) {
  const double radius_mm = 28;
  const VesselCentreline vessel({1, 2, 3}, {0, -1, 0}, {-1, 0, 0},
                                {{radius_mm * std::numbers::pi / 2, 1 / radius_mm, 0}});

  const VesselPoint end = vessel.at(vessel.length_mm());
  const VesselPoint beyond = vessel.at(vessel.length_mm() + 10);
  const VesselPoint before = vessel.at(-10);

  EXPECT_TRUE(end.p_world_mm.isApprox(Eigen::Vector3d(1 - radius_mm, 2 - radius_mm, 3), 1e-12));
  EXPECT_TRUE(end.tangent_world.isApprox(Eigen::Vector3d(-1, 0, 0), 1e-12));
  EXPECT_TRUE(beyond.p_world_mm.isApprox(Eigen::Vector3d(-9 - radius_mm, 2 - radius_mm, 3), 1e-12));
  EXPECT_TRUE(before.p_world_mm.isApprox(Eigen::Vector3d(1, 12, 3), 1e-12));
}

class SimulatedWorldTest : public ::testing::Test {
 protected:
  SimulatedWorldTest() { room_.instruments.push_back(paper_catheter("cath-2", 6)); }
  RoomDescription room_ = paper_room();
  DriverSettings settings_ = default_settings();
};

TEST_F(SimulatedWorldTest, TheCatheterNeverStretches) {
  const SimulatedWorld world(room_, settings_);
  const double h_mm = 1e-3;
  for (int instrument = 0; instrument < 2; ++instrument) {
    for (double s_mm = 0.25; s_mm < 380; s_mm += 0.7) {
      const Eigen::Vector3d ahead = world.point(instrument, 3.7, s_mm - h_mm);
      const Eigen::Vector3d behind = world.point(instrument, 3.7, s_mm + h_mm);
      ASSERT_NEAR((ahead - behind).norm() / (2 * h_mm), 1, 1e-6) << s_mm;
    }
  }
}

TEST_F(SimulatedWorldTest, ASofterTipIsAnotherRun) {
  const DriverSettings paper = settings_.with("preset", std::string("paper")).with("seed", std::int64_t{3});
  const SimulatedWorld as_it_is(room_, paper);
  const SimulatedWorld soft(room_, paper.with("tip_stiffness", 0.1));
  double farthest_mm = 0;
  for (double t_s = 0; t_s < 40; t_s += 1) {
    farthest_mm = std::max(farthest_mm, (soft.point(0, t_s, 0) - as_it_is.point(0, t_s, 0)).norm());
  }
  EXPECT_GT(farthest_mm, 1);
}

TEST_F(SimulatedWorldTest, TheTangentPointsTowardTheTip) {
  const SimulatedWorld world(room_, settings_);
  const double h_mm = 1e-4;
  for (double s_mm = 0.3; s_mm < 380; s_mm += 1.1) {
    const Eigen::Vector3d toward_tip =
        (world.point(1, 8.0, s_mm - h_mm) - world.point(1, 8.0, s_mm + h_mm)) / (2 * h_mm);
    ASSERT_LT((world.tangent(1, 8.0, s_mm) - toward_tip).norm(), 1e-4) << s_mm;
  }
}

TEST_F(SimulatedWorldTest, TheTipMovesAtMostAsFastAsItIsTold) {
  const SimulatedWorld world(room_, settings_.with("speed_mm_s", 12.0));
  double max_mm_s = 0;
  for (double t_s = 0; t_s < 60; t_s += 0.01) {
    const double speed =
        std::abs(world.insertion_mm(0, t_s + 0.005) - world.insertion_mm(0, t_s - 0.005)) / 0.01;
    max_mm_s = std::max(max_mm_s, speed);
  }
  EXPECT_NEAR(max_mm_s, 12, 1e-3);
}

TEST_F(SimulatedWorldTest, TheArchIsInViewAndTheRearSometimesIsNot) {
  const SimulatedWorld world(room_, settings_);
  const Camera camera(paper_camera());
  int tip_in_view = 0;
  int rear_in_view = 0;
  double depth_mm = 0;
  for (int second = 0; second < 100; ++second) {
    tip_in_view += camera.contains(camera.project(world.point(0, second, 0))->p_image_px) ? 1 : 0;
    rear_in_view += camera.contains(camera.project(world.point(0, second, 380))->p_image_px) ? 1 : 0;
    depth_mm = std::max(depth_mm, std::abs(world.point(0, second, 0).z() - world.point(0, second, 380).z()));
  }
  EXPECT_EQ(tip_in_view, 100);
  EXPECT_GT(rear_in_view, 10);
  EXPECT_LT(rear_in_view, 90);
  EXPECT_GT(depth_mm, 10);
  EXPECT_LT(depth_mm, 30);
}

TEST_F(SimulatedWorldTest, TwoInstrumentsAreApart) {
  const SimulatedWorld world(room_, settings_);
  EXPECT_GT((world.point(0, 5, 200) - world.point(1, 5, 200)).norm(), 5);
}

TEST_F(SimulatedWorldTest, TwoInstrumentsWithTheSameCoilsAreOneCatheter) {
  room_.instruments.push_back(paper_catheter("cath-1 again", 1));
  const SimulatedWorld world(room_, settings_);

  EXPECT_EQ(world.catheter_of(1), 1);
  EXPECT_EQ(world.catheter_of(2), 0);
  EXPECT_EQ(world.point(2, 5, 200), world.point(0, 5, 200));
}

TEST_F(SimulatedWorldTest, TheSameSettingsAreTheSameTruth) {
  const SimulatedWorld one(room_, settings_.with("epoch_ns", std::int64_t{1'000'000'000}));
  const SimulatedWorld other(room_, settings_.with("epoch_ns", std::int64_t{1'000'000'000}));

  EXPECT_EQ(one.seconds(from_ns(3'500'000'000)), 2.5);
  EXPECT_EQ(one.point(1, 2.5, 123.4), other.point(1, 2.5, 123.4));
}

}  // namespace
}  // namespace tubed
