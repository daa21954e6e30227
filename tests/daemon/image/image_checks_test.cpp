#include "daemon/image/image_checks.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <random>

namespace tubed {
namespace {

ImageFrame noisy_frame(int width, int height, unsigned seed) {
  ImageFrame frame;
  frame.reserve(width, height);
  std::mt19937 random(seed);
  for (auto& byte : frame.pixels) {
    byte = static_cast<std::uint8_t>(random() % 200);
  }
  return frame;
}

struct ImageDoor {
  ImageDoor() { measurement.reserve(64, 64); }
  ImageRejection take(const ImageFrame& frame) { return take_image(frame, measurement, sum); }
  ImageMeasurement measurement;
  std::uint64_t sum = 0;
};

TEST(ImageChecks, AnXRayLikeImageIsTakenAsItIs) {
  ImageDoor door;
  const ImageFrame frame = noisy_frame(64, 64, 1);
  EXPECT_EQ(door.take(frame), ImageRejection::kNone);
  EXPECT_EQ(door.measurement.grey[100], static_cast<float>(frame.pixels[100]));
}

TEST(ImageChecks, SixteenBitPixelsAreInHostOrder) {
  ImageDoor door;
  ImageFrame frame = noisy_frame(64, 64, 1);
  frame.depth = PixelDepth::kGrey16;
  const std::uint16_t pixel = 40000;
  std::memcpy(frame.pixels.data() + 2 * 7, &pixel, 2);
  EXPECT_EQ(door.take(frame), ImageRejection::kNone);
  EXPECT_EQ(door.measurement.grey[7], 40000.0F);
}

TEST(ImageChecks, AnotherSizeThanTheCamerasIsRefused) {
  ImageDoor door;
  EXPECT_EQ(door.take(noisy_frame(64, 32, 1)), ImageRejection::kWrongSize);
}

TEST(ImageChecks, ABlackOrEvenImageIsRefused) {
  ImageDoor door;
  ImageFrame frame = noisy_frame(64, 64, 1);
  std::fill(frame.pixels.begin(), frame.pixels.end(), std::uint8_t{0});
  EXPECT_EQ(door.take(frame), ImageRejection::kBlack);
  std::fill(frame.pixels.begin(), frame.pixels.end(), std::uint8_t{90});
  EXPECT_EQ(door.take(frame), ImageRejection::kBlack);
}

TEST(ImageChecks, AnImageThatIsMostlyAtTheTopIsSaturated) {
  ImageDoor door;
  ImageFrame frame = noisy_frame(64, 64, 1);
  std::fill(frame.pixels.begin(), frame.pixels.begin() + 64 * 40, std::uint8_t{255});
  EXPECT_EQ(door.take(frame), ImageRejection::kSaturated);
}

TEST(ImageChecks, ABitEqualRepeatIsFrozenAndTheNextNewImageIsTaken) {
  ImageDoor door;
  EXPECT_EQ(door.take(noisy_frame(64, 64, 1)), ImageRejection::kNone);
  EXPECT_EQ(door.take(noisy_frame(64, 64, 1)), ImageRejection::kFrozen);
  EXPECT_EQ(door.take(noisy_frame(64, 64, 2)), ImageRejection::kNone);
}

}  // namespace
}  // namespace tubed
