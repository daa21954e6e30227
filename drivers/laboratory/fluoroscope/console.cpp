#include "drivers/laboratory/fluoroscope/console.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace tubed {

namespace {

constexpr std::size_t kSampleStride = 61;  // every so many-th pixel is looked at for the brightness
constexpr float kMedianOfNoise = 0.6745F;  // of |x|, x ~ N(0, 1)

// Digits of 3 x 5 cells, a row in three bits, the first row highest; ':' and '.' beside them.
constexpr int kGlyphColumns = 3;
constexpr int kGlyphRows = 5;
constexpr std::array<std::uint16_t, 12> kGlyphs{0b111101101101111, 0b010110010010111, 0b111001111100111,
                                                0b111001111001111, 0b101101111001001, 0b111100111001111,
                                                0b111100111101111, 0b111001001010010, 0b111101111101111,
                                                0b111101111001111, 0b000010000010000, 0b000000000000010};
constexpr std::size_t kColon = 10;
constexpr std::size_t kDot = 11;
constexpr int kCharacters = 8;  // of each text
constexpr int kMargin_cells = 1;

/// Side of a cell of a glyph, px: text is as tall on any picture as on a monitor.
int cell_px(int height) { return std::max(1, height / 200); }
int text_width_px(int height) {
  return cell_px(height) * (kCharacters * (kGlyphColumns + 1) + 2 * kMargin_cells - 1);
}
int text_height_px(int height) { return cell_px(height) * (kGlyphRows + 2 * kMargin_cells); }

using Text = std::array<std::size_t, kCharacters>;  // numbers of glyphs

/// 00:00:00.
Text clock_text(double time_s) {
  const auto whole = static_cast<std::int64_t>(std::floor(std::max(time_s, 0.0)));
  const auto two = [](std::int64_t value) {
    return std::array<std::size_t, 2>{static_cast<std::size_t>(value / 10 % 10),
                                      static_cast<std::size_t>(value % 10)};
  };
  const auto h = two(whole / 3600);
  const auto m = two(whole / 60 % 60);
  const auto s = two(whole % 60);
  return {h[0], h[1], kColon, m[0], m[1], kColon, s[0], s[1]};
}

/// 000000.0: such as a dose that grows.
Text counter_text(std::int64_t exposure) {
  Text text{};
  std::int64_t rest = exposure;
  for (std::size_t i = text.size(); i-- > 0;) {
    if (i + 2 == text.size()) {
      text[i] = kDot;
    } else {
      text[i] = static_cast<std::size_t>(rest % 10);
      rest /= 10;
    }
  }
  return text;
}

}  // namespace

ConsoleSettings typical_console() {
  ConsoleSettings console;
  console.grid_lines = 0.02;
  console.vignetting = 0.25;
  console.edge_enhancement = 0.8;
  console.edge_width_px = 2;
  console.recursive_share = 0.35;
  console.table_slope = 1.4;
  console.brightness_share = 0.3;
  console.text = true;
  return console;
}

Console::Console(const ConsoleSettings& settings, int width, int height)
    : settings_(settings), width_(width), height_(height), edge_blur_(width, height, settings.edge_width_px) {
  const auto pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  blurred_.resize(pixels);
  filtered_.resize(pixels);
  sample_.reserve(pixels / kSampleStride + 1);
  if (settings.grid_lines <= 0 && settings.vignetting <= 0) {
    return;
  }
  shade_.reserve(pixels);
  const double half_diagonal = std::hypot(width, height) / 2;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double from_middle = std::hypot(x - width / 2.0, y - height / 2.0) / half_diagonal;
      const double phase = 2 * std::numbers::pi * x / settings.grid_period_px;
      shade_.push_back(static_cast<float>((1 + settings.grid_lines * std::sin(phase)) *
                                          (1 - settings.vignetting * from_middle * from_middle)));
    }
  }
}

void Console::shade(std::span<float> quanta) const {
  if (!shade_.empty()) {
    std::transform(quanta.begin(), quanta.end(), shade_.begin(), quanta.begin(),
                   [](float value, float factor) { return value * factor; });
  }
}

void Console::process(float dark, float bright, std::span<float> picture) {
  follow_brightness(dark, bright, picture);
  filter_in_time(picture);
  enhance_edges(picture);
  apply_table(dark, bright, picture);
}

/// The median of the picture goes back to where it was, a share of the way with each exposure.
void Console::follow_brightness(float dark, float bright, std::span<float> picture) {
  if (settings_.brightness_share <= 0) {
    return;
  }
  sample_.clear();
  for (std::size_t i = 0; i < picture.size(); i += kSampleStride) {
    // What lies behind blades is dark in any picture, and is not what is looked at.
    if (picture[i] < dark + (dark - bright)) {
      sample_.push_back(picture[i]);
    }
  }
  if (sample_.empty()) {
    return;
  }
  const auto middle = sample_.begin() + static_cast<std::ptrdiff_t>(sample_.size() / 2);
  std::nth_element(sample_.begin(), middle, sample_.end());
  settled_ = is_settled_ ? settled_ : *middle;
  is_settled_ = true;
  taken_back_ += static_cast<float>(settings_.brightness_share) * (*middle - settled_ - taken_back_);
  for (float& value : picture) {
    value -= taken_back_;
  }
}

void Console::filter_in_time(std::span<float> picture) {
  if (settings_.recursive_share <= 0) {
    return;
  }
  const float stays = has_filtered_ ? static_cast<float>(settings_.recursive_share) : 0.0F;
  if (has_filtered_ && settings_.recursive_limit > 0) {
    filter_what_stands_still(picture);
  } else {
    for (std::size_t i = 0; i < picture.size(); ++i) {
      picture[i] += stays * (filtered_[i] - picture[i]);
    }
  }
  std::copy(picture.begin(), picture.end(), filtered_.begin());
  has_filtered_ = true;
}

/// What has changed is judged by five pixels of a row, noise by the median of that.
void Console::filter_what_stands_still(std::span<float> picture) {
  constexpr std::size_t kBeside = 2;
  std::span<float> change = blurred_;
  for (std::size_t i = 0; i < picture.size(); ++i) {
    const std::size_t from = std::max(i, kBeside) - kBeside;
    const std::size_t to = std::min(i + kBeside + 1, picture.size());
    float sum = 0;
    for (std::size_t k = from; k < to; ++k) sum += picture[k] - filtered_[k];
    change[i] = std::abs(sum) / static_cast<float>(to - from);
  }
  sample_.clear();
  for (std::size_t i = 0; i < change.size(); i += kSampleStride) sample_.push_back(change[i]);
  const auto middle = sample_.begin() + static_cast<std::ptrdiff_t>(sample_.size() / 2);
  std::nth_element(sample_.begin(), middle, sample_.end());
  const float limit =
      std::max(1e-9F, *middle / kMedianOfNoise * static_cast<float>(settings_.recursive_limit));
  const auto stays = static_cast<float>(settings_.recursive_share);
  for (std::size_t i = 0; i < picture.size(); ++i) {
    const float square = change[i] * change[i] / (limit * limit);
    picture[i] += stays / (1 + square * square) * (filtered_[i] - picture[i]);
  }
}

void Console::enhance_edges(std::span<float> picture) {
  if (settings_.edge_enhancement <= 0) {
    return;
  }
  std::copy(picture.begin(), picture.end(), blurred_.begin());
  edge_blur_.apply(blurred_);
  const auto amount = static_cast<float>(settings_.edge_enhancement);
  for (std::size_t i = 0; i < picture.size(); ++i) {
    picture[i] += amount * (picture[i] - blurred_[i]);
  }
}

/// tanh(slope x) / tanh(slope) of what lies between dark and bright, x = -1 .. 1.
void Console::apply_table(float dark, float bright, std::span<float> picture) const {
  if (settings_.table_slope <= 1) {
    return;
  }
  const auto slope = static_cast<float>(settings_.table_slope);
  const float middle = (dark + bright) / 2;
  const float half = (dark - bright) / 2;
  const float norm = half / std::tanh(slope);
  for (float& value : picture) {
    const float x = std::clamp((value - middle) / half, -1.0F, 1.0F);
    value = middle + norm * std::tanh(slope * x);
  }
}

std::vector<int> Console::text_areas(const ConsoleSettings& settings, int width, int height) {
  if (!settings.text) {
    return {};
  }
  const int across = text_width_px(height);
  const int down = text_height_px(height);
  return {0, 0, across, down, width - across, 0, across, down};
}

template <typename Pixel>
void Console::burn_in(double time_s, std::int64_t exposure, Pixel full, std::span<Pixel> pixels) const {
  if (!settings_.text) {
    return;
  }
  const int cell = cell_px(height_);
  const auto write = [&](const Text& text, int left) {
    for (int y = 0; y < text_height_px(height_); ++y) {
      for (int x = 0; x < text_width_px(height_); ++x) {
        const int row = y / cell - kMargin_cells;
        const int column = x / cell - kMargin_cells;
        bool is_white = false;
        if (row >= 0 && row < kGlyphRows && column >= 0 && column / (kGlyphColumns + 1) < kCharacters) {
          const std::uint16_t glyph = kGlyphs[text[static_cast<std::size_t>(column / (kGlyphColumns + 1))]];
          const int bit =
              (kGlyphRows - 1 - row) * kGlyphColumns + kGlyphColumns - 1 - column % (kGlyphColumns + 1);
          is_white = column % (kGlyphColumns + 1) < kGlyphColumns && ((glyph >> bit) & 1) != 0;
        }
        pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
               static_cast<std::size_t>(left + x)] = is_white ? full : Pixel{0};
      }
    }
  };
  write(clock_text(time_s), 0);
  write(counter_text(exposure), width_ - text_width_px(height_));
}

template void Console::burn_in(double, std::int64_t, std::uint8_t, std::span<std::uint8_t>) const;
template void Console::burn_in(double, std::int64_t, std::uint16_t, std::span<std::uint16_t>) const;

}  // namespace tubed
