#include "drivers/laboratory/fluoroscope_renderer.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <vector>

#include "tests/drivers/laboratory/simulated_room.hpp"

namespace tubed {
namespace {

constexpr double kNoNoise = 1e6;
constexpr std::int64_t kSeed = 5;

using Picture = std::vector<std::uint8_t>;

Picture picture_of(const RoomDescription& room, double t_s, std::int64_t exposure, double cnr) {
  const SimulatedWorld world(room, default_settings());
  FluoroscopeRenderer renderer(room.cameras.front(), world, kSeed, cnr);
  Picture pixels(400 * 600);
  renderer.render(world, t_s, exposure, pixels);
  return pixels;
}

RoomDescription room_without_catheter() {
  RoomDescription room = paper_room();
  room.instruments.clear();
  return room;
}

/// How much darker the picture is for the catheter, grey levels.
class Shadow {
 public:
  explicit Shadow(double t_s)
      : with_(picture_of(paper_room(), t_s, 0, kNoNoise)),
        without_(picture_of(room_without_catheter(), t_s, 0, kNoNoise)) {}

  [[nodiscard]] double at(int x, int y) const {
    const auto pixel = static_cast<std::size_t>(y * 400 + x);
    return double{static_cast<double>(without_[pixel])} - with_[pixel];
  }

  /// Centre of gravity of the shadow in row y within 6 px of x.
  [[nodiscard]] double centre_x(double x, int y) const {
    double weight = 0;
    double moment = 0;
    for (int column = static_cast<int>(x) - 6; column <= static_cast<int>(x) + 7; ++column) {
      weight += at(column, y);
      moment += at(column, y) * column;
    }
    return moment / weight;
  }

 private:
  Picture with_;
  Picture without_;
};

TEST(FluoroscopeRenderer, TheShadowLiesOnTheProjectedCentreline) {
  const double t_s = 2;
  const SimulatedWorld world(paper_room(), default_settings());
  const Camera camera(paper_camera());
  const Shadow shadow(t_s);

  std::vector<double> errors_px;
  for (int y = 250; y < 560; ++y) {
    // The descending aorta runs nearly upright: find the arc length that projects to this row.
    double s_mm = 150;
    for (int round = 0; round < 30; ++round) {
      s_mm += 0.6 * (y - camera.project(world.point(0, t_s, s_mm))->p_image_px.y());
    }
    const Eigen::Vector2d expected = camera.project(world.point(0, t_s, s_mm))->p_image_px;
    ASSERT_NEAR(expected.y(), y, 1e-6);
    errors_px.push_back(shadow.centre_x(expected.x(), y) - expected.x());
  }

  // Rounding to whole grey levels alone scatters one row by 0.07 px: look at five rows together, and at all.
  for (std::size_t row = 5; row <= errors_px.size(); row += 5) {
    const auto end = errors_px.begin() + static_cast<std::ptrdiff_t>(row);
    EXPECT_NEAR(std::accumulate(end - 5, end, 0.0) / 5, 0, 0.1) << "rows up to " << 250 + row;
  }
  EXPECT_NEAR(
      std::accumulate(errors_px.begin(), errors_px.end(), 0.0) / static_cast<double>(errors_px.size()), 0,
      0.02);
}

TEST(FluoroscopeRenderer, TheShadowIsAsWideAsTheDiameterProjects) {
  // A band of full depth: area / depth = its width, blurred or not; 2.33 mm at about 1190 mm with f = 2000
  // px.
  const Shadow shadow(2);
  const SimulatedWorld world(paper_room(), default_settings());
  const auto projected = Camera(paper_camera()).project(world.point(0, 2, 200));
  const double expected_px = 2.33 * 2000 / projected->depth_mm;
  const int y = static_cast<int>(projected->p_image_px.y());
  double area = 0;
  for (int row = y - 20; row < y + 20; ++row) {
    for (int x = static_cast<int>(projected->p_image_px.x()) - 10; x < projected->p_image_px.x() + 10; ++x) {
      area += shadow.at(x, row) / 40;
    }
  }
  EXPECT_NEAR(area / FluoroscopeRenderer::kCatheterContrast_grey, expected_px, 0.1);
}

TEST(FluoroscopeRenderer, NoiseIsContrastOverCnr) {
  const Picture noisy = picture_of(room_without_catheter(), 0, 3, 2.7);
  const Picture clean = picture_of(room_without_catheter(), 0, 3, kNoNoise);
  double squares = 0;
  for (std::size_t i = 0; i < noisy.size(); ++i) {
    squares += std::pow(static_cast<double>(noisy[i]) - clean[i], 2);
  }
  const double quantisation = 2.0 / 12;
  EXPECT_NEAR(std::sqrt(squares / static_cast<double>(noisy.size()) - quantisation),
              FluoroscopeRenderer::kCatheterContrast_grey / 2.7, 0.05);
}

TEST(FluoroscopeRenderer, TheSameExposureIsTheSamePictureAndTheNextIsNot) {
  const RoomDescription room = paper_room();
  EXPECT_EQ(picture_of(room, 1, 40, 2.7), picture_of(room, 1, 40, 2.7));
  EXPECT_NE(picture_of(room, 1, 40, 2.7), picture_of(room, 1, 41, 2.7));
}

TEST(FluoroscopeRenderer, NothingOfAnEarlierPictureIsLeft) {
  const RoomDescription room = paper_room();
  const SimulatedWorld world(room, default_settings());
  FluoroscopeRenderer renderer(room.cameras.front(), world, kSeed, 2.7);
  Picture pixels(400 * 600);
  renderer.render(world, 9, 8, pixels);

  renderer.render(world, 1, 40, pixels);

  EXPECT_EQ(pixels, picture_of(room, 1, 40, 2.7));
}

TEST(FluoroscopeRenderer, ACatheterBehindOrBesideTheCameraIsNotDrawn) {
  RoomDescription room = paper_room();
  room.cameras[0].T_camera_world.translation() = Eigen::Vector3d(5000, 0, -1200);

  EXPECT_EQ(picture_of(room, 1, 0, 2.7), picture_of(room_without_catheter(), 1, 0, 2.7));
}

}  // namespace
}  // namespace tubed
