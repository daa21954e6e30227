// What each point of a published shape is held by, and from where the images that hold it were taken.
#include <gtest/gtest.h>

#include "tests/daemon/estimator/filter_bench.hpp"

namespace tubed {
namespace {

// Coils at 10, 90, 170, 270 and 370 mm: none within 30 mm of 220, and the tip's near 30.
constexpr double kUnheld_mm = 220;
constexpr double kByTheTip_mm = 30;

std::uint32_t held_by(const TubeEstimate& estimate, double s_mm) {
  const double share = s_mm / static_cast<double>(estimate.length_mm);
  return estimate.points[static_cast<std::size_t>(std::lround(share * (estimate.point_count - 1)))].held_by;
}

class HeldBy : public testing::TestWithParam<EstimatorMode> {
 protected:
  HeldBy() {
    bench.settings.mode = GetParam();
    bench.estimator = make_estimator(bench.settings, bench.room.instruments.front(), bench.room);
  }
  FilterBench bench;
};

TEST_P(HeldBy, AnImageAndANearCoilHoldAPointTogether) {
  bench.measure_times(40);
  EXPECT_EQ(held_by(*bench.estimate, kByTheTip_mm), kHeldByCoil | kHeldByImage);
  EXPECT_EQ(held_by(*bench.estimate, kUnheld_mm), kHeldByImage);
}

TEST_P(HeldBy, WithoutImagesOnlyCoilsHold) {
  bench.with_images = false;
  bench.measure_times(40);
  EXPECT_EQ(held_by(*bench.estimate, kByTheTip_mm), kHeldByCoil);
  EXPECT_EQ(held_by(*bench.estimate, kUnheld_mm), 0U);
  EXPECT_EQ(bench.estimate->view_count, 0U);
}

TEST_P(HeldBy, WhereTheImageDoesNotShowTheTubeNothingHoldsIt) {
  bench.hidden = {205, 235};
  bench.measure_times(40);
  EXPECT_EQ(held_by(*bench.estimate, kUnheld_mm), 0U);
  EXPECT_EQ(held_by(*bench.estimate, 50), kHeldByImage);
}

TEST_P(HeldBy, ACoilThatDropsOutHoldsNothing) {
  bench.with_images = false;
  bench.missing = 1;
  bench.measure_times(40);
  EXPECT_EQ(held_by(*bench.estimate, 90), 0U);
  EXPECT_EQ(held_by(*bench.estimate, 170), kHeldByCoil);
}

TEST_P(HeldBy, TheViewIsNamedAsItIsConfigured) {
  bench.measure_times(40);
  const CameraCalibration& camera = bench.room.cameras[0];
  ASSERT_EQ(bench.estimate->view_count, 1U);
  const ViewUsed& view = bench.estimate->views[0];
  EXPECT_EQ(view.camera, 0U);
  EXPECT_FALSE(view.has_own_geometry);
  EXPECT_EQ(view.exposure_monotonic_ns, to_ns(bench.now));
  EXPECT_EQ(view.focal_length_px, (std::array<double, 2>{camera.fx, camera.fy}));
  EXPECT_EQ(view.principal_point_px, (std::array<double, 2>{camera.cx, camera.cy}));
  EXPECT_EQ(view.T_camera_world[11], 1200);
  EXPECT_EQ(view.T_camera_world[15], 1);
}

TEST_P(HeldBy, AViewThatComesWithItsImageIsNamedWithWhatIsNotKnownOfIt) {
  ViewGeometry own = geometry_of(bench.room.cameras[0]);
  own.fx = 2001;
  own.t_camera_world_mm[0] = 0.5;
  own.sigma.translation_mm = {1, 2, 3};
  bench.own_geometry = own;
  bench.measure_times(40);
  ASSERT_EQ(bench.estimate->view_count, 1U);
  const ViewUsed& view = bench.estimate->views[0];
  EXPECT_TRUE(view.has_own_geometry);
  EXPECT_EQ(view.focal_length_px[0], 2001);
  EXPECT_EQ(view.T_camera_world[3], 0.5);
  EXPECT_EQ(view.sigma_translation_mm, (std::array<float, 3>{1, 2, 3}));
  bench.own_geometry.reset();
  bench.measure_times(4);
  EXPECT_FALSE(bench.estimate->views[0].has_own_geometry) << "the next image brought none";
  EXPECT_EQ(bench.estimate->views[0].focal_length_px[0], 2000);
  EXPECT_EQ(bench.estimate->views[0].sigma_translation_mm, (std::array<float, 3>{}));
}

INSTANTIATE_TEST_SUITE_P(Modes, HeldBy, testing::Values(EstimatorMode::kFilter, EstimatorMode::kJoint),
                         [](const auto& mode) { return std::string(name_of(mode.param)); });

// An image is old after 120 ms here; what it showed holds nothing any more.
TEST(HeldByOldImage, HoldsNothing) {
  FilterBench bench;
  bench.measure_times(40);
  ASSERT_EQ(held_by(*bench.estimate, kUnheld_mm), kHeldByImage);
  bench.with_images = false;
  bench.measure_times(3);
  EXPECT_EQ(held_by(*bench.estimate, kUnheld_mm), kHeldByImage) << "75 ms old";
  bench.measure_times(3);
  EXPECT_EQ(held_by(*bench.estimate, kUnheld_mm), 0U);
  EXPECT_EQ(bench.estimate->view_count, 0U);
}

TEST(HeldByEm, OnlyCoilsHoldEvenWhereThereAreImages) {
  FilterBench bench;
  bench.settings.mode = EstimatorMode::kEm;
  bench.estimator = make_estimator(bench.settings, bench.room.instruments.front(), bench.room);
  bench.measure_times(8);
  EXPECT_EQ(held_by(*bench.estimate, kUnheld_mm), 0U);
  EXPECT_EQ(held_by(*bench.estimate, kByTheTip_mm), kHeldByCoil);
}

// The second view shows what the first one does not.
TEST(HeldByTwoViews, EitherHolds) {
  RoomDescription room = one_view_room();
  room.cameras.push_back(room.cameras[0]);
  room.cameras[1].name = "B";
  room.cameras[1].T_camera_world.linear() << 0, 0, 1, 0, 1, 0, -1, 0, 0;
  FilterBench bench(room);
  bench.hidden = {205, 235};
  bench.measure_times(40);
  EXPECT_EQ(held_by(*bench.estimate, kUnheld_mm), kHeldByImage);
  ASSERT_EQ(bench.estimate->view_count, 2U);
  EXPECT_EQ(bench.estimate->views[1].camera, 1U);
  bench.with_further_views = false;
  bench.measure_times(8);  // 200 ms; an image is old after 120
  EXPECT_EQ(held_by(*bench.estimate, kUnheld_mm), 0U) << "what the second one showed is old";
  EXPECT_EQ(bench.estimate->view_count, 1U);
}

}  // namespace
}  // namespace tubed
