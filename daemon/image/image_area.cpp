#include "daemon/image/image_area.hpp"

#include <algorithm>
#include <cmath>

namespace tubed {

namespace {

int cells_over(int pixels) { return (pixels + ImageArea::kCell_px - 1) / ImageArea::kCell_px; }

/// Cell of a coordinate, clamped to -1 .. count.
int cell_of(double p_px, int count) {
  return static_cast<int>(
      std::clamp(std::floor(p_px / ImageArea::kCell_px), -1.0, static_cast<double>(count)));
}

}  // namespace

ImageArea::ImageArea(int width, int height)
    : width_(width),
      height_(height),
      columns_(cells_over(width)),
      rows_(cells_over(height)),
      cells_(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_), 0) {}

void ImageArea::clear() { std::fill(cells_.begin(), cells_.end(), std::uint8_t{0}); }

void ImageArea::add_whole() { std::fill(cells_.begin(), cells_.end(), std::uint8_t{1}); }

PixelRectangle ImageArea::cells_of(const Eigen::Vector2d& low_px, const Eigen::Vector2d& high_px) const {
  if (!low_px.allFinite() || !high_px.allFinite()) {
    return {};
  }
  return {std::max(cell_of(low_px.x(), columns_), 0), std::max(cell_of(low_px.y(), rows_), 0),
          std::min(cell_of(high_px.x(), columns_) + 1, columns_),
          std::min(cell_of(high_px.y(), rows_) + 1, rows_)};
}

void ImageArea::add_box(const Eigen::Vector2d& low_px, const Eigen::Vector2d& high_px) {
  const PixelRectangle box = cells_of(low_px, high_px);
  for (int row = box.top; row < box.bottom; ++row) {
    for (int column = box.left; column < box.right; ++column) {
      cells_[index_of(column, row)] = 1;
    }
  }
}

void ImageArea::add(const ImageArea& other) {
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    cells_[i] |= other.cells_[i];
  }
}

void ImageArea::remove(const ImageArea& other) {
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    cells_[i] = other.cells_[i] != 0 ? std::uint8_t{0} : cells_[i];
  }
}

void ImageArea::add_slice(int number, int count) {
  std::fill(cells_.begin() + static_cast<std::ptrdiff_t>(index_of(0, rows_ * number / count)),
            cells_.begin() + static_cast<std::ptrdiff_t>(index_of(0, rows_ * (number + 1) / count)),
            std::uint8_t{1});
}

void ImageArea::add_neighbourhood(std::size_t number) {
  const int column = static_cast<int>(number) % columns_;
  const int row = static_cast<int>(number) / columns_;
  for (int r = std::max(row - 1, 0); r <= std::min(row + 1, rows_ - 1); ++r) {
    for (int c = std::max(column - 1, 0); c <= std::min(column + 1, columns_ - 1); ++c) {
      cells_[index_of(c, r)] = 1;
    }
  }
}

bool ImageArea::empty() const {
  return std::all_of(cells_.begin(), cells_.end(), [](std::uint8_t cell) { return cell == 0; });
}

bool ImageArea::covers(const ImageArea& other) const {
  bool all = true;
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    all = all && cells_[i] >= other.cells_[i];
  }
  return all;
}

bool ImageArea::covers_box(const Eigen::Vector2d& low_px, const Eigen::Vector2d& high_px) const {
  const PixelRectangle box = cells_of(low_px, high_px);
  for (int row = box.top; row < box.bottom; ++row) {
    for (int column = box.left; column < box.right; ++column) {
      if (cells_[index_of(column, row)] == 0) {
        return false;
      }
    }
  }
  return true;
}

bool ImageArea::holds_pixel(std::size_t index) const {
  const auto width = static_cast<std::size_t>(width_);
  return cells_[index_of(static_cast<int>(index % width) / kCell_px,
                         static_cast<int>(index / width) / kCell_px)] != 0;
}

double ImageArea::share() const {
  return cells_.empty() ? 0
                        : static_cast<double>(std::count(cells_.begin(), cells_.end(), std::uint8_t{1})) /
                              static_cast<double>(cells_.size());
}

// A run of cells as wide as one right above it makes that rectangle higher.
void ImageArea::add_row(int row, std::vector<PixelRectangle>& rectangles) const {
  const int top = row * kCell_px;
  const int bottom = std::min(top + kCell_px, height_);
  const auto above_count = static_cast<std::ptrdiff_t>(rectangles.size());
  for (int column = 0; column < columns_; ++column) {
    if (cells_[index_of(column, row)] == 0) {
      continue;
    }
    const int first = column;
    while (column < columns_ && cells_[index_of(column, row)] != 0) {
      ++column;
    }
    const int left = first * kCell_px;
    const int right = std::min(column * kCell_px, width_);
    const auto end_above = rectangles.begin() + above_count;
    const auto above = std::find_if(rectangles.begin(), end_above, [&](const PixelRectangle& candidate) {
      return candidate.bottom == top && candidate.left == left && candidate.right == right;
    });
    if (above != end_above) {
      above->bottom = bottom;
    } else {
      rectangles.push_back({left, top, right, bottom});
    }
  }
}

void ImageArea::to_rectangles(std::vector<PixelRectangle>& rectangles) const {
  rectangles.clear();
  for (int row = 0; row < rows_; ++row) {
    add_row(row, rectangles);
  }
}

}  // namespace tubed
