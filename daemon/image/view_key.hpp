// "Are you still where you were?", asked of overlapping blocks of a picture against a key picture.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "daemon/image/view_picture.hpp"

namespace tubed {

/// Blocks of 32 x 32 reduced pixels every 16: each of 2 x 2 cells of 16 x 16, which four blocks share.
class BlockGrid {
 public:
  static constexpr Eigen::Index kSide = 32;
  static constexpr Eigen::Index kStep = 16;

  BlockGrid() = default;
  BlockGrid(Eigen::Index rows, Eigen::Index columns)
      : down_((rows - kSide) / kStep + 1), across_((columns - kSide) / kStep + 1) {}

  [[nodiscard]] Eigen::Index count() const { return down_ * across_; }
  [[nodiscard]] Eigen::Index cells_down() const { return down_ + 1; }
  [[nodiscard]] Eigen::Index cells_across() const { return across_ + 1; }
  /// The cell at the upper left of a block, counted row by row.
  [[nodiscard]] Eigen::Index first_cell(Eigen::Index block) const {
    return block / across_ * (across_ + 1) + block % across_;
  }

 private:
  Eigen::Index down_ = 0;
  Eigen::Index across_ = 0;
};

/// Sums over a cell of a product with 1, cos x, cos y and cos x cos y, where x and y go from 0 to pi across
/// the cell. A block's Hann window is (1 +- cos x) (1 +- cos y) / 4 in each of its cells, so its sums follow
/// from those of the cells.
template <typename Number>
using CellSums = std::array<Number, 4>;

/// The blocks of one picture, for comparisons with several keys. One thread; memory is taken in the
/// constructor.
class ViewBlocks {
 public:
  /// For pictures of that size.
  ViewBlocks(Eigen::Index rows, Eigen::Index columns);

  void take(const ViewPicture& picture);

  [[nodiscard]] const BlockGrid& grid() const { return grid_; }
  /// Blocks of which at least nine tenths are open, and that have a texture.
  [[nodiscard]] int open_count() const;

 private:
  friend class ViewKey;
  static constexpr Eigen::Index kCell = BlockGrid::kStep * BlockGrid::kStep;  ///< px

  void weigh_cells(const TextureGrid& texture);

  BlockGrid grid_;
  std::array<std::vector<std::int16_t>, 4> weighted_;  ///< texture as CellSums weigh it, cell by cell
  std::vector<CellSums<std::int32_t>> energies_;       ///< of each cell: texture times texture
  std::vector<int> open_pixels_;                       ///< of each cell
  std::vector<float> energy_;                          ///< of each block: sum of window times texture squared
  std::vector<char> open_;                             ///< of each block
};

/// How many blocks are still where they were in a key.
struct StillBlocks {
  int still = 0;
  int compared = 0;  ///< open in both
  int of_key = 0;    ///< open in the key

  /// S: share of the compared blocks; 0 when none was compared.
  [[nodiscard]] double share() const { return compared == 0 ? 0 : static_cast<double>(still) / compared; }
};

/// A picture to compare with. One thread; memory is taken in the constructor.
class ViewKey {
 public:
  ViewKey(Eigen::Index rows, Eigen::Index columns);

  /// `blocks`: of that picture.
  void take(const ViewPicture& picture, const ViewBlocks& blocks);

  [[nodiscard]] const TextureGrid& texture() const { return texture_; }

  /// Fits each block C of `blocks` by least squares as a K + bx dK/dx + by dK/dy of this key's block K: to
  /// first order that is K shifted by -(bx, by) / a. It is still when the fit explains more than 0.4 of its
  /// energy and the shift is below 0.6 mm; it holds for shifts of less than about 1.5 mm, which is enough for
  /// the question. `mm_per_px`: of a reduced pixel, where the patient is.
  [[nodiscard]] StillBlocks compare(const ViewBlocks& blocks, double mm_per_px);

 private:
  /// This key's texture and its slopes along x and y, each of one cell.
  struct Cell;
  /// Products of the picture with texture, slope along x, slope along y.
  using Projections = std::array<CellSums<std::int32_t>, 3>;
  /// Products of the slopes: x x, x y, y y.
  using SlopeProducts = std::array<CellSums<float>, 3>;

  void read_cell(const BlockGrid& grid, Eigen::Index cell, Cell& to) const;
  void project(const ViewBlocks& blocks);
  void multiply_slopes(const BlockGrid& grid);
  [[nodiscard]] Eigen::Vector3f projection(const BlockGrid& grid, Eigen::Index block) const;

  TextureGrid texture_;
  std::vector<Projections> projections_;       ///< of each cell, by project()
  std::vector<SlopeProducts> slope_products_;  ///< of each cell, by multiply_slopes()
  std::vector<Eigen::Matrix3f> inverse_;       ///< of each block's normal equations
  std::vector<char> usable_;
};

}  // namespace tubed
