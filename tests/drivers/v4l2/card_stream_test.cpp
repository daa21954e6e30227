// What is asked of a card, and what is made of its answers.
#include "drivers/v4l2/card_stream.hpp"

#include <gtest/gtest.h>

#include "tests/drivers/v4l2/fake_card.hpp"

namespace tubed {
namespace {

struct StreamBench {
  FakeCard card;
  CardRequest request{.path = "/dev/video7", .input = {}, .format = {}, .size = {}};
  std::string trouble{};

  /// The format that was chosen; nothing when the card cannot be used: trouble says why.
  std::optional<PixelFormat> start() {
    CardStream stream(std::make_unique<FakeVideoDevice>(card), request);
    const bool is_started = stream.start();
    trouble = stream.trouble().text();
    return is_started ? std::optional(stream.picture().format) : std::nullopt;
  }
};

TEST(CardStream, TakesTheDeepestFormatThatTheCardOffers) {
  StreamBench bench;
  bench.card.formats = {V4L2_PIX_FMT_YUYV, V4L2_PIX_FMT_GREY, V4L2_PIX_FMT_Y16};

  EXPECT_EQ(bench.start(), PixelFormat::kY16);
}

TEST(CardStream, TakesMotionJpegWhereTheRateFitsThroughNothingElse) {
  StreamBench bench;
  bench.card.formats = {V4L2_PIX_FMT_YUYV, V4L2_PIX_FMT_MJPEG};
  bench.card.rate_hz = [](std::uint32_t fourcc) { return fourcc == V4L2_PIX_FMT_MJPEG ? 30.0 : 5.0; };
  bench.request.rate_hz = 30;

  EXPECT_EQ(bench.start(), PixelFormat::kMjpg);
}

TEST(CardStream, TakesALowerRateWhereNoFormatHasTheOneAskedFor) {
  StreamBench bench;
  bench.card.formats = {V4L2_PIX_FMT_YUYV, V4L2_PIX_FMT_GREY};
  bench.card.rate_hz = [](auto) { return 15.0; };
  bench.request.rate_hz = 30;

  EXPECT_EQ(bench.start(), PixelFormat::kGrey);
}

TEST(CardStream, TakesTheFormatThatHasTheSize) {
  StreamBench bench;
  bench.card.formats = {V4L2_PIX_FMT_Y16, V4L2_PIX_FMT_GREY};
  bench.card.has_size = [](std::uint32_t fourcc, int width, int) {
    return fourcc == V4L2_PIX_FMT_GREY || width < 100;
  };
  bench.request.size = {320, 200};

  EXPECT_EQ(bench.start(), PixelFormat::kGrey);
}

TEST(CardStream, AFormatThatIsNotOfferedIsRefusedByName) {
  StreamBench bench;
  bench.request.format = PixelFormat::kNv12;

  EXPECT_EQ(bench.start(), std::nullopt);
  EXPECT_NE(bench.trouble.find("/dev/video7 does not offer format nv12"), std::string::npos) << bench.trouble;
}

TEST(CardStream, ACardWithFormatsOfOthersOnlyIsRefused) {
  StreamBench bench;
  bench.card.formats = {V4L2_PIX_FMT_H264};

  EXPECT_EQ(bench.start(), std::nullopt);
  EXPECT_NE(bench.trouble.find("offers no format that is read here"), std::string::npos) << bench.trouble;
}

TEST(CardStream, SingleFieldsAreNoPictures) {
  StreamBench bench;
  bench.card.field = V4L2_FIELD_ALTERNATE;

  EXPECT_EQ(bench.start(), std::nullopt);
  EXPECT_NE(bench.trouble.find("single fields"), std::string::npos) << bench.trouble;
}

TEST(CardStream, AnOutputOrAnotherKindOfNodeIsRefused) {
  StreamBench bench;
  bench.card.capabilities = V4L2_CAP_VIDEO_OUTPUT | V4L2_CAP_STREAMING;

  EXPECT_EQ(bench.start(), std::nullopt);
  EXPECT_NE(bench.trouble.find("captures no video"), std::string::npos) << bench.trouble;
}

TEST(CardStream, AnInputThatIsNotThereIsRefusedWithItsNumber) {
  StreamBench bench;
  bench.request.input = 3;

  EXPECT_EQ(bench.start(), std::nullopt);
  EXPECT_NE(bench.trouble.find("has no input 3"), std::string::npos) << bench.trouble;
}

}  // namespace
}  // namespace tubed
