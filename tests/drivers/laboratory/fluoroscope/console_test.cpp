#include "drivers/laboratory/fluoroscope/console.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "idl/geometry/image_mask.hpp"
#include "tests/drivers/laboratory/fluoroscope/small_patient.hpp"

namespace tubed {
namespace {

constexpr int kWidth = 120;
constexpr int kHeight = 100;
constexpr std::size_t kPixels = kWidth * kHeight;
constexpr float kDark = 2;
constexpr float kBright = 0;

std::size_t at(int x, int y) { return static_cast<std::size_t>(y * kWidth + x); }

/// -log of an even picture with a band of `depth` over columns 58 .. 61.
std::vector<float> band(float level, float depth) {
  std::vector<float> picture(kPixels, level);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 58; x < 62; ++x) picture[at(x, y)] += depth;
  }
  return picture;
}

TEST(Console, WhatIsOffChangesNothing) {
  Console console({}, kWidth, kHeight);
  std::vector<float> picture = band(1, 0.2F);
  const std::vector<float> before = picture;
  console.shade(picture);
  console.process(kDark, kBright, picture);
  EXPECT_EQ(picture, before);
  EXPECT_TRUE(Console::text_areas({}, kWidth, kHeight).empty());
}

TEST(Console, GridLinesHaveTheirPeriodAndAmplitudeAndTheCornersAreDarker) {
  ConsoleSettings settings;
  settings.grid_lines = 0.1;
  settings.grid_period_px = 4;
  std::vector<float> quanta(kPixels, 100);
  Console(settings, kWidth, kHeight).shade(quanta);
  EXPECT_NEAR(quanta[at(1, 50)], 110, 0.01);
  EXPECT_NEAR(quanta[at(3, 50)], 90, 0.01);
  EXPECT_NEAR(quanta[at(5, 50)], 110, 0.01);

  settings = {};
  settings.vignetting = 0.3;
  quanta.assign(kPixels, 100);
  Console(settings, kWidth, kHeight).shade(quanta);
  EXPECT_NEAR(quanta[at(60, 50)], 100, 0.01);
  EXPECT_NEAR(quanta[at(0, 0)], 70, 0.1);
}

TEST(Console, TheUnsharpMaskDeepensABandAndBrightensItsSides) {
  ConsoleSettings settings;
  settings.edge_enhancement = 1;
  settings.edge_width_px = 3;
  std::vector<float> picture = band(1, 0.2F);
  Console(settings, kWidth, kHeight).process(kDark, kBright, picture);
  EXPECT_GT(picture[at(60, 50)], 1.25F);
  EXPECT_LT(picture[at(54, 50)], 0.99F);
  EXPECT_NEAR(picture[at(20, 50)], 1, 1e-5);
}

TEST(Console, ABandThatHasGoneLeavesAGhostOfTheRecursiveShare) {
  ConsoleSettings settings;
  settings.recursive_share = 0.4;
  Console console(settings, kWidth, kHeight);
  std::vector<float> first = band(1, 0.5F);
  console.process(kDark, kBright, first);
  EXPECT_NEAR(first[at(60, 50)], 1.5, 1e-5) << "nothing was before the first picture";
  std::vector<float> second = band(1, 0);
  console.process(kDark, kBright, second);
  EXPECT_NEAR(second[at(60, 50)], 1 + 0.4 * 0.5, 1e-5);
  std::vector<float> third = band(1, 0);
  console.process(kDark, kBright, third);
  EXPECT_NEAR(third[at(60, 50)], 1 + 0.4 * 0.4 * 0.5, 1e-5);
}

TEST(Console, AFilterWithALimitShowsWhatMovesAsItIs) {
  std::mt19937 random(3);
  std::normal_distribution<float> noise(0, 0.02F);
  ConsoleSettings settings;
  settings.recursive_share = 0.8;
  settings.recursive_limit = 4;
  Console console(settings, kWidth, kHeight);
  std::vector<float> picture;
  for (int exposure = 0; exposure < 20; ++exposure) {
    picture = band(1, exposure < 19 ? 0.5F : 0);
    for (float& value : picture) value += noise(random);
    console.process(kDark, kBright, picture);
  }
  EXPECT_NEAR(picture[at(60, 50)], 1, 0.1) << "no ghost where the band was";
  double square = 0;
  for (int y = 0; y < kHeight; ++y) square += std::pow(picture[at(20, y)] - 1, 2) / kHeight;
  EXPECT_NEAR(std::sqrt(square), 0.02 / 3, 0.02 / 15) << "and a third of the noise where nothing was";
}

TEST(Console, TheTableKeepsItsEndsAndIsSteeperAtTheMiddle) {
  ConsoleSettings settings;
  settings.table_slope = 2;
  Console console(settings, kWidth, kHeight);
  std::vector<float> picture(kPixels);
  for (std::size_t i = 0; i < kPixels; ++i) picture[i] = 2 * static_cast<float>(i) / (kPixels - 1);
  const std::vector<float> before = picture;
  console.process(kDark, kBright, picture);
  EXPECT_NEAR(picture.front(), 0, 1e-5);
  EXPECT_NEAR(picture.back(), 2, 1e-5);
  EXPECT_TRUE(std::is_sorted(picture.begin(), picture.end()));
  const std::size_t middle = kPixels / 2;
  EXPECT_GT(picture[middle + 100] - picture[middle - 100],
            1.5F * (before[middle + 100] - before[middle - 100]));
}

TEST(Console, AutomaticBrightnessTakesADarkerPictureBackInSteps) {
  ConsoleSettings settings;
  settings.brightness_share = 0.5;
  Console console(settings, kWidth, kHeight);
  std::vector<float> picture(kPixels, 1);
  console.process(kDark, kBright, picture);
  EXPECT_NEAR(picture[0], 1, 1e-6);
  std::vector<float> seen;
  for (int exposure = 0; exposure < 6; ++exposure) {
    std::fill(picture.begin(), picture.end(), 1.4F);
    console.process(kDark, kBright, picture);
    seen.push_back(picture[0]);
  }
  EXPECT_NEAR(seen[0], 1.2, 1e-5);
  EXPECT_NEAR(seen[1], 1.1, 1e-5);
  EXPECT_NEAR(seen[5], 1, 0.01);
}

TEST(Console, ItsTextIsReadWhereItSaysAndNowhereElse) {
  ConsoleSettings settings;
  settings.text = true;
  const Console console(settings, kWidth, kHeight);
  CameraCalibration camera;
  camera.width = kWidth;
  camera.height = kHeight;
  camera.masks = Console::text_areas(settings, kWidth, kHeight);
  ASSERT_EQ(fault_of_masks(camera.masks, kWidth, kHeight), "");
  std::vector<std::uint8_t> now(kPixels, 100);
  std::vector<std::uint8_t> later(kPixels, 100);
  console.burn_in<std::uint8_t>(0, 1, 255, now);
  console.burn_in<std::uint8_t>(1, 2, 255, later);
  int changed = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      if (is_masked(camera, {x, y})) {
        EXPECT_TRUE(now[at(x, y)] == 0 || now[at(x, y)] == 255);
        changed += now[at(x, y)] != later[at(x, y)] ? 1 : 0;
      } else {
        ASSERT_EQ(now[at(x, y)], 100);
      }
    }
  }
  EXPECT_GT(changed, 0) << "the clock stands still";
}

TEST(Console, ARadiographGoesThroughIt) {
  RadiographSettings settings = without_noise();
  settings.display.bits = 8;
  settings.display.contrast = 0.2;  // so that nothing is as dark as can be
  Radiograph plain(small_view(), water_patient(), settings, 1);
  settings.console.edge_enhancement = 1.5;
  settings.console.text = true;
  Radiograph processed(small_view(), water_patient(), settings, 1);
  RadiographScene scene;
  scene.catheters.push_back(bent_catheter());
  const std::vector<std::uint8_t> straight = picture_of(plain, scene);
  const std::vector<std::uint8_t> shown = picture_of(processed, scene);
  const auto least = [](const std::vector<std::uint8_t>& picture) {
    return *std::min_element(picture.begin() + kPixels / 2, picture.end());
  };
  EXPECT_LT(least(shown), least(straight));
  EXPECT_EQ(shown[0], 0) << "the text's ground";
  EXPECT_NE(straight[0], 0);
}

TEST(Console, SettingsThatCannotBeAreNamed) {
  RadiographSettings settings = without_noise();
  settings.console.recursive_share = 1;
  try {
    Radiograph(small_view(), water_patient(), settings, 1);
    FAIL() << "taken";
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("recursive_share"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace tubed
