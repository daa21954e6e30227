#include "daemon/image/view_key.hpp"

#include <Eigen/LU>
#include <cmath>
#include <numbers>

namespace tubed {

namespace {

constexpr float kMinOpenShare = 0.9F;
constexpr double kMinExplained = 0.4;
constexpr double kMaxShift_mm = 0.6;
constexpr float kMinTexture = 0.25F;  // root mean square: below, a block shows nothing but a blade's noise
constexpr float kMinDeterminant = 1e-3F;

}  // namespace

ViewBlocks::ViewBlocks(Eigen::Index rows, Eigen::Index columns)
    : grid_(rows, columns),
      weighted_(static_cast<std::size_t>(grid_.count())),
      energy_(weighted_.size()),
      open_(weighted_.size()) {
  Eigen::Array<float, BlockGrid::kSide, 1> hann;
  for (Eigen::Index i = 0; i < BlockGrid::kSide; ++i) {
    const double phase = 2 * std::numbers::pi * (static_cast<double>(i) + 0.5) / BlockGrid::kSide;
    hann[i] = static_cast<float>(0.5 - 0.5 * std::cos(phase));
  }
  window_ = (hann.matrix() * hann.matrix().transpose()).array();
}

void ViewBlocks::take(const ViewPicture& picture) {
  constexpr Eigen::Index kSide = BlockGrid::kSide;
  for (Eigen::Index block = 0; block < grid_.count(); ++block) {
    const auto index = static_cast<std::size_t>(block);
    const auto texture = picture.texture.block<kSide, kSide>(grid_.row(block), grid_.column(block));
    weighted_[index] = window_ * texture;
    energy_[index] = (weighted_[index] * texture).sum();
    const bool is_open =
        picture.open.block<kSide, kSide>(grid_.row(block), grid_.column(block)).mean() >= kMinOpenShare;
    open_[index] = is_open && energy_[index] >= kMinTexture * kMinTexture * window_.sum() ? 1 : 0;
  }
}

int ViewBlocks::open_count() const {
  int count = 0;
  for (const char open : open_) count += open;
  return count;
}

ViewKey::ViewKey(Eigen::Index rows, Eigen::Index columns)
    : texture_(PixelGrid::Zero(rows, columns)), slope_x_(texture_), slope_y_(texture_) {
  const BlockGrid grid(rows, columns);
  inverse_.resize(static_cast<std::size_t>(grid.count()));
  usable_.resize(inverse_.size());
}

void ViewKey::take(const ViewPicture& picture, const ViewBlocks& blocks) {
  constexpr Eigen::Index kSide = BlockGrid::kSide;
  const Eigen::Index rows = picture.texture.rows();
  const Eigen::Index columns = picture.texture.cols();
  texture_ = picture.texture;
  // Central differences; the border, which no block's window weighs, keeps 0.
  slope_x_.middleCols(1, columns - 2) =
      (texture_.rightCols(columns - 2) - texture_.leftCols(columns - 2)) / 2;
  slope_y_.middleRows(1, rows - 2) = (texture_.bottomRows(rows - 2) - texture_.topRows(rows - 2)) / 2;
  for (Eigen::Index block = 0; block < blocks.grid_.count(); ++block) {
    const auto index = static_cast<std::size_t>(block);
    const Eigen::Index row = blocks.grid_.row(block);
    const Eigen::Index column = blocks.grid_.column(block);
    const auto x = slope_x_.block<kSide, kSide>(row, column);
    const auto y = slope_y_.block<kSide, kSide>(row, column);
    const auto& weighted = blocks.weighted_[index];
    // N = sum of w (K, Kx, Ky)^T (K, Kx, Ky).
    Eigen::Matrix3f normal;
    normal(0, 0) = blocks.energy_[index];
    normal(0, 1) = normal(1, 0) = (weighted * x).sum();
    normal(0, 2) = normal(2, 0) = (weighted * y).sum();
    normal(1, 1) = (blocks.window_ * x * x).sum();
    normal(1, 2) = normal(2, 1) = (blocks.window_ * x * y).sum();
    normal(2, 2) = (blocks.window_ * y * y).sum();
    const float determinant = normal.determinant();
    usable_[index] = blocks.open_[index] != 0 && determinant > kMinDeterminant ? 1 : 0;
    if (usable_[index] != 0) inverse_[index] = normal.inverse();
  }
}

StillBlocks ViewKey::compare(const ViewBlocks& blocks, double mm_per_px) const {
  constexpr Eigen::Index kSide = BlockGrid::kSide;
  StillBlocks result;
  for (Eigen::Index block = 0; block < blocks.grid_.count(); ++block) {
    const auto index = static_cast<std::size_t>(block);
    result.of_key += usable_[index];
    if (usable_[index] == 0 || blocks.open_[index] == 0) continue;
    ++result.compared;
    const Eigen::Index row = blocks.grid_.row(block);
    const Eigen::Index column = blocks.grid_.column(block);
    const auto& weighted = blocks.weighted_[index];
    const Eigen::Vector3f projected((weighted * texture_.block<kSide, kSide>(row, column)).sum(),
                                    (weighted * slope_x_.block<kSide, kSide>(row, column)).sum(),
                                    (weighted * slope_y_.block<kSide, kSide>(row, column)).sum());
    const Eigen::Vector3f fit = inverse_[index] * projected;  // a, bx, by
    const double explained =
        static_cast<double>(projected.dot(fit)) / std::max(1e-6, static_cast<double>(blocks.energy_[index]));
    const double shift_mm = mm_per_px * std::hypot(fit[1], fit[2]) / std::max(1e-6F, fit[0]);
    result.still += fit[0] > 0 && explained > kMinExplained && shift_mm < kMaxShift_mm ? 1 : 0;
  }
  return result;
}

}  // namespace tubed
