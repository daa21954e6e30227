// Whatever a card calls Motion JPEG: grey values, or words.
#include "drivers/v4l2/jpeg_picture.hpp"

#include <gtest/gtest.h>

#include "tests/drivers/v4l2/picture_bench.hpp"

namespace tubed {
namespace {

/// Motion JPEG without its Huffman tables (DHT, marker FFC4), as many cards send it.
std::vector<std::uint8_t> without_tables(const std::vector<std::uint8_t>& bytes) {
  std::vector<std::uint8_t> rest(bytes.begin(), bytes.begin() + 2);
  std::size_t at = 2;
  while (bytes[at + 1] != 0xDA) {
    const std::size_t length = 2 + (static_cast<std::size_t>(bytes[at + 2]) << 8U) + bytes[at + 3];
    if (bytes[at + 1] != 0xC4) {
      rest.insert(rest.end(), bytes.begin() + static_cast<long>(at),
                  bytes.begin() + static_cast<long>(at + length));
    }
    at += length;
  }
  rest.insert(rest.end(), bytes.begin() + static_cast<long>(at), bytes.end());
  return rest;
}

TEST(JpegPicture, TheStandardTablesAreTakenWhereAPictureBringsNone) {
  CardBuffer whole = jpeg_picture(smooth_picture({64, 48}, 1));
  CardBuffer bare = whole;
  bare.bytes = without_tables(whole.bytes);
  ASSERT_LT(bare.bytes.size(), whole.bytes.size());
  GreyConverter converter({}, {});

  const cv::Mat converted = convert(converter, bare);

  EXPECT_EQ(max_difference(converted, grey_by_opencv(whole)), 0);
}

TEST(JpegPicture, APictureCutOffAnywhereIsRefused) {
  CardBuffer buffer = jpeg_picture(smooth_picture({64, 48}, 2));
  const std::vector<std::uint8_t> whole = buffer.bytes;
  GreyConverter converter({}, {});
  for (std::size_t kept = 0; kept + 8 < whole.size(); ++kept) {  // the last bytes may be padding
    buffer.bytes.assign(whole.begin(), whole.begin() + static_cast<long>(kept));
    ASSERT_TRUE(convert(converter, buffer).empty()) << kept << " of " << whole.size();
    ASSERT_FALSE(converter.why().empty());
  }
  buffer.bytes = whole;
  EXPECT_FALSE(convert(converter, buffer).empty()) << "a good picture after bad ones";
}

TEST(JpegPicture, DamagedBytesGiveAPictureOrWordsAndTheNextPictureIsRead) {
  const CardBuffer good = jpeg_picture(smooth_picture({48, 32}, 3));
  const cv::Mat grey = grey_by_opencv(good);
  GreyConverter converter({}, {});
  EXPECT_TRUE(rc::check([&] {
    CardBuffer bad = good;
    const int hits = *rc::gen::inRange(1, 8);
    for (int hit = 0; hit < hits; ++hit) {
      bad.bytes[*rc::gen::inRange<std::size_t>(0, bad.bytes.size())] = *rc::gen::arbitrary<std::uint8_t>();
    }
    const bool is_refused = convert(converter, bad).empty();
    RC_CLASSIFY(is_refused);
    RC_ASSERT(!is_refused || !converter.why().empty());
    RC_ASSERT(max_difference(convert(converter, good), grey) == 0);
  }));
}

TEST(JpegPicture, AProgressiveOneIsRefusedByName) {
  const CardBuffer buffer = jpeg_picture(smooth_picture({64, 48}, 4), {cv::IMWRITE_JPEG_PROGRESSIVE, 1});
  GreyConverter converter({}, {});

  EXPECT_TRUE(convert(converter, buffer).empty());
  EXPECT_NE(converter.why().find("progressive"), std::string_view::npos) << converter.why();
}

TEST(JpegPicture, AnotherSizeThanTheCardsIsRefused) {
  CardBuffer buffer = jpeg_picture(smooth_picture({64, 48}, 5));
  buffer.picture.size = {64, 64};
  GreyConverter converter({}, {});

  EXPECT_TRUE(convert(converter, buffer).empty());
  EXPECT_NE(converter.why().find("another size"), std::string_view::npos) << converter.why();
}

TEST(JpegPicture, TheWidestPictureFitsItsMemory) {
  const cv::Mat colours = smooth_picture({GreyConverter::kMaxSide, 32}, 6);
  cv::Mat grey;
  cv::extractChannel(colours, grey, 1);
  for (const cv::Mat& picture : {colours, grey}) {
    const CardBuffer buffer = jpeg_picture(picture);
    GreyConverter converter({}, {});
    const cv::Mat converted = convert(converter, buffer);
    EXPECT_EQ(max_difference(converted, grey_by_opencv(buffer)), 0) << converter.why();
  }
}

}  // namespace
}  // namespace tubed
