#include "drivers/v4l2/grey_rows.hpp"

#include <algorithm>

namespace tubed {

namespace {

// 16 fraction bits; they sum up to one, so that a grey pixel keeps its value.
constexpr std::uint32_t kRed = 19595;
constexpr std::uint32_t kGreen = 38470;
constexpr std::uint32_t kBlue = 7471;
static_assert(kRed + kGreen + kBlue == 1U << 16U);

template <std::size_t step>
void take_every(const std::uint8_t* from, std::span<std::uint8_t> grey) noexcept {
  for (std::size_t x = 0; x < grey.size(); ++x) {
    grey[x] = from[step * x];
  }
}

template <std::size_t red, std::size_t blue>
void weigh(const std::uint8_t* from, std::span<std::uint8_t> grey) noexcept {
  for (std::size_t x = 0; x < grey.size(); ++x) {
    const std::uint8_t* const pixel = from + 3 * x;
    grey[x] = static_cast<std::uint8_t>(
        (kRed * pixel[red] + kGreen * pixel[1] + kBlue * pixel[blue] + (1U << 15U)) >> 16U);
  }
}

}  // namespace

void unpack_row(PixelFormat format, std::span<const std::uint8_t> row,
                std::span<std::uint8_t> grey) noexcept {
  switch (format) {
    case PixelFormat::kGrey:
    case PixelFormat::kNv12:
      std::copy_n(row.begin(), grey.size(), grey.begin());
      break;
    case PixelFormat::kYuyv:
      take_every<2>(row.data(), grey);
      break;
    case PixelFormat::kUyvy:
      take_every<2>(row.data() + 1, grey);
      break;
    case PixelFormat::kRgb24:
      weigh<0, 2>(row.data(), grey);
      break;
    case PixelFormat::kBgr24:
      weigh<2, 0>(row.data(), grey);
      break;
    case PixelFormat::kY10:
    case PixelFormat::kY12:
    case PixelFormat::kY16:
    case PixelFormat::kMjpg:
      break;
  }
}

void unpack_row(PixelFormat format, std::span<const std::uint8_t> row,
                std::span<std::uint16_t> grey) noexcept {
  const unsigned mask = (1U << static_cast<unsigned>(facts_of(format).bits)) - 1;
  for (std::size_t x = 0; x < grey.size(); ++x) {
    const unsigned word = row[2 * x] | static_cast<unsigned>(row[2 * x + 1]) << 8U;
    grey[x] = static_cast<std::uint16_t>(word & mask);
  }
}

}  // namespace tubed
