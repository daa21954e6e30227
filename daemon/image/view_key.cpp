#include "daemon/image/view_key.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace tubed {

namespace {

constexpr Eigen::Index kStep = BlockGrid::kStep;
constexpr int kMinOpenPixels = 922;  // of a block's 1024: nine tenths
constexpr double kMinExplained = 0.4;
constexpr double kMaxShift_mm = 0.6;
constexpr float kMinTexture = 0.25F;  // root mean square: below, a block shows nothing but a blade's noise
constexpr float kMinDeterminant = 1e-3F;
constexpr float kWindowSum = 256;                                 // of a Hann window of 32 x 32
constexpr float kPerUnit = 1.0F / (kTextureUnit * kTextureUnit);  // of products of textures
constexpr float kPerSlope = 0.5F;                                 // central differences are kept undivided

/// cos x across a cell, and as whole numbers of which 1 is 2^15.
struct Cosines {
  std::array<float, kStep> real;
  std::array<std::int16_t, kStep> whole;
  Cosines() {
    for (std::size_t i = 0; i < real.size(); ++i) {
      real[i] = static_cast<float>(std::cos(std::numbers::pi * (static_cast<double>(i) + 0.5) / kStep));
      whole[i] = static_cast<std::int16_t>(std::lround(32767 * static_cast<double>(real[i])));
    }
  }
};
const Cosines kCosines;

/// a b / 2^15, for |a| < 2^14.
std::int16_t times(std::int16_t a, std::int16_t b) {
  const auto twice = static_cast<std::int16_t>(2 * a);
  return static_cast<std::int16_t>((static_cast<int>(twice) * static_cast<int>(b)) >> 16);
}

std::int32_t dot(const std::int16_t* a, const std::int16_t* b, Eigen::Index count) {
  std::int32_t sum = 0;
  for (Eigen::Index i = 0; i < count; ++i) sum += static_cast<int>(a[i]) * static_cast<int>(b[i]);
  return sum;
}

/// Sum over the block whose upper left cell is `first`. `of(cell)`: CellSums of that cell.
template <typename OfCell>
float windowed(const BlockGrid& grid, Eigen::Index first, const OfCell& of) {
  float sum = 0;
  for (const int down : {0, 1}) {
    for (const int right : {0, 1}) {
      const auto& cell = of(static_cast<std::size_t>(first + down * grid.cells_across() + right));
      const auto x = static_cast<float>(2 * right - 1);
      const auto y = static_cast<float>(2 * down - 1);
      sum += static_cast<float>(cell[0]) + x * static_cast<float>(cell[1]) + y * static_cast<float>(cell[2]) +
             x * y * static_cast<float>(cell[3]);
    }
  }
  return sum / 4;
}

}  // namespace

struct ViewKey::Cell {
  using Pixels = std::array<std::int16_t, kStep * kStep>;
  Pixels texture, slope_x, slope_y;
};

ViewBlocks::ViewBlocks(Eigen::Index rows, Eigen::Index columns)
    : grid_(rows, columns),
      energies_(static_cast<std::size_t>(grid_.cells_down() * grid_.cells_across())),
      open_pixels_(energies_.size()),
      energy_(static_cast<std::size_t>(grid_.count())),
      open_(energy_.size()) {
  for (auto& weighted : weighted_) weighted.resize(energies_.size() * kCell);
}

void ViewBlocks::take(const ViewPicture& picture) {
  weigh_cells(picture.texture);
  for (std::size_t cell = 0; cell < energies_.size(); ++cell) {
    const auto first = static_cast<std::ptrdiff_t>(cell) * kCell;
    for (std::size_t k = 0; k < 4; ++k) {
      energies_[cell][k] = dot(weighted_[k].data() + first, weighted_[0].data() + first, kCell);
    }
    const Eigen::Index row = static_cast<Eigen::Index>(cell) / grid_.cells_across() * kStep;
    const Eigen::Index column = static_cast<Eigen::Index>(cell) % grid_.cells_across() * kStep;
    int open = 0;
    for (Eigen::Index y = 0; y < kStep; ++y) {
      const std::uint8_t* const pixels = &picture.open(row + y, column);
      for (Eigen::Index x = 0; x < kStep; ++x) open += pixels[x];
    }
    open_pixels_[cell] = open;
  }
  for (Eigen::Index block = 0; block < grid_.count(); ++block) {
    const auto index = static_cast<std::size_t>(block);
    const Eigen::Index first = grid_.first_cell(block);
    energy_[index] = kPerUnit * windowed(grid_, first, [this](std::size_t cell) { return energies_[cell]; });
    const auto cell = static_cast<std::size_t>(first);
    const std::size_t below = cell + static_cast<std::size_t>(grid_.cells_across());
    const int open =
        open_pixels_[cell] + open_pixels_[cell + 1] + open_pixels_[below] + open_pixels_[below + 1];
    open_[index] = open >= kMinOpenPixels && energy_[index] >= kMinTexture * kMinTexture * kWindowSum ? 1 : 0;
  }
}

void ViewBlocks::weigh_cells(const TextureGrid& texture) {
  Eigen::Index at = 0;
  for (Eigen::Index row = 0; row < grid_.cells_down() * kStep; row += kStep) {
    for (Eigen::Index column = 0; column < grid_.cells_across() * kStep; column += kStep) {
      for (std::size_t y = 0; y < kStep; ++y, at += kStep) {
        const std::int16_t* const from = &texture(row + static_cast<Eigen::Index>(y), column);
        const std::int16_t cos_y = kCosines.whole[y];
        std::array<std::int16_t, kStep> by_x;
        for (std::size_t x = 0; x < kStep; ++x) by_x[x] = times(from[x], kCosines.whole[x]);
        std::copy_n(from, kStep, weighted_[0].data() + at);
        std::copy_n(by_x.data(), kStep, weighted_[1].data() + at);
        std::int16_t* const by_y = weighted_[2].data() + at;
        for (std::size_t x = 0; x < kStep; ++x) by_y[x] = times(from[x], cos_y);
        std::int16_t* const by_both = weighted_[3].data() + at;
        for (std::size_t x = 0; x < kStep; ++x) by_both[x] = times(by_x[x], cos_y);
      }
    }
  }
}

int ViewBlocks::open_count() const {
  int count = 0;
  for (const char open : open_) count += open;
  return count;
}

ViewKey::ViewKey(Eigen::Index rows, Eigen::Index columns) : texture_(TextureGrid::Zero(rows, columns)) {
  const BlockGrid grid(rows, columns);
  projections_.resize(static_cast<std::size_t>(grid.cells_down() * grid.cells_across()));
  slope_products_.resize(projections_.size());
  inverse_.resize(static_cast<std::size_t>(grid.count()));
  usable_.resize(inverse_.size());
}

void ViewKey::take(const ViewPicture& picture, const ViewBlocks& blocks) {
  texture_ = picture.texture;
  const BlockGrid& grid = blocks.grid_;
  project(blocks);
  multiply_slopes(grid);
  for (Eigen::Index block = 0; block < grid.count(); ++block) {
    const auto index = static_cast<std::size_t>(block);
    const auto slopes = [&](std::size_t which) {
      return kPerUnit * kPerSlope * kPerSlope * windowed(grid, grid.first_cell(block), [&](std::size_t cell) {
               return slope_products_[cell][which];
             });
    };
    // N = sum of w (K, Kx, Ky)^T (K, Kx, Ky).
    Eigen::Matrix3f normal;
    normal.col(0) = projection(grid, block);
    normal.row(0) = normal.col(0).transpose();
    normal(1, 1) = slopes(0);
    normal(1, 2) = normal(2, 1) = slopes(1);
    normal(2, 2) = slopes(2);
    const float determinant = normal.determinant();
    usable_[index] = blocks.open_[index] != 0 && determinant > kMinDeterminant ? 1 : 0;
    if (usable_[index] != 0) inverse_[index] = normal.inverse();
  }
}

/// Central differences, undivided; at the border, which no block's window weighs, they are 0.
void ViewKey::read_cell(const BlockGrid& grid, Eigen::Index cell, Cell& to) const {
  const Eigen::Index row = cell / grid.cells_across() * kStep;
  const Eigen::Index column = cell % grid.cells_across() * kStep;
  const Eigen::Index columns = texture_.cols();
  for (Eigen::Index y = 0; y < kStep; ++y) {
    const std::int16_t* const from = &texture_(row + y, column);
    const bool has_both = row + y > 0 && row + y + 1 < texture_.rows();
    const std::int16_t* const above = has_both ? from - columns : from;
    const std::int16_t* const below = has_both ? from + columns : from;
    std::int16_t* const texture = &to.texture[static_cast<std::size_t>(y * kStep)];
    std::int16_t* const slope_x = &to.slope_x[static_cast<std::size_t>(y * kStep)];
    std::int16_t* const slope_y = &to.slope_y[static_cast<std::size_t>(y * kStep)];
    std::copy_n(from, kStep, texture);
    for (Eigen::Index x = 0; x < kStep; ++x) slope_y[x] = static_cast<std::int16_t>(below[x] - above[x]);
    const bool is_left = column == 0;
    const bool is_right = column + kStep == columns;
    if (!is_left && !is_right) {
      for (Eigen::Index x = 0; x < kStep; ++x) {
        slope_x[x] = static_cast<std::int16_t>(from[x + 1] - from[x - 1]);
      }
      continue;
    }
    for (Eigen::Index x = is_left ? 1 : 0; x < (is_right ? kStep - 1 : kStep); ++x) {
      slope_x[x] = static_cast<std::int16_t>(from[x + 1] - from[x - 1]);
    }
    (is_left ? slope_x[0] : slope_x[kStep - 1]) = 0;
  }
}

void ViewKey::project(const ViewBlocks& blocks) {
  Cell own;
  for (std::size_t cell = 0; cell < projections_.size(); ++cell) {
    read_cell(blocks.grid_, static_cast<Eigen::Index>(cell), own);
    for (std::size_t k = 0; k < 4; ++k) {
      const std::int16_t* const picture =
          blocks.weighted_[k].data() + static_cast<std::ptrdiff_t>(cell) * ViewBlocks::kCell;
      projections_[cell][0][k] = dot(picture, own.texture.data(), ViewBlocks::kCell);
      projections_[cell][1][k] = dot(picture, own.slope_x.data(), ViewBlocks::kCell);
      projections_[cell][2][k] = dot(picture, own.slope_y.data(), ViewBlocks::kCell);
    }
  }
}

Eigen::Vector3f ViewKey::projection(const BlockGrid& grid, Eigen::Index block) const {
  const auto of = [&](std::size_t which) {
    return kPerUnit * windowed(grid, grid.first_cell(block),
                               [&](std::size_t cell) { return projections_[cell][which]; });
  };
  return {of(0), kPerSlope * of(1), kPerSlope * of(2)};
}

void ViewKey::multiply_slopes(const BlockGrid& grid) {
  Cell own;
  for (std::size_t cell = 0; cell < slope_products_.size(); ++cell) {
    read_cell(grid, static_cast<Eigen::Index>(cell), own);
    SlopeProducts& products = slope_products_[cell];
    products = {};
    for (std::size_t x = 0; x < kStep; ++x) {
      SlopeProducts of_column{};
      for (std::size_t y = 0; y < kStep; ++y) {
        const auto slope_x = static_cast<float>(own.slope_x[y * kStep + x]);
        const auto slope_y = static_cast<float>(own.slope_y[y * kStep + x]);
        const std::array<float, 3> product{slope_x * slope_x, slope_x * slope_y, slope_y * slope_y};
        for (std::size_t k = 0; k < 3; ++k) {
          of_column[k][0] += product[k];
          of_column[k][2] += kCosines.real[y] * product[k];
        }
      }
      for (std::size_t k = 0; k < 3; ++k) {
        products[k][0] += of_column[k][0];
        products[k][1] += kCosines.real[x] * of_column[k][0];
        products[k][2] += of_column[k][2];
        products[k][3] += kCosines.real[x] * of_column[k][2];
      }
    }
  }
}

StillBlocks ViewKey::compare(const ViewBlocks& blocks, double mm_per_px) {
  StillBlocks result;
  project(blocks);
  for (std::size_t block = 0; block < usable_.size(); ++block) {
    result.of_key += usable_[block];
    if (usable_[block] == 0 || blocks.open_[block] == 0) continue;
    ++result.compared;
    const Eigen::Vector3f projected = projection(blocks.grid_, static_cast<Eigen::Index>(block));
    const Eigen::Vector3f fit = inverse_[block] * projected;  // a, bx, by
    const double explained =
        static_cast<double>(projected.dot(fit)) / std::max(1e-6, static_cast<double>(blocks.energy_[block]));
    const double shift_mm = mm_per_px * std::hypot(fit[1], fit[2]) / std::max(1e-6F, fit[0]);
    result.still += fit[0] > 0 && explained > kMinExplained && shift_mm < kMaxShift_mm ? 1 : 0;
  }
  return result;
}

}  // namespace tubed
