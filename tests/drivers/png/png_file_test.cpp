#include "drivers/png/png_file.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <vector>

#include "tests/support/temporary_folder.hpp"

namespace tubed {
namespace {

constexpr int kWidth = 37;
constexpr int kHeight = 23;

/// Every value of a byte, and no two rows alike.
std::vector<std::uint8_t> pixels_of(PixelLayout layout) {
  std::vector<std::uint8_t> pixels(std::size_t{kWidth} * kHeight * bytes_per_pixel(layout));
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    pixels[i] = static_cast<std::uint8_t>(i * 131 + i / 256 * 17);
  }
  return pixels;
}

std::string refusal_of(const std::filesystem::path& file, PixelLayout layout) {
  std::vector<std::uint8_t> pixels(std::size_t{kWidth} * kHeight * bytes_per_pixel(layout));
  try {
    static_cast<void>(read_png_header(file));
    read_png(file, {kWidth, kHeight, layout, pixels});
    return "was accepted";
  } catch (const PngError& error) {
    return error.what();
  }
}

class PngFile : public ::testing::TestWithParam<std::tuple<PixelLayout, PngCompression>> {
 protected:
  PngFile() { write_png(file_, {kWidth, kHeight, layout_, pixels_}, std::get<1>(GetParam())); }

  const PixelLayout layout_ = std::get<0>(GetParam());
  const std::vector<std::uint8_t> pixels_ = pixels_of(layout_);
  TemporaryFolder folder_;
  const std::filesystem::path file_ = folder_.path() / "picture.png";
};

TEST_P(PngFile, PixelsComeBackBitForBit) {
  const PngHeader header = read_png_header(file_);
  std::vector<std::uint8_t> read(pixels_.size());
  read_png(file_, {kWidth, kHeight, layout_, read});

  EXPECT_EQ(header.width, kWidth);
  EXPECT_EQ(header.height, kHeight);
  EXPECT_EQ(header.layout, layout_);
  EXPECT_EQ(read, pixels_);
}

TEST_P(PngFile, AnotherReaderSeesTheSamePixels) {
  cv::Mat read = cv::imread(file_.string(), cv::IMREAD_UNCHANGED);

  ASSERT_EQ(read.total() * read.elemSize(), pixels_.size());
  ASSERT_EQ(read.cols, kWidth);
  if (layout_ == PixelLayout::kRgb8) {
    for (int i = 0; i < kWidth * kHeight; ++i) std::swap(read.data[3 * i], read.data[3 * i + 2]);
  }
  EXPECT_EQ(std::memcmp(read.data, pixels_.data(), pixels_.size()), 0);
}

INSTANTIATE_TEST_SUITE_P(
    EachLayout, PngFile,
    ::testing::Combine(::testing::Values(PixelLayout::kGrey8, PixelLayout::kGrey16, PixelLayout::kRgb8),
                       ::testing::Values(PngCompression::kFast, PngCompression::kSmall)));

TEST(PngFileOfAnother, KindIsReadInItsHeaderAlone) {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "alpha.png";
  cv::imwrite(file.string(), cv::Mat(kHeight, kWidth, CV_8UC4, cv::Scalar(1, 2, 3, 4)));

  EXPECT_FALSE(read_png_header(file).layout.has_value());
  EXPECT_EQ(refusal_of(file, PixelLayout::kRgb8), "cannot be decoded; is it damaged or cut off?");
}

// The same number of bytes in a row: 37 pixels of colour and 111 of grey.
TEST(PngFileOfAnother, LayoutWithRowsOfTheSameLengthIsRefused) {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "grey.png";
  cv::imwrite(file.string(), cv::Mat(kHeight, 3 * kWidth, CV_8UC1, cv::Scalar(7)));

  EXPECT_EQ(refusal_of(file, PixelLayout::kRgb8), "cannot be decoded; is it damaged or cut off?");
}

TEST(PngFileThatIsNone, IsRefusedInWords) {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "picture.png";

  EXPECT_EQ(refusal_of(file, PixelLayout::kGrey8), "is missing or cannot be read");
  folder.write("picture.png", "P5 37 23 255 and what else a picture of another kind may hold");
  EXPECT_EQ(refusal_of(file, PixelLayout::kGrey8), "is not a PNG; convert it to one");
}

TEST(PngFileThatIsNone, IsWrittenNowhere) {
  const TemporaryFolder folder;
  const std::vector<std::uint8_t> pixels = pixels_of(PixelLayout::kGrey8);

  EXPECT_THROW(write_png(folder.path() / "no/folder/picture.png",
                         {kWidth, kHeight, PixelLayout::kGrey8, pixels}, PngCompression::kFast),
               PngError);
}

}  // namespace
}  // namespace tubed
