#include "drivers/v4l2/pixel_format.hpp"

#include <linux/videodev2.h>

#include <algorithm>
#include <array>

namespace tubed {

namespace {

// In the order of PixelFormat.
constexpr std::array<PixelFormatFacts, 10> kFormats{{
    {PixelFormat::kY16, V4L2_PIX_FMT_Y16, "y16", 16, 2},
    {PixelFormat::kY12, V4L2_PIX_FMT_Y12, "y12", 12, 2},
    {PixelFormat::kY10, V4L2_PIX_FMT_Y10, "y10", 10, 2},
    {PixelFormat::kGrey, V4L2_PIX_FMT_GREY, "grey", 8, 1},
    {PixelFormat::kNv12, V4L2_PIX_FMT_NV12, "nv12", 8, 1},
    {PixelFormat::kYuyv, V4L2_PIX_FMT_YUYV, "yuyv", 8, 2},
    {PixelFormat::kUyvy, V4L2_PIX_FMT_UYVY, "uyvy", 8, 2},
    {PixelFormat::kRgb24, V4L2_PIX_FMT_RGB24, "rgb24", 8, 3},
    {PixelFormat::kBgr24, V4L2_PIX_FMT_BGR24, "bgr24", 8, 3},
    {PixelFormat::kMjpg, V4L2_PIX_FMT_MJPEG, "mjpg", 8, 0},
}};

template <typename Condition>
std::optional<PixelFormat> first_with(Condition condition) noexcept {
  const auto found = std::find_if(kFormats.begin(), kFormats.end(), condition);
  return found == kFormats.end() ? std::nullopt : std::optional(found->format);
}

}  // namespace

std::span<const PixelFormatFacts> pixel_formats() noexcept { return kFormats; }

const PixelFormatFacts& facts_of(PixelFormat format) noexcept {
  return kFormats[static_cast<std::size_t>(format)];
}

std::optional<PixelFormat> pixel_format_of_fourcc(std::uint32_t fourcc) noexcept {
  // Cards of both names deliver one picture of JPEG's baseline after the other.
  const std::uint32_t wanted = fourcc == V4L2_PIX_FMT_JPEG ? std::uint32_t{V4L2_PIX_FMT_MJPEG} : fourcc;
  return first_with([&](const PixelFormatFacts& facts) { return facts.fourcc == wanted; });
}

std::optional<PixelFormat> pixel_format_of_word(std::string_view word) noexcept {
  return first_with([&](const PixelFormatFacts& facts) { return facts.word == word; });
}

}  // namespace tubed
