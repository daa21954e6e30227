// Two equal catheters in one vessel, of which one has coils.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "drivers/laboratory/scenario.hpp"
#include "drivers/laboratory/simulated_view.hpp"
#include "drivers/laboratory/simulated_world.hpp"
#include "tests/drivers/laboratory/simulated_room.hpp"

namespace tubed {
namespace {

/// A world of a preset, and its picture at a time.
class PicturedWorld {
 public:
  explicit PicturedWorld(const char* preset)
      : scenario_(make_scenario(preset, 1)),
        world_(scenario_.room, default_settings().with("preset", std::string(preset))) {}

  [[nodiscard]] const SimulatedWorld& world() const { return world_; }
  [[nodiscard]] const CameraCalibration& camera() const { return scenario_.room.cameras.front(); }

  [[nodiscard]] std::vector<std::uint8_t> picture_at(double t_s) const {
    SimulatedView view(camera(), world_, 1, 2.7);
    std::vector<std::uint8_t> pixels(view.bytes_per_image());
    view.render(world_, t_s, 1, pixels);
    return pixels;
  }

 private:
  Scenario scenario_;
  SimulatedWorld world_;
};

/// Index of the pixel in which a point, mm in the world, is seen; -1 outside of the image and near its edge.
std::ptrdiff_t pixel_of(const CameraCalibration& camera, const Eigen::Vector3d& p_world_mm) {
  constexpr int kEdge_px = 20;
  const Eigen::Vector3d p_mm = camera.T_camera_world * p_world_mm;
  const auto u = static_cast<int>(camera.cx + camera.fx * p_mm.x() / p_mm.z());
  const auto v = static_cast<int>(camera.cy + camera.fy * p_mm.y() / p_mm.z());
  const bool is_inside =
      u >= kEdge_px && v >= kEdge_px && u < camera.width - kEdge_px && v < camera.height - kEdge_px;
  return is_inside ? std::ptrdiff_t{v} * camera.width + u : -1;
}

TEST(Twins, TheirTipsPassEachOther) {
  const PicturedWorld twins("twins");
  const auto between_tips_mm = [&](double t_s) {
    return (twins.world().point(0, t_s, 0) - twins.world().twin_point(t_s, 0)).norm();
  };
  const double duration_s = make_scenario("twins", 1).duration_s();
  EXPECT_GT(between_tips_mm(1), 50);  // across the arch
  EXPECT_LT(between_tips_mm(duration_s / 2), 10);
  EXPECT_GT(between_tips_mm(duration_s - 1), 50);
  EXPECT_EQ(twins.world().room().instruments.size(), 1) << "no tracker sees the other one";
}

TEST(Twins, TheOtherOneIsInThePicture) {
  constexpr double kBefore_s = 4;  // they meet
  const PicturedWorld twins("twins");
  const PicturedWorld alone("field");
  const std::vector<std::uint8_t> both = twins.picture_at(kBefore_s);
  const std::vector<std::uint8_t> one = alone.picture_at(kBefore_s);
  double darker = 0;
  double beside_darker = 0;
  int count = 0;
  for (double s_mm = 20; s_mm < 120; s_mm += 1) {
    const std::ptrdiff_t other = pixel_of(twins.camera(), twins.world().twin_point(kBefore_s, s_mm));
    const std::ptrdiff_t beside =
        pixel_of(twins.camera(), twins.world().twin_point(kBefore_s, s_mm) + Eigen::Vector3d(12, 12, 0));
    if (other < 0 || beside < 0) continue;
    darker += one[static_cast<std::size_t>(other)] - both[static_cast<std::size_t>(other)];
    beside_darker += one[static_cast<std::size_t>(beside)] - both[static_cast<std::size_t>(beside)];
    ++count;
  }
  ASSERT_GT(count, 30);
  EXPECT_GT(darker / count, 8);
  EXPECT_NEAR(beside_darker / count, 0, 2) << "and nothing beside it";
}

}  // namespace
}  // namespace tubed
