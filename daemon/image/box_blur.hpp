// A wide blur that costs the same whatever its width.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace tubed {

/// Rows are image rows, so that a row is contiguous.
using PixelGrid = Eigen::Array<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Sums over a square window, three times one after another: nearly a Gaussian of standard deviation
/// `sigma_px`. Outside the grid is 0. Memory is taken in the constructor. One thread.
class BoxBlur {
 public:
  BoxBlur(Eigen::Index rows, Eigen::Index columns, double sigma_px);
  /// Blurs in place a grid of the size given above; the sum of all weights is 1.
  void apply(PixelGrid& values);

 private:
  /// Sixteen neighbouring columns, or rows, at once: what is summed lies in registers, what is read in the
  /// nearest cache.
  class Strip {
   public:
    static constexpr Eigen::Index kLanes = 16;
    Strip(Eigen::Index length, int radius);
    /// Place of the first lane, kLanes values for each step along the strip.
    float* values() { return even_.data() + before_; }
    /// Sums over windows of values(), three times. Returns where the sums are: as values().
    const float* blur();

   private:
    void sum_windows(const float* from, float* to) const;

    Eigen::Index length_;
    Eigen::Index radius_;
    Eigen::Index before_;            ///< zeros before the first value; radius_ steps of zeros follow the last
    std::vector<float> even_, odd_;  ///< of the passes
  };

  void blur_columns(PixelGrid& values, Eigen::Index first);
  void blur_rows(PixelGrid& values, Eigen::Index first);

  float share_;  ///< of a value in three windows
  Strip down_;
  Strip across_;
};

}  // namespace tubed
