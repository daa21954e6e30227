#include "drivers/laboratory/flat_panel.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <vector>

#include "drivers/laboratory/scenario.hpp"
#include "drivers/laboratory/simulated_view.hpp"
#include "tests/drivers/laboratory/simulated_room.hpp"

namespace tubed {
namespace {

CameraCalibration paper_view() { return make_scenario("paper", 1).room.cameras.front(); }

TEST(FlatPanel, ItIsDescribedByReadoutBitsAndPixels) {
  const FlatPanel panel = parse_panel("log,14,0.1");
  EXPECT_EQ(panel.readout, DetectorReadout::kDisplay);
  EXPECT_EQ(panel.bits, 14);
  EXPECT_EQ(panel.pixel_mm, 0.1);
  EXPECT_EQ(parse_panel("linear,12,0.2").readout, DetectorReadout::kIntensity);
}

TEST(FlatPanel, WhatIsNoPanelIsRefusedWithAnExample) {
  for (const char* const words :
       {"", "linear", "sqrt,12,0.2", "linear,8,0.2", "linear,12,0", "log,12,0.2,1"}) {
    EXPECT_THROW(parse_panel(words), std::invalid_argument) << words;
  }
}

// 400 x 600 px of 0.6 mm.
TEST(FlatPanel, HalfThePixelIsTwiceAsManyOverTheSameField) {
  const CameraCalibration fine = with_pixels(paper_view(), 0.3);
  EXPECT_EQ(fine.width, 800);
  EXPECT_EQ(fine.height, 1200);
  EXPECT_NEAR(fine.fx, 4000, 1e-9);
  const Eigen::Vector3d p_world_mm(20, 5, -60);
  const Eigen::Vector2d coarse_px = Camera(paper_view()).project(p_world_mm)->p_image_px;
  const Eigen::Vector2d fine_px = Camera(fine).project(p_world_mm)->p_image_px;
  EXPECT_NEAR((2 * coarse_px.array() + 0.5 - fine_px.array()).matrix().norm(), 0, 1e-9);
}

TEST(FlatPanel, OfAFieldTooLargeForAnImageTheMiddleIsLeft) {
  const CameraCalibration fine = with_pixels(paper_view(), 0.1);
  EXPECT_EQ(fine.height, 2048);
  const Eigen::Vector3d axis_mm = *fine.looked_at_world_mm();
  const double coarse_y_px = Camera(paper_view()).project(axis_mm)->p_image_px.y();
  const double fine_y_px = Camera(fine).project(axis_mm)->p_image_px.y();
  EXPECT_NEAR(fine_y_px - 2047 / 2.0, 6 * (coarse_y_px - 599 / 2.0), 1e-6);
}

TEST(FlatPanel, PixelsAveragedToThoseOfTheSettingsHaveTheirDoseAndNoise) {
  const RadiographSettings usual;
  FlatPanel panel;
  panel.pixel_mm = 0.15;
  const RadiographSettings fine = with_panel(usual, panel);
  EXPECT_NEAR(16 * fine.detector.quanta_per_pixel, usual.detector.quanta_per_pixel, 1e-9);
  EXPECT_NEAR(4 * fine.detector.electronic_noise, usual.detector.electronic_noise, 1e-9)
      << "the sum of 16 has 4 times the deviation";
  EXPECT_NEAR(fine.detector.detector_blur_px, 4 * usual.detector.detector_blur_px, 1e-9);
}

TEST(FlatPanel, TheOnesOfToday) {
  const Scenario scenario = make_scenario("flatpanel", 1);
  const CameraCalibration& camera = scenario.room.cameras.front();
  EXPECT_EQ(camera.width, 1024);
  EXPECT_EQ(camera.height, 1024);
  const double depth_mm = (camera.T_camera_world * *camera.looked_at_world_mm()).z();
  EXPECT_NEAR(scenario.room.instruments.front().diameter_mm * camera.fx / depth_mm, 14, 1e-9);
}

/// Mean grey and mean second difference of three pixels in a row, which is noise, of the triples with a mean
/// of `low` to `high`.
struct GreyAndNoise {
  double grey = 0;
  double noise = 0;
};

GreyAndNoise noise_between(const std::vector<std::uint16_t>& words, double low, double high) {
  GreyAndNoise sum;
  int count = 0;
  for (std::size_t i = 0; i + 2 < words.size(); i += 3) {
    const double grey = (words[i] + words[i + 1] + words[i + 2]) / 3.0;
    if (grey < low || grey > high) continue;
    sum.grey += grey;
    sum.noise += std::abs(words[i] - 2 * words[i + 1] + words[i + 2]);
    ++count;
  }
  return {sum.grey / count, sum.noise / count};
}

TEST(FlatPanel, ItsPicturesAreTwelveBitsOfIntensityWithTheNoiseOfQuanta) {
  constexpr char kPanel[] = "linear,12,0.6";
  const DriverSettings settings =
      default_settings().with("preset", std::string("flatpanel")).with("panel", std::string(kPanel));
  const Scenario scenario = on_panel(make_scenario("flatpanel", 1), kPanel);
  const SimulatedWorld world(scenario.room, settings);
  SimulatedView view(scenario.room.cameras.front(), world, 1, 2.7);
  ASSERT_EQ(view.depth(), PixelDepth::kGrey16);
  std::vector<std::uint8_t> bytes(view.bytes_per_image());
  view.render(world, 5, 1, bytes);
  std::vector<std::uint16_t> words(bytes.size() / 2);
  std::memcpy(words.data(), bytes.data(), bytes.size());
  EXPECT_LE(*std::max_element(words.begin(), words.end()), 4095);
  const GreyAndNoise dim = noise_between(words, 150, 400);
  const GreyAndNoise bright = noise_between(words, 900, 2500);
  // Electronic noise is even: the ratio is that of quanta alone at most, and of a logarithm it would be
  // below 1.
  EXPECT_LT(bright.noise / dim.noise, std::sqrt(bright.grey / dim.grey));
  EXPECT_GT(bright.noise / dim.noise, 1.3);
}

}  // namespace
}  // namespace tubed
