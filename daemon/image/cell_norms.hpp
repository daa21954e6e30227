// The greatest Hessian norm of an image, from few of its cells.
#pragma once

#include <cstddef>
#include <vector>

#include "daemon/image/image_area.hpp"

namespace tubed {

/// The newest greatest Hessian norm of each cell of a camera's images, of one scale. What was greatest in the
/// image before is most likely near there in this one: so the greatest norm of an image is found by measuring
/// the cells of the greatest norms again until the greatest of all is of this image. A value of its filter's
/// thread; memory is taken in the constructor.
class CellNorms {
 public:
  explicit CellNorms(const ImageArea& area) : norms_(static_cast<std::size_t>(area.cell_count()), 0.0F) {}

  void set(std::size_t cell, float norm) { norms_[cell] = norm; }

  /// Of all cells, of whatever image. Grey levels.
  [[nodiscard]] float greatest() const;

  /// Adds to `area` the cells that have to be measured to know the greatest norm of this image, those around
  /// them, and none of `measured`, which have been. Nothing when it is known.
  void add_doubtful(const ImageArea& measured, ImageArea& area) const;

 private:
  std::vector<float> norms_;
};

}  // namespace tubed
