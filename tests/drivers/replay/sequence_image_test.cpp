#include "drivers/replay/sequence_image.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "tests/drivers/replay/small_sequence.hpp"

namespace tubed {
namespace {

class SequenceImage : public ::testing::Test {
 protected:
  SequenceImage() { write_small_sequence(folder_); }

  void expect_refused(const std::string& words) const {
    const Sequence sequence = read_sequence(folder_.path());
    try {
      read_image(sequence, sequence.frames[3]);
      FAIL() << "was accepted";
    } catch (const SequenceError& error) {
      EXPECT_EQ(error.position().file.filename(), "frames.csv");
      EXPECT_EQ(error.position().line, 5);
      EXPECT_EQ(error.position().column, 10);
      EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
    }
  }

  TemporaryFolder folder_;
  const std::filesystem::path image_ = folder_.path() / "images/a13.png";
};

TEST_F(SequenceImage, EightBitsComeBackAsTheyWere) {
  const Sequence sequence = read_sequence(folder_.path());

  const GreyImage image = read_image(sequence, sequence.frames[1]);

  EXPECT_EQ(image.width, 5);
  EXPECT_EQ(image.height, 2);
  EXPECT_EQ(image.depth, PixelDepth::kGrey8);
  EXPECT_EQ(image.pixels, grey_image(5, 2, 50).pixels);
}

TEST_F(SequenceImage, SixteenBitsComeBackInHostOrder) {
  std::vector<std::uint16_t> values;
  for (int i = 0; i < 12; ++i) {
    values.push_back(static_cast<std::uint16_t>(5000 * i + 3));
  }
  GreyImage deep{4, 3, PixelDepth::kGrey16, std::vector<std::uint8_t>(24)};
  std::memcpy(deep.pixels.data(), values.data(), 24);
  write_image(image_, deep);
  const Sequence sequence = read_sequence(folder_.path());

  const GreyImage image = read_image(sequence, sequence.frames[3]);

  ASSERT_EQ(image.depth, PixelDepth::kGrey16);
  ASSERT_EQ(image.pixels.size(), 24U);
  EXPECT_EQ(std::memcmp(image.pixels.data(), values.data(), 24), 0);
}

TEST_F(SequenceImage, AnotherSizeThanTheCamerasIsRefused) {
  write_image(image_, grey_image(3, 4, 0));

  expect_refused("has 3 x 4 pixels, camera 'A' 4 x 3");
}

TEST_F(SequenceImage, AColourPictureIsRefused) {
  cv::imwrite(image_.string(), cv::Mat(3, 4, CV_8UC3, cv::Scalar(1, 2, 3)));

  expect_refused("is not 8- or 16-bit grey");
}

TEST_F(SequenceImage, AMissingPictureIsRefused) {
  std::filesystem::remove(image_);

  expect_refused("is missing");
}

TEST_F(SequenceImage, APictureOfAnotherKindIsRefused) {
  folder_.write("images/a13.png", "P5 4 3 255 and what else a picture of another kind may hold");

  expect_refused("is not a PNG");
}

TEST_F(SequenceImage, APictureCutOffIsRefused) {
  std::filesystem::resize_file(image_, 45);

  expect_refused("cannot be decoded");
}

}  // namespace
}  // namespace tubed
