#include "daemon/image/seen_tube.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace tubed {

namespace {

constexpr int kLinesAround = 2;
constexpr int kLinesAhead = 10;       // there is no gap before them if
constexpr int kMinAgreeingAhead = 7;  // so many of them agree
constexpr double kLost_mm = 30;       // of which most do not show a tube

}  // namespace

void SeenTube::record(std::span<const CorrespondenceLine> lines, double spacing_mm) {
  count_ = static_cast<int>(std::min<std::size_t>(lines.size(), kMaxCorrespondenceLines));
  spacing_mm_ = spacing_mm;
  for (std::size_t i = 0; i < static_cast<std::size_t>(count_); ++i) {
    in_view_[i] = lines[i].in_view;
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

SeenTube::Followed SeenTube::followed(double from_mm, Toward toward) const {
  const int step = toward == Toward::kTip ? -1 : 1;
  Followed followed{from_mm, from_mm};
  int line = static_cast<int>(std::lround(from_mm / spacing_mm_));
  for (; is_line(line); line += step) {
    const Stretch ahead = stretch(line, step, kLinesAhead);
    if (ahead.agreeing * kLinesAhead < kMinAgreeingAhead * ahead.lines) break;
    if (agreeing_[static_cast<std::size_t>(line)]) followed.to_mm = line * spacing_mm_;
  }
  const Stretch rest = stretch(line, step, count_);
  const bool is_lost = rest.in_view * spacing_mm_ >= kLost_mm && 2 * rest.agreeing < rest.in_view;
  followed.lost_to_mm = is_lost ? rest.last_in_view * spacing_mm_ : followed.to_mm;
  return followed;
}

// At most so many lines from that one on.
SeenTube::Stretch SeenTube::stretch(int line, int step, int most) const {
  Stretch stretch;
  for (; stretch.lines < most && is_line(line); line += step) {
    const auto here = static_cast<std::size_t>(line);
    ++stretch.lines;
    stretch.agreeing += agreeing_[here] ? 1 : 0;
    if (in_view_[here]) {
      ++stretch.in_view;
      stretch.last_in_view = line;
    }
  }
  return stretch;
}

}  // namespace tubed
