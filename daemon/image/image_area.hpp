// Which parts of an image are meant.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "daemon/image/frangi_plane.hpp"

namespace tubed {

/// A set of cells of 16 x 16 px of one image size. A value: copying one onto another of the same size does
/// not allocate, nor does anything here but the constructor.
class ImageArea {
 public:
  static constexpr int kCell_px = 16;

  ImageArea() = default;
  /// No cell of an image of this size.
  ImageArea(int width, int height);

  void clear();
  void add_whole();
  /// All cells that pixels with `low` <= p <= `high` lie in. What lies outside the image is passed over.
  void add_box(const Eigen::Vector2d& low_px, const Eigen::Vector2d& high_px);
  /// Precondition of the following: areas of the same image size.
  void add(const ImageArea& other);
  void remove(const ImageArea& other);
  /// Part `number` of the image, 0 .. count - 1: rows of cells next to each other. A low image may have empty
  /// parts.
  void add_slice(int number, int count);
  /// Cell `number`, 0 .. cell_count() - 1, and those around it.
  void add_neighbourhood(std::size_t number);

  [[nodiscard]] bool empty() const;
  [[nodiscard]] bool covers(const ImageArea& other) const;
  /// All cells of add_box() with these corners.
  [[nodiscard]] bool covers_box(const Eigen::Vector2d& low_px, const Eigen::Vector2d& high_px) const;
  /// The pixel `index` of a row by row buffer.
  [[nodiscard]] bool holds_pixel(std::size_t index) const;
  /// Cell `number`, 0 .. cell_count() - 1.
  [[nodiscard]] bool holds_cell(std::size_t number) const { return cells_[number] != 0; }
  /// Share of the image's cells.
  [[nodiscard]] double share() const;
  /// Number of the cell a pixel lies in, 0 .. cell_count() - 1. Precondition: inside the image.
  [[nodiscard]] std::size_t index_of_pixel(int x, int y) const {
    return index_of(x / kCell_px, y / kCell_px);
  }
  [[nodiscard]] int cell_count() const { return static_cast<int>(cells_.size()); }

  /// Rectangles without overlap that make up the area, as wide as they can be. `rectangles` is cleared;
  /// with room for cell_count() of them nothing is allocated.
  void to_rectangles(std::vector<PixelRectangle>& rectangles) const;

  bool operator==(const ImageArea&) const = default;

 private:
  /// Cells left <= column < right, top <= row < bottom.
  [[nodiscard]] PixelRectangle cells_of(const Eigen::Vector2d& low_px, const Eigen::Vector2d& high_px) const;
  [[nodiscard]] std::size_t index_of(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(column);
  }
  void add_row(int row, std::vector<PixelRectangle>& rectangles) const;

  int width_ = 0;
  int height_ = 0;
  int columns_ = 0;
  int rows_ = 0;
  std::vector<std::uint8_t> cells_;  ///< row by row; 1: in the area
};

}  // namespace tubed
