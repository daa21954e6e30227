#include "daemon/image/mask_cover.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <random>

#include "daemon/image/image_checks.hpp"

namespace tubed {
namespace {

constexpr int kWidth = 96;
constexpr int kHeight = 64;

CameraCalibration camera_with(std::vector<int> masks) {
  CameraCalibration camera;
  camera.name = "A";
  camera.width = kWidth;
  camera.height = kHeight;
  camera.masks = std::move(masks);
  return camera;
}

/// A slope of grey with noise of +- `noise`.
ImageFrame slope(int noise, unsigned seed = 1) {
  ImageFrame frame;
  frame.reserve(kWidth, kHeight);
  frame.fluoroscopy_on = true;
  std::mt19937 random(seed);
  std::uniform_int_distribution<int> of(-noise, noise);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      frame.pixels[static_cast<std::size_t>(y * kWidth + x)] =
          static_cast<std::uint8_t>(40 + x + y / 2 + of(random));
    }
  }
  return frame;
}

int at(const ImageFrame& frame, int x, int y) {
  return frame.pixels[static_cast<std::size_t>(y * kWidth + x)];
}

void write_text(const ImageMask& mask, unsigned seed, ImageFrame& frame) {
  std::mt19937 random(seed);
  for (int y = mask.y; y < mask.y + mask.height; ++y) {
    for (int x = mask.x; x < mask.x + mask.width; ++x) {
      frame.pixels[static_cast<std::size_t>(y * kWidth + x)] = random() % 2 == 0 ? 0 : 255;
    }
  }
}

TEST(MaskCover, TextGivesWayToWhatLiesAroundIt) {
  const ImageMask mask{30, 20, 24, 10};
  ImageFrame frame = slope(0);
  const ImageFrame clean = frame;
  write_text(mask, 7, frame);
  MaskCover(camera_with({30, 20, 24, 10})).cover(frame);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      if (mask.contains(x, y)) {
        EXPECT_NEAR(at(frame, x, y), at(clean, x, y), 6) << x << ", " << y;
      } else {
        ASSERT_EQ(at(frame, x, y), at(clean, x, y)) << x << ", " << y;
      }
    }
  }
}

TEST(MaskCover, ATextInACornerAndTwoSideBySideLeaveNothingOfEitherBehind) {
  ImageFrame one = slope(4);
  ImageFrame other = one;
  for (unsigned seed : {1U, 2U}) {
    ImageFrame& frame = seed == 1 ? one : other;
    write_text({0, 0, 20, 8}, seed, frame);
    write_text({20, 0, 10, 8}, seed + 10, frame);
  }
  MaskCover cover(camera_with({0, 0, 20, 8, 20, 0, 10, 8}));
  cover.cover(one);
  cover.cover(other);
  EXPECT_EQ(one.pixels, other.pixels) << "what was written shows through";
}

TEST(MaskCover, CoveringTwiceIsCoveringOnce) {
  ImageFrame frame = slope(10);
  MaskCover cover(camera_with({0, 0, 20, 8, 10, 4, 40, 9, 90, 60, 6, 4}));
  cover.cover(frame);
  const ImageFrame once = frame;
  cover.cover(frame);
  EXPECT_EQ(frame.pixels, once.pixels);
}

TEST(MaskCover, NoiseAtItsSidesIsNotDrawnOutIntoLines) {
  ImageFrame frame = slope(20);
  MaskCover(camera_with({20, 20, 50, 24})).cover(frame);
  // Across the middle, along y: steps from one row to the next, beside those of the noise.
  double inside = 0;
  double outside = 0;
  for (int y = 24; y < 40; ++y) {
    inside = std::max(inside, std::abs(at(frame, 24, y) - at(frame, 24, y - 1)) + 0.0);
    outside = std::max(outside, std::abs(at(frame, 10, y) - at(frame, 10, y - 1)) + 0.0);
  }
  EXPECT_LT(inside, 0.25 * outside);
}

TEST(MaskCover, WordsOfSixteenBitsAsWell) {
  ImageFrame frame = slope(0);
  frame.depth = PixelDepth::kGrey16;
  std::vector<std::uint16_t> words(kWidth * kHeight, 3000);
  for (int x = 5; x < 15; ++x) words[static_cast<std::size_t>(9 * kWidth + x)] = 65535;
  std::memcpy(frame.pixels.data(), words.data(), 2 * words.size());
  MaskCover(camera_with({5, 9, 10, 1})).cover(frame);
  std::memcpy(words.data(), frame.pixels.data(), 2 * words.size());
  EXPECT_TRUE(std::all_of(words.begin(), words.end(), [](std::uint16_t word) { return word == 3000; }));
}

TEST(MaskCover, AFrameThatIsNotTheCamerasOrHasNoPixelsIsLeftAlone) {
  MaskCover cover(camera_with({0, 0, 20, 8}));
  ImageFrame frame = slope(4);
  write_text({0, 0, 20, 8}, 1, frame);
  const auto written = frame.pixels;
  frame.fluoroscopy_on = false;
  cover.cover(frame);
  EXPECT_EQ(frame.pixels, written);
  frame.fluoroscopy_on = true;
  frame.width = kWidth - 1;
  cover.cover(frame);
  EXPECT_EQ(frame.pixels, written);
}

TEST(MaskCover, NothingButMasksIsBlackAndRefused) {
  const CameraCalibration camera = camera_with({0, 0, kWidth, kHeight});
  ImageFrame frame = slope(4);
  MaskCover(camera).cover(frame);
  ImageDoor door(camera);
  ImageMeasurement measurement;
  measurement.reserve(kWidth, kHeight);
  EXPECT_EQ(door.take(frame, measurement), ImageRejection::kBlack);
}

TEST(MaskCover, AClockThatRunsDoesNotHideAFrozenImage) {
  const CameraCalibration camera = camera_with({0, 0, 20, 8});
  MaskCover cover(camera);
  ImageDoor door(camera);
  ImageMeasurement measurement;
  measurement.reserve(kWidth, kHeight);
  for (unsigned second = 0; second < 3; ++second) {
    ImageFrame frame = slope(10);
    write_text({0, 0, 20, 8}, second, frame);
    cover.cover(frame);
    EXPECT_EQ(door.take(frame, measurement), second == 0 ? ImageRejection::kNone : ImageRejection::kFrozen);
  }
}

}  // namespace
}  // namespace tubed
