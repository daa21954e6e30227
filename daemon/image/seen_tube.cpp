#include "daemon/image/seen_tube.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace tubed {

namespace {
constexpr int kLinesAround = 2;
}

void SeenTube::record(std::span<const CorrespondenceLine> lines, double spacing_mm) {
  count_ = static_cast<int>(std::min<std::size_t>(lines.size(), kMaxCorrespondenceLines));
  spacing_mm_ = spacing_mm;
  for (std::size_t i = 0; i < static_cast<std::size_t>(count_); ++i) {
    agreeing_[i] = lines[i].in_view && lines[i].agrees;
  }
}

bool SeenTube::at(double s_mm) const {
  const double place = std::clamp(s_mm / spacing_mm_, 0.0, std::max(count_ - 1, 0) * 1.0);
  const int here = static_cast<int>(std::lround(place));
  const int first = std::max(here - kLinesAround, 0);
  const int last = std::min(here + kLinesAround, count_ - 1);
  int agreeing = 0;
  for (int i = first; i <= last; ++i) {
    agreeing += agreeing_[static_cast<std::size_t>(i)] ? 1 : 0;
  }
  return 2 * agreeing > last - first + 1;
}

}  // namespace tubed
