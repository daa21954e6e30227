#include "clients/pictures/grey_picture.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <numeric>

namespace tubed {
namespace {

GreyPicture ramp(int width, int height) {
  GreyPicture picture{
      width, height,
      std::vector<std::uint8_t>(static_cast<std::size_t>(width) * static_cast<std::size_t>(height))};
  std::iota(picture.pixels.begin(), picture.pixels.end(), std::uint8_t{0});
  return picture;
}

TEST(GreyWindow, HoldsTheGreyValuesThatThereAre) {
  std::vector<std::uint16_t> pixels(64000);
  for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i] = static_cast<std::uint16_t>(1000 + i % 2001);
  const GreyWindow window = window_of(pixels);
  EXPECT_LT(window.black, 1000);
  EXPECT_GT(window.white, 3000);
  EXPECT_GT(window.black, 0);
  EXPECT_LT(window.white, 4000);
}

TEST(GreyWindow, FewPixelsThatAreMuchBrighterCountForLittle) {
  std::vector<std::uint16_t> pixels(64000, 500);
  for (std::size_t i = 0; i < 16 * 10; i += 16) pixels[i] = 60000;  // a wire's end, letters
  EXPECT_LT(window_of(pixels).white, 1000);
}

TEST(GreyWindow, AnEvenImageDividesByNothing) {
  const std::vector<std::uint16_t> pixels(1000, 7);
  std::vector<std::uint8_t> shown(pixels.size());
  apply_window(pixels, window_of(pixels), shown);
  EXPECT_EQ(*std::max_element(shown.begin(), shown.end()), *std::min_element(shown.begin(), shown.end()));
}

TEST(GreyWindow, IsLinearAndClamped) {
  const std::vector<std::uint16_t> pixels{0, 100, 228, 355, 65535};
  std::vector<std::uint8_t> shown(pixels.size());
  apply_window(pixels, {100, 355}, shown);
  EXPECT_EQ(shown, (std::vector<std::uint8_t>{0, 0, 128, 255, 255}));
}

TEST(Shrink, AveragesFourPixelsUntilTheSideFits) {
  GreyPicture picture{4, 2, {0, 4, 8, 12, 4, 8, 12, 16}};
  EXPECT_EQ(shrink(picture, 2), 2);
  EXPECT_EQ(picture.width, 2);
  EXPECT_EQ(picture.height, 1);
  EXPECT_EQ(picture.pixels, (std::vector<std::uint8_t>{4, 12}));
}

TEST(Shrink, LeavesWhatFitsAlone) {
  GreyPicture picture = ramp(100, 50);
  EXPECT_EQ(shrink(picture, 100), 1);
  EXPECT_EQ(picture.pixels, ramp(100, 50).pixels);
}

RawImage image_of(std::uint32_t depth_bits, std::uint16_t grey) {
  RawImage image;
  image.head.width = image.head.height = 64;
  image.head.depth_bits = depth_bits;
  image.head.fluoroscopy_on = 1;
  image.pixels.resize(std::size_t{64} * 64 * depth_bits / 8, static_cast<std::uint8_t>(grey));
  if (depth_bits == 16) {
    const std::vector<std::uint16_t> deep(std::size_t{64} * 64, grey);
    std::memcpy(image.pixels.data(), deep.data(), image.pixels.size());
  }
  return image;
}

TEST(GreyFollower, ItsWindowFollowsByAFifthAnImage) {
  GreyFollower follower;
  for (const std::uint32_t depth : {8U, 16U}) {
    EXPECT_EQ(follower.take(image_of(depth, 100)).pixels.size(), 4096U);
  }
  const double before = follower.window().black;
  follower.take(image_of(16, 1100));
  EXPECT_NEAR(follower.window().black - before, 200, 1);
}

}  // namespace
}  // namespace tubed
