#include "drivers/laboratory/view_motion.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "drivers/laboratory/fluoroscope_renderer.hpp"
#include "drivers/laboratory/simulated_view.hpp"
#include "idl/geometry/degree.hpp"
#include "tests/drivers/laboratory/simulated_room.hpp"

namespace tubed {
namespace {

ViewMotion swinging() {
  ViewMotion motion;
  motion.moves = swing(30, 10, 20);
  motion.repeat_s = 20;
  return motion;
}

double turn_deg(const ViewGeometry& view) {
  const Eigen::AngleAxisd turn(
      Eigen::Matrix3d(view.T_camera_world().linear() * paper_camera().T_camera_world.linear().transpose()));
  return turn.angle() / kDegree;
}

TEST(ViewMotion, ASwingGoesThereStaysComesBackAndBeginsAgain) {
  const CameraCalibration camera = paper_camera();
  EXPECT_EQ(moved_view(camera, swinging(), 0), geometry_of(camera));
  EXPECT_NEAR(turn_deg(moved_view(camera, swinging(), 1.5)), 15, 1e-6);
  EXPECT_NEAR(turn_deg(moved_view(camera, swinging(), 7)), 30, 1e-6);
  EXPECT_NEAR(turn_deg(moved_view(camera, swinging(), 12)), 10, 1e-6);
  EXPECT_NEAR(turn_deg(moved_view(camera, swinging(), 41.5)), 15, 1e-6);
}

TEST(ViewMotion, TheIsocentreStaysWhereItIsInTheImage) {
  const Eigen::Vector3d isocentre_mm(0, 0, 0);  // 1200 mm before the paper's camera
  const ViewGeometry view = moved_view(paper_camera(), swinging(), 5);
  EXPECT_TRUE((view.T_camera_world() * isocentre_mm).isApprox(Eigen::Vector3d(0, 0, 1200), 1e-9));
}

TEST(ViewMotion, PanAndZoomAddUp) {
  ViewMotion motion;
  ViewMove pan;
  pan.until_s = 2;
  pan.pan_mm = {10, 0, -4};
  ViewMove zoom;
  zoom.from_s = 1;
  zoom.until_s = 2;
  zoom.zoom = 1.5;
  motion.moves = {pan, zoom};
  const ViewGeometry half = moved_view(paper_camera(), motion, 1);
  EXPECT_NEAR(half.t_camera_world_mm[0], 5, 1e-9);
  EXPECT_EQ(half.fx, 2000);
  const ViewGeometry end = moved_view(paper_camera(), motion, 9);
  EXPECT_NEAR(end.t_camera_world_mm[2], 1196, 1e-9);
  EXPECT_EQ(end.fy, 3000);
}

TEST(ViewMotion, SomebodyPansTurnsOrZoomsOnceAndItStays) {
  ViewMotion motion = swinging();
  motion.moves.clear();
  motion.once = moves_of({.pan_mm = 5, .at_s = 30}, 1);
  ASSERT_TRUE(motion.moves_at_all());
  EXPECT_EQ(moved_view(paper_camera(), motion, 30), geometry_of(paper_camera()));
  const auto shift_mm = [&](double t_s) {
    return Eigen::Vector3d(moved_view(paper_camera(), motion, t_s).T_camera_world().translation() -
                           paper_camera().T_camera_world.translation());
  };
  EXPECT_NEAR(shift_mm(30.25).norm(), 2.5, 1e-9) << "at 10 mm/s";
  EXPECT_NEAR(shift_mm(1e5).norm(), 5, 1e-9) << "repeat_s is of other moves";
  EXPECT_EQ(shift_mm(31).z(), 0) << "in the image's plane";
  motion.once = moves_of({.turn_deg = -15, .zoom = 1.2, .at_s = 2}, 1);
  EXPECT_NEAR(turn_deg(moved_view(paper_camera(), motion, 2.5)), 5, 1e-6);
  EXPECT_NEAR(turn_deg(moved_view(paper_camera(), motion, 90)), 15, 1e-6);
  EXPECT_EQ(moved_view(paper_camera(), motion, 90).fx, 2400);
  EXPECT_TRUE(moves_of({}, 1).empty());
}

TEST(ViewMotion, TheSettingsMoveAViewHalfWayThroughOrWhenTheySay) {
  const CameraCalibration camera = paper_camera();
  const SimulatedWorld world(paper_room(), default_settings().with("pan_mm", 5.0));
  EXPECT_EQ(world.view(camera, 30), geometry_of(camera));  // half way through, in the arch
  EXPECT_NE(world.view(camera, 30.1), geometry_of(camera));
  const SimulatedWorld early(paper_room(), default_settings().with("zoom", 1.5).with("move_at_s", 4.0));
  EXPECT_EQ(early.view(camera, 5).fx, 3000);
  EXPECT_TRUE(early.announced(camera, 5, 1, 1));
}

TEST(ViewMotion, ATableThatIsPannedOnRequestIsSeenFromThereAndGoesBack) {
  const SimulatedWorld world(paper_room(), default_settings());
  SimulatedView view(paper_camera(), world, 1, 1e6, nullptr, PanOnRequest::kYes);
  const auto taken = [&](double pan_mm) {
    std::vector<std::uint8_t> pixels(400 * 600);
    view.pan_table(pan_mm);
    view.render(world, 3, 1, pixels);
    return pixels;
  };
  const std::vector<std::uint8_t> still = taken(0);
  const std::vector<std::uint8_t> panned = taken(6);
  EXPECT_EQ(taken(0), still);
  // 6 mm at 1200 mm and 2000 px: 10 px to the right, where depth is that of the origin.
  double same = 0;
  double shifted = 0;
  for (std::size_t y = 200; y < 400; ++y) {
    for (std::size_t x = 100; x < 300; ++x) {
      same += std::abs(panned[400 * y + x] - still[400 * y + x]);
      shifted += std::abs(panned[400 * y + x] - still[400 * y + x - 10]);
    }
  }
  EXPECT_LT(shifted, 0.5 * same);
  EXPECT_FALSE(world.announced(paper_camera(), 3, 1, 1));
}

TEST(ViewMotion, WhatIsAnnouncedIsOffByAMistakenFocalLength) {
  const auto settings =
      default_settings().with("zoom", 1.5).with("move_at_s", 4.0).with("mistakes", "focal=1.25");
  const SimulatedWorld world(paper_room(), settings);
  const CameraCalibration camera = world.room().cameras.front();
  EXPECT_NEAR(world.view(camera, 5).fx, 2000 / 1.25 * 1.5, 1e-9);
  EXPECT_NEAR(world.announced(camera, 5, 1, 1)->fx, 2000 * 1.5, 1e-9);
}

TEST(ViewMotion, WhatIsAnnouncedErrsAsItSays) {
  ViewMotion motion = swinging();
  motion.noise_rad = 0.1 * kDegree;
  motion.noise_mm = 1;
  const Eigen::Vector3d p_world_mm(0, 0, 0);
  const Eigen::Vector3d true_mm = moved_view(paper_camera(), motion, 5).T_camera_world() * p_world_mm;
  double squares_mm2 = 0;
  constexpr int kDraws = 2000;
  for (int exposure = 0; exposure < kDraws; ++exposure) {
    const auto said = announced_view(paper_camera(), motion, 5, exposure, 3);
    ASSERT_TRUE(said);
    ASSERT_EQ(refusal_of(*said, paper_camera()), nullptr);
    ASSERT_EQ(said->sigma.translation_mm[1], 1);
    ASSERT_EQ(said->sigma.pivot_depth_mm, 1200);
    squares_mm2 += (said->T_camera_world() * p_world_mm - true_mm).squaredNorm();
  }
  EXPECT_NEAR(std::sqrt(squares_mm2 / (3 * kDraws)), 1, 0.05);  // at the isocentre the turn does nothing
}

TEST(ViewMotion, AViewThatStandsOrIsSilentAnnouncesNothing) {
  EXPECT_FALSE(announced_view(paper_camera(), ViewMotion{}, 5, 1, 3));
  ViewMotion silent = swinging();
  silent.announced = false;
  EXPECT_FALSE(announced_view(paper_camera(), silent, 5, 1, 3));
}

TEST(ViewMotion, APictureOfTheArchIsTakenFromWhereTheViewStands) {
  const SimulatedWorld world(paper_room(), default_settings().with("swing_deg", 30.0));
  FluoroscopeRenderer renderer(paper_camera(), world, 5, 1e6);
  std::vector<std::uint8_t> still(400 * 600);
  std::vector<std::uint8_t> moved(still.size());
  renderer.render(world, 5, 0, still);
  const ViewGeometry view = world.view(paper_camera(), 5);
  renderer.look_from(view);
  renderer.render(world, 5, 0, moved);
  EXPECT_NE(still, moved);
  Camera camera(paper_camera());
  camera.look_from(view);
  // Where the catheter is by that geometry it is dark: darker than 8 px to its side.
  int darker = 0;
  int asked = 0;
  for (double s_mm = 150; s_mm < 300; s_mm += 5) {
    const auto p = camera.project(world.point(0, 5, s_mm));
    if (!p || !camera.contains(p->p_image_px, 12)) continue;
    const auto x = static_cast<std::size_t>(std::lround(p->p_image_px.x()));
    const auto y = static_cast<std::size_t>(std::lround(p->p_image_px.y()));
    ++asked;
    darker += moved[400 * y + x] + 8 < std::min(moved[400 * y + x - 9], moved[400 * y + x + 9]) ? 1 : 0;
  }
  ASSERT_GT(asked, 10);
  EXPECT_GT(darker, 0.8 * asked);
  renderer.look_from(geometry_of(paper_camera()));
  renderer.render(world, 5, 0, moved);
  EXPECT_EQ(still, moved) << "back where it was";
}

}  // namespace
}  // namespace tubed
