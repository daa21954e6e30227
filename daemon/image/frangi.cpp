#include "daemon/image/frangi.hpp"

#include <algorithm>
#include <bit>
#include <stdexcept>
#include <string>

namespace tubed {

namespace {

constexpr double kStencilVariance = 0.2;  // what the 3 x 3 second-derivative stencil adds to sigma^2
constexpr double kKernelReach = 3.3;      // Gaussian cut at 3.3 sigma
constexpr double kCoarsestInteger = 2.5;  // px; beyond, second derivatives drown in the rounding of 16 bits
constexpr float kLog2E = 1.44269504F;

// What is streamed at once, so that source and maps of a block stay in the second-level cache for all scales.
constexpr int kBlockWidth = 512;
constexpr int kBlockHeight = 64;

double smoothing_sigma(double sigma_px) {
  return std::sqrt(std::max(sigma_px * sigma_px - kStencilVariance, 0.04));
}

int reach_of(double sigma_px) {
  return std::max(1, static_cast<int>(std::ceil(kKernelReach * smoothing_sigma(sigma_px))));
}

// From the centre outwards; their sum over all pixels is 1.
std::vector<float> gaussian_weights(double sigma_px) {
  const double sigma = smoothing_sigma(sigma_px);
  std::vector<double> weights;
  weights.reserve(static_cast<std::size_t>(reach_of(sigma_px)) + 1);
  double sum = 0;
  for (int i = 0; i <= reach_of(sigma_px); ++i) {
    weights.push_back(std::exp(-0.5 * i * i / (sigma * sigma)));
    sum += (i == 0 ? 1 : 2) * weights.back();
  }
  std::vector<float> normalised;
  normalised.reserve(weights.size());
  for (const double weight : weights) {
    normalised.push_back(static_cast<float>(weight / sum));
  }
  return normalised;
}

// Sum 65535, so that a sum of 16-bit products never exceeds 16 bits.
std::vector<std::uint16_t> pair_weights(const std::vector<float>& weights) {
  std::vector<std::uint16_t> pairs{0};
  pairs.reserve(weights.size());
  int left = 65535;
  for (std::size_t k = 1; k < weights.size(); ++k) {
    const int pair = static_cast<int>(std::lround(2 * 65536.0 * static_cast<double>(weights[k])));
    pairs.push_back(static_cast<std::uint16_t>(pair));
    left -= pair;
  }
  pairs[0] = static_cast<std::uint16_t>(std::max(left, 0));
  return pairs;
}

bool suits_integers(double sigma_px, FrangiSmoothing smoothing) {
  return smoothing == FrangiSmoothing::kInteger16 && sigma_px <= kCoarsestInteger;
}

int max_reach(const std::vector<double>& scales_px) {
  if (scales_px.size() > kMaxFrangiScales) {
    throw std::invalid_argument("Frangi filter of " + std::to_string(scales_px.size()) +
                                " scales: must be 8 at most");
  }
  int greatest = 0;
  for (const double sigma : scales_px) {
    if (!(sigma >= 0.5 && sigma <= 20)) {
      throw std::invalid_argument("Frangi scale of " + std::to_string(sigma) +
                                  " px: must be within 0.5 .. 20 px");
    }
    greatest = std::max(greatest, reach_of(sigma));
  }
  if (scales_px.empty()) {
    throw std::invalid_argument("Frangi filter without a scale: give at least one sigma in px");
  }
  return greatest;
}

int checked_size(int size) {
  if (size < FrangiFilter::kMinSize) {
    throw std::invalid_argument("Frangi filter of an image " + std::to_string(size) +
                                " px wide or high: must be at least 16");
  }
  return size;
}

PixelRectangle clipped(const PixelRectangle& part, const PixelRectangle& to) {
  return {std::max(part.left, to.left), std::max(part.top, to.top), std::min(part.right, to.right),
          std::min(part.bottom, to.bottom)};
}

// Calls `visit` with the blocks of `part`, left to right, top to bottom. Widths are whole registers but the
// last.
template <typename Visit>
void for_each_block(const PixelRectangle& part, Visit&& visit) {
  const int columns = (part.width() + kBlockWidth - 1) / kBlockWidth;
  const int block_width = (part.width() / columns + 15) / 16 * 16;
  for (int top = part.top; top < part.bottom; top += kBlockHeight) {
    for (int column = 0; column < columns; ++column) {
      const int left = part.left + column * block_width;
      const int right = column + 1 == columns ? part.right : left + block_width;
      visit(PixelRectangle{left, top, right, std::min(top + kBlockHeight, part.bottom)});
    }
  }
}

// Bits that are set in any of the pixels.
unsigned bits_in_use(std::span<const std::uint16_t> pixels) {
  std::uint16_t bits = 0;
  for (const std::uint16_t pixel : pixels) {
    bits |= pixel;
  }
  return bits;
}

template <typename Pixel>
void repeat_outermost(Pixel* row, int width, int margin, int loaded_left, int loaded_right) {
  if (loaded_left == 0) {
    std::fill(row - margin, row, row[0]);
  }
  if (loaded_right == width) {
    std::fill(row + width, row + width + margin, row[width - 1]);
  }
}

RidgeRow row_of(const RidgeMaps& maps, int y, int width) {
  const auto first = static_cast<std::ptrdiff_t>(y) * width;
  const bool with_direction = !maps.scale_px.empty();
  return {maps.vesselness.data() + first, with_direction ? maps.scale_px.data() + first : nullptr,
          with_direction ? maps.double_angle_cos.data() + first : nullptr,
          with_direction ? maps.double_angle_sin.data() + first : nullptr};
}

}  // namespace

FrangiFilter::FrangiFilter(int width, int height, const FrangiSettings& settings, FrangiMemory memory)
    : width_(checked_size(width)),
      height_(checked_size(height)),
      polarity_(first_polarity(settings.polarity) == RidgePolarity::kDark ? 1.0F : -1.0F),
      per_blob_(static_cast<float>(-0.5 / (settings.beta * settings.beta)) * kLog2E),
      fixed_c_(settings.structureness > 0),
      any_integer_scale_(
          std::any_of(settings.scales_px.begin(), settings.scales_px.end(),
                      [&](double sigma) { return suits_integers(sigma, settings.smoothing); })),
      any_float_scale_(!std::all_of(settings.scales_px.begin(), settings.scales_px.end(),
                                    [&](double sigma) { return suits_integers(sigma, settings.smoothing); })),
      keeps_whole_image_(memory == FrangiMemory::kWholeImage),
      cells_(width, height),
      measured_cells_(width, height),
      margin_(max_reach(settings.scales_px) + 1),
      source_(width, height, margin_),
      source_words_(width, any_integer_scale_ ? height : 1, margin_),
      between_(width, 1, margin_),
      between_words_(width, 1, margin_),
      smoothed_(width, keeps_whole_image_ ? height + 2 : kStreamedRows, margin_),
      column_norms_(static_cast<std::size_t>(width)),
      loaded_(static_cast<std::size_t>(height)),
      rows_(static_cast<std::size_t>(2 * margin_)),
      word_rows_(rows_.size()) {
  for (const double sigma : settings.scales_px) {
    const std::vector<float> weights = gaussian_weights(sigma);
    scales_.push_back({static_cast<float>(sigma), reach_of(sigma), suits_integers(sigma, settings.smoothing),
                       weights, pair_weights(weights), static_cast<float>(settings.structureness),
                       CellNorms(cells_)});
  }
  rectangles_.reserve(static_cast<std::size_t>(cells_.cell_count()));
}

PixelRectangle FrangiFilter::usable(const PixelRectangle& tile) const {
  PixelRectangle part = clipped(tile, whole());
  if (part.width() > 0 && part.width() < kMinSize) {
    part.left = std::min(part.left, width_ - kMinSize);
    part.right = part.left + kMinSize;
  }
  return part;
}

ResponseScale FrangiFilter::response_of(const Scale& scale) const {
  const float gain = in_integers(scale) ? static_cast<float>(1 << shift_) : 1.0F;
  return {.sigma_px = scale.sigma_px,
          .variance = polarity_ * scale.sigma_px * scale.sigma_px / gain,
          .per_blob = per_blob_,
          .per_norm = -kLog2E / (scale.c * scale.c),
          .first = &scale == scales_.data()};
}

// Pixels of 16 bits are shifted up as far as the image allows: detectors of 12 bits use all 16 of the
// smoothing.
void FrangiFilter::choose_gain(const GreyPixels& grey) {
  integer_image_ = !std::holds_alternative<std::span<const float>>(grey.depths());
  shift_ = 8;
  if (const auto* words = std::get_if<std::span<const std::uint16_t>>(&grey.depths())) {
    shift_ = std::min(std::countl_zero(static_cast<std::uint16_t>(bits_in_use(*words))), 15);
  }
  if (const auto* numbers = std::get_if<GreyPixels::WholeNumbers>(&grey.depths())) {
    const auto brightest = static_cast<std::uint16_t>(numbers->brightest);
    shift_ = std::min(std::countl_zero(brightest), 15);
  }
}

void FrangiFilter::begin_image(const GreyPixels& grey) {
  choose_gain(grey);
  std::fill(loaded_.begin(), loaded_.end(), RowPart{});
}

template <typename Pixel>
void FrangiFilter::load_row_of(const Pixel* grey, int y, const RowPart& part, bool whole_numbers) {
  const Pixel* from = grey + static_cast<std::ptrdiff_t>(y) * width_ + part.left;
  const int count = part.right - part.left;
  if (any_integer_scale_ && whole_numbers) {
    std::uint16_t* row = source_words_.row(y);
    convert_row(from, count, shift_, row + part.left);
    repeat_outermost(row, width_, margin_, part.left, part.right);
  }
  if (any_float_scale_ || !whole_numbers) {
    float* row = source_.row(y);
    convert_row(from, count, row + part.left);
    repeat_outermost(row, width_, margin_, part.left, part.right);
  }
}

void FrangiFilter::load_row(const GreyPixels& grey, int y, const RowPart& part) {
  if (part.left >= part.right) {
    return;
  }
  std::visit(
      [&](const auto& pixels) {
        if constexpr (std::is_same_v<std::decay_t<decltype(pixels)>, GreyPixels::WholeNumbers>) {
          load_row_of(pixels.pixels.data(), y, part, true);
        } else {
          load_row_of(pixels.data(), y, part, integer_image_);
        }
      },
      grey.depths());
}

// Brings the pixels of `part` and what the kernels reach beyond it into the padded source, where they are not
// there yet. What is there of a row stays one piece.
void FrangiFilter::load(const GreyPixels& grey, const PixelRectangle& part) {
  const PixelRectangle read = clipped(
      {part.left - margin_, part.top - margin_, part.right + margin_, part.bottom + margin_}, whole());
  for (int y = read.top; y < read.bottom; ++y) {
    RowPart& loaded = loaded_[static_cast<std::size_t>(y)];
    if (loaded.left >= loaded.right) {
      load_row(grey, y, {read.left, read.right});
      loaded = {read.left, read.right};
    } else {
      load_row(grey, y, {read.left, loaded.left});
      load_row(grey, y, {loaded.right, read.right});
      loaded = {std::min(loaded.left, read.left), std::max(loaded.right, read.right)};
    }
  }
}

// Columns begin .. end - 1 of row y, -1 .. height, into `out`.
void FrangiFilter::smooth(const Scale& scale, int y, int begin, int end, float* out) {
  const GaussianTaps taps{scale.reach, scale.weights.data(), scale.pairs.data()};
  const auto rows = static_cast<std::size_t>(2 * scale.reach + 1);
  const bool integers = in_integers(scale);
  for (std::size_t i = 0; i < rows; ++i) {
    const int source_y = std::clamp(y - scale.reach + static_cast<int>(i), 0, height_ - 1);
    if (integers) {
      word_rows_[i] = source_words_.row(source_y);
    } else {
      rows_[i] = source_.row(source_y);
    }
  }
  if (integers) {
    smooth_row(SmoothIntegerRow{taps, word_rows_.data(), between_words_.row(0), out, begin, end});
  } else {
    smooth_row(SmoothFloatRow{taps, rows_.data(), between_.row(0), out, begin, end});
  }
}

// Smoothed rows live no longer than the three that the Hessian needs.
void FrangiFilter::stream(const Scale& scale, const PixelRectangle& block, const RidgeMaps& maps) {
  const ResponseScale response = response_of(scale);
  const auto ring = [this](int y) { return smoothed_.row((y + 1) & (kStreamedRows - 1)); };
  for (int y = block.top - 1; y <= block.bottom; ++y) {
    smooth(scale, y, block.left - 1, block.right + 1, ring(y));
    if (y > block.top) {
      respond({ring(y - 2), ring(y - 1), ring(y), block.left, block.right}, response,
              row_of(maps, y - 1, width_));
    }
  }
}

// Smooths the whole image into smoothed_ and takes half the greatest Hessian norm as c.
void FrangiFilter::find_structureness(Scale& scale) {
  float greatest = 0;
  for_each_block(whole(), [&](const PixelRectangle& block) {
    const int first = block.top == 0 ? -1 : block.top + 1;  // the block above has smoothed two of these rows
    for (int y = first; y <= block.bottom; ++y) {
      smooth(scale, y, block.left - 1, block.right + 1, smoothed_.row(y + 1));
    }
    for (int y = block.top; y < block.bottom; ++y) {
      greatest = std::max(greatest, max_squared_norm({smoothed_.row(y), smoothed_.row(y + 1),
                                                      smoothed_.row(y + 2), block.left, block.right}));
    }
  });
  scale.c = structureness_of(norm_of(greatest, response_of(scale)));
}

void FrangiFilter::set_structureness(std::span<const float> c) {
  for (std::size_t i = 0; i < scales_.size(); ++i) {
    scales_[i].c = c[i];
  }
}

void FrangiFilter::respond_everywhere(const Scale& scale, const RidgeMaps& maps) {
  const ResponseScale response = response_of(scale);
  for (int y = 0; y < height_; ++y) {
    respond({smoothed_.row(y), smoothed_.row(y + 1), smoothed_.row(y + 2), 0, width_}, response,
            row_of(maps, y, width_));
  }
}

void FrangiFilter::stream_scales(const PixelRectangle& part, const RidgeMaps& maps) {
  for_each_block(part, [&](const PixelRectangle& block) {
    for (const Scale& scale : scales_) {
      stream(scale, block, maps);
    }
  });
}

void FrangiFilter::filter(const GreyPixels& grey, const RidgeMaps& maps) {
  begin_image(grey);
  load(grey, whole());
  if (!fixed_c_ && keeps_whole_image_) {
    for (Scale& scale : scales_) {
      find_structureness(scale);
      respond_everywhere(scale, maps);
    }
    return;
  }
  if (!fixed_c_) {
    find_structureness_in_cells(grey);
  }
  stream_scales(whole(), maps);
}

void FrangiFilter::filter_tiles(const GreyPixels& grey, std::span<const PixelRectangle> tiles,
                                const RidgeMaps& maps) {
  begin_image(grey);
  if (scales_.front().c == 0) {
    find_structureness_in_cells(grey);
  }
  for (const PixelRectangle& tile : tiles) {
    const PixelRectangle part = usable(tile);
    if (part.width() > 0 && part.height() > 0) {
      load(grey, part);
      stream_scales(part, maps);
    }
  }
}

}  // namespace tubed
