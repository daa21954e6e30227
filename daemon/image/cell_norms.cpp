#include "daemon/image/cell_norms.hpp"

#include <algorithm>

namespace tubed {

namespace {

// Of the greatest norm: cells above it are measured with it, mostly the tube's, whichever becomes the
// greatest next. With 0.9, c was far below that of the whole image where a short stretch stood out and went.
constexpr float kNearMax = 0.55F;

}  // namespace

float CellNorms::greatest() const { return *std::max_element(norms_.begin(), norms_.end()); }

void CellNorms::add_doubtful(const ImageArea& measured, ImageArea& area) const {
  const auto greatest = std::max_element(norms_.begin(), norms_.end());
  if (!measured.holds_cell(static_cast<std::size_t>(greatest - norms_.begin()))) {
    for (std::size_t cell = 0; cell < norms_.size(); ++cell) {
      if (norms_[cell] >= kNearMax * *greatest && !measured.holds_cell(cell)) {
        area.add_neighbourhood(cell);
      }
    }
  }
  area.remove(measured);
}

}  // namespace tubed
