#include "clients/view/jpeg_encoder.hpp"

#include <gtest/gtest.h>

#include <numeric>
#include <stdexcept>

namespace tubed {
namespace {

GreyPicture ramp(int width, int height) {
  GreyPicture picture{
      width, height,
      std::vector<std::uint8_t>(static_cast<std::size_t>(width) * static_cast<std::size_t>(height))};
  std::iota(picture.pixels.begin(), picture.pixels.end(), std::uint8_t{0});
  return picture;
}

TEST(JpegEncoder, MakesWhatBeginsAndEndsAsJpegDoes) {
  JpegEncoder encoder;
  for (const int side : {16, 400, 8}) {  // a larger one and a smaller one after it
    const auto jpeg = encoder.encode(ramp(side, side), 80);
    ASSERT_GT(jpeg.size(), 4U);
    EXPECT_EQ(jpeg[0], 0xFF);
    EXPECT_EQ(jpeg[1], 0xD8);
    EXPECT_EQ(jpeg[jpeg.size() - 1], 0xD9);
  }
}

TEST(JpegEncoder, RefusesAPictureWithoutPixels) {
  JpegEncoder encoder;
  EXPECT_THROW(encoder.encode({}, 80), std::runtime_error);
}

}  // namespace
}  // namespace tubed
