// "Are you still where you were?", asked of overlapping blocks of a picture against a key picture.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "daemon/image/view_picture.hpp"

namespace tubed {

/// Blocks of 32 x 32 reduced pixels every 16.
class BlockGrid {
 public:
  static constexpr Eigen::Index kSide = 32;
  static constexpr Eigen::Index kStep = 16;

  BlockGrid() = default;
  BlockGrid(Eigen::Index rows, Eigen::Index columns)
      : down_((rows - kSide) / kStep + 1), across_((columns - kSide) / kStep + 1) {}

  [[nodiscard]] Eigen::Index count() const { return down_ * across_; }
  [[nodiscard]] Eigen::Index row(Eigen::Index block) const { return block / across_ * kStep; }
  [[nodiscard]] Eigen::Index column(Eigen::Index block) const { return block % across_ * kStep; }

 private:
  Eigen::Index down_ = 0;
  Eigen::Index across_ = 0;
};

/// The blocks of one picture, weighted by a Hann window, for comparisons with several keys. One thread;
/// memory is taken in the constructor.
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
  using Block = Eigen::Array<float, BlockGrid::kSide, BlockGrid::kSide, Eigen::RowMajor>;

  BlockGrid grid_;
  Block window_;
  std::vector<Block> weighted_;  ///< window times texture
  std::vector<float> energy_;    ///< sum of window times texture squared
  std::vector<char> open_;
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

  void take(const ViewPicture& picture, const ViewBlocks& blocks);

  [[nodiscard]] const PixelGrid& texture() const { return texture_; }

  /// Fits each block C of `blocks` by least squares as a K + bx dK/dx + by dK/dy of this key's block K: to
  /// first order that is K shifted by -(bx, by) / a. It is still when the fit explains more than 0.4 of its
  /// energy and the shift is below 0.6 mm; it holds for shifts of less than about 1.5 mm, which is enough for
  /// the question. `mm_per_px`: of a reduced pixel, where the patient is.
  [[nodiscard]] StillBlocks compare(const ViewBlocks& blocks, double mm_per_px) const;

 private:
  PixelGrid texture_;
  PixelGrid slope_x_;
  PixelGrid slope_y_;
  std::vector<Eigen::Matrix3f> inverse_;  ///< of each block's normal equations
  std::vector<char> usable_;
};

}  // namespace tubed
