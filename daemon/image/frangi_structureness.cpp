// c of structureness 0, where no whole image is filtered: from cells.
#include <algorithm>
#include <cmath>

#include "daemon/image/frangi.hpp"

namespace tubed {

/// Hessian norm, grey levels, of its unscaled square.
float FrangiFilter::norm_of(float squared, const ResponseScale& response) {
  return std::abs(response.variance) * std::sqrt(squared);
}

float FrangiFilter::structureness_of(float max_norm) { return std::max(0.5F * max_norm, 1e-6F); }

// Of cells side by side, without keeping what is smoothed. The outermost cell may be narrower than a
// register.
void FrangiFilter::measure_cell_norms(Scale& scale, const PixelRectangle& row_of_cells) {
  const PixelRectangle part = usable(row_of_cells);
  const auto ring = [this](int y) { return smoothed_.row((y + 1) & (kStreamedRows - 1)); };
  std::fill(column_norms_.begin() + part.left, column_norms_.begin() + part.right, 0.0F);
  for (int y = part.top - 1; y <= part.bottom; ++y) {
    smooth(scale, y, part.left - 1, part.right + 1, ring(y));
    if (y > part.top) {
      keep_max_squared_norms({ring(y - 2), ring(y - 1), ring(y), part.left, part.right},
                             column_norms_.data());
    }
  }
  const ResponseScale response = response_of(scale);
  for (int left = row_of_cells.left; left < row_of_cells.right; left += ImageArea::kCell_px) {
    const auto first = column_norms_.begin() + left;
    const auto last = column_norms_.begin() + std::min(left + ImageArea::kCell_px, row_of_cells.right);
    scale.norms.set(cells_.index_of_pixel(left, row_of_cells.top),
                    norm_of(*std::max_element(first, last), response));
  }
}

// Of all cells in cells_.
void FrangiFilter::measure_cell_norms(const GreyPixels& grey, Scale& scale) {
  cells_.to_rectangles(rectangles_);
  for (const PixelRectangle& rectangle : rectangles_) {
    load(grey, usable(rectangle));
    for (int top = rectangle.top; top < rectangle.bottom; top += ImageArea::kCell_px) {
      const int bottom = std::min(top + ImageArea::kCell_px, rectangle.bottom);
      measure_cell_norms(scale, {rectangle.left, top, rectangle.right, bottom});
    }
  }
}

void FrangiFilter::find_structureness_in_cells(const GreyPixels& grey) {
  cells_.add_whole();
  for (Scale& scale : scales_) {
    measure_cell_norms(grey, scale);
    scale.c = structureness_of(scale.norms.greatest());
  }
  next_slice_ = 0;
}

void FrangiFilter::find_structureness_near_greatest(const GreyPixels& grey, Scale& scale) {
  measured_cells_.clear();
  cells_.clear();
  cells_.add_slice(next_slice_, kSlices);
  scale.norms.add_doubtful(measured_cells_, cells_);
  while (!cells_.empty()) {
    measure_cell_norms(grey, scale);
    measured_cells_.add(cells_);
    cells_.clear();
    scale.norms.add_doubtful(measured_cells_, cells_);
  }
  scale.c = structureness_of(scale.norms.greatest());
}

void FrangiFilter::renew_structureness(const GreyPixels& grey) {
  if (fixed_c_) {
    return;
  }
  begin_image(grey);
  if (next_slice_ < 0) {
    find_structureness_in_cells(grey);
    return;
  }
  for (Scale& scale : scales_) {
    find_structureness_near_greatest(grey, scale);
  }
  next_slice_ = (next_slice_ + 1) % kSlices;
}

}  // namespace tubed
