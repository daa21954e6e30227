// Every format, size, stride and shape against OpenCV.
#include "drivers/v4l2/grey_converter.hpp"

#include <gtest/gtest.h>

#include "tests/drivers/v4l2/picture_bench.hpp"

namespace tubed {
namespace {

PictureSize any_size() { return {2 * *rc::gen::inRange(1, 40), 2 * *rc::gen::inRange(1, 40)}; }

/// RGB is weighed with other roundings by OpenCV, and a mean may lie between two values.
double tolerance(PixelFormat format, const PictureShape& shape) {
  const bool is_weighed = format == PixelFormat::kRgb24 || format == PixelFormat::kBgr24;
  return (is_weighed ? 1 : 0) + (shape.decimation > 1 ? 1 : 0);
}

TEST(GreyConverter, GivesWhatOpencvGivesForEveryFormatSizeStrideAndShape) {
  EXPECT_TRUE(rc::check([] {
    const PixelFormat format = static_cast<PixelFormat>(*rc::gen::inRange(0, 9));
    const CardBuffer buffer = noise_picture(format, any_size(), *rc::gen::inRange<std::size_t>(0, 20),
                                            *rc::gen::arbitrary<unsigned>());
    const PictureShape shape = any_shape(buffer.picture.size);
    GreyConverter converter(shape, {});

    const cv::Mat converted = convert(converter, buffer);

    RC_ASSERT(max_difference(converted, shape_by_opencv(grey_by_opencv(buffer), shape)) <=
              tolerance(format, shape));
  }));
}

TEST(GreyConverter, GivesWhatOpencvGivesForMotionJpeg) {
  EXPECT_TRUE(rc::check([] {
    const cv::Mat picture = smooth_picture(any_size(), *rc::gen::arbitrary<unsigned>());
    const CardBuffer buffer = jpeg_picture(picture, {cv::IMWRITE_JPEG_QUALITY, *rc::gen::inRange(40, 101)});
    const PictureShape shape = any_shape(buffer.picture.size);
    GreyConverter converter(shape, {});

    const cv::Mat converted = convert(converter, buffer);

    RC_ASSERT(max_difference(converted, shape_by_opencv(grey_by_opencv(buffer), shape)) <=
              tolerance(PixelFormat::kMjpg, shape));
  }));
}

// A bar that moves by 6 px from the first field to the second.
TEST(GreyConverter, OneFieldOfABarThatMovesHasNoComb) {
  constexpr int kWidth = 40;
  constexpr int kHeight = 20;
  CardBuffer buffer{{PixelFormat::kGrey, {kWidth, kHeight}, kWidth},
                    std::vector<std::uint8_t>(kWidth * kHeight, 200)};
  for (int y = 0; y < kHeight; ++y) {
    const int from = y % 2 == 0 ? 10 : 16;
    for (int x = from; x < from + 4; ++x) buffer.bytes[static_cast<std::size_t>(y * kWidth + x)] = 50;
  }
  for (const auto& [fields, from] : {std::pair{FieldUse::kTop, 10}, {FieldUse::kBottom, 16}}) {
    GreyConverter converter({.fields = fields}, {});
    const cv::Mat picture = convert(converter, buffer);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        ASSERT_EQ(picture.at<std::uint8_t>(y, x), x >= from && x < from + 4 ? 50 : 200) << x << ", " << y;
      }
    }
  }
}

TEST(GreyConverter, KeepsEveryValueOfAGreyPixelOfRgb) {
  CardBuffer buffer{{PixelFormat::kRgb24, {256, 1}, 768}, std::vector<std::uint8_t>(768)};
  for (std::size_t x = 0; x < 768; ++x) {
    buffer.bytes[x] = static_cast<std::uint8_t>(x / 3);
  }
  GreyConverter converter({}, {});

  const cv::Mat converted = convert(converter, buffer);

  for (int x = 0; x < 256; ++x) {
    ASSERT_EQ(converted.at<std::uint8_t>(0, x), x);
  }
}

TEST(GreyConverter, SpreadsLimitedRangeOverAllValuesAndClipsBeyondBlackAndWhite) {
  CardBuffer buffer{{PixelFormat::kGrey, {5, 1}, 5}, {0, 16, 126, 235, 255}};
  GreyConverter converter({}, {.is_limited = true});

  const cv::Mat converted = convert(converter, buffer);

  EXPECT_EQ(converted.at<std::uint8_t>(0, 0), 0);
  EXPECT_EQ(converted.at<std::uint8_t>(0, 1), 0);
  EXPECT_EQ(converted.at<std::uint8_t>(0, 2), 128);  // 255 (126 - 16) / 219 = 128.08
  EXPECT_EQ(converted.at<std::uint8_t>(0, 3), 255);
  EXPECT_EQ(converted.at<std::uint8_t>(0, 4), 255);
}

TEST(GreyConverter, KnowsTheLimitedRangeOfTenBits) {
  CardBuffer buffer{{PixelFormat::kY10, {3, 1}, 6}, {64, 0, 940 & 0xFF, 940 >> 8, 502 & 0xFF, 502 >> 8}};
  GreyConverter converter({}, {.is_limited = true});

  const cv::Mat converted = convert(converter, buffer);

  EXPECT_EQ(converted.at<std::uint16_t>(0, 0), 0);
  EXPECT_EQ(converted.at<std::uint16_t>(0, 1), 1023);
  EXPECT_EQ(converted.at<std::uint16_t>(0, 2), 512);  // half of 1023, rounded
}

TEST(GreyConverter, MakesAScreensValuesLinear) {
  CardBuffer buffer{{PixelFormat::kGrey, {3, 1}, 3}, {0, 128, 255}};
  GreyConverter converter({}, {.gamma = 2.2});

  const cv::Mat converted = convert(converter, buffer);

  EXPECT_EQ(converted.at<std::uint8_t>(0, 0), 0);
  EXPECT_EQ(converted.at<std::uint8_t>(0, 1), 56);  // 255 (128 / 255)^2.2 = 55.98
  EXPECT_EQ(converted.at<std::uint8_t>(0, 2), 255);
}

TEST(GreyConverter, RefusesAPictureOfWhichTheCardLostBytes) {
  EXPECT_TRUE(rc::check([] {
    const PixelFormat format = static_cast<PixelFormat>(*rc::gen::inRange(0, 9));
    CardBuffer buffer = noise_picture(format, any_size(), 0, 1);
    const std::size_t grey_bytes =
        buffer.picture.stride * static_cast<std::size_t>(buffer.picture.size.height);
    buffer.bytes.resize(*rc::gen::inRange<std::size_t>(0, grey_bytes));
    GreyConverter converter({}, {});

    RC_ASSERT(convert(converter, buffer).empty());
    RC_ASSERT(converter.why().find("fewer bytes") != std::string_view::npos);
  }));
}

TEST(GreyConverter, RefusesACropBeyondThePictureAndRowsThatOverlap) {
  GreyConverter cropped({.crop = {10, 0, 31, 20}}, {});
  EXPECT_FALSE(cropped.begin({PixelFormat::kGrey, {40, 20}, 40}));
  EXPECT_TRUE(cropped.begin({PixelFormat::kGrey, {41, 20}, 41}));

  GreyConverter whole({}, {});
  EXPECT_FALSE(whole.begin({PixelFormat::kYuyv, {40, 20}, 79}));
  EXPECT_TRUE(whole.begin({PixelFormat::kYuyv, {40, 20}, 80}));
}

}  // namespace
}  // namespace tubed
