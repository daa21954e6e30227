#include "daemon/estimator/images/line_verdicts.hpp"

#include <cstddef>

#include "idl/geometry/squared.hpp"

namespace tubed {

namespace {

constexpr double kTip_mm = 32;
constexpr double kEndPiece_mm = 16;  // the tube's last piece, that may be seen or missed
constexpr int kMinTipLines = 4;      // in view, to say which

}  // namespace

int leave_out_before(double from_mm, const LineLayout& layout, CorrespondenceLines& lines) {
  int left_out = 0;
  for (int i = 0; i < layout.count && layout.s_mm(i) < from_mm; ++i) {
    CorrespondenceLine& line = lines[static_cast<std::size_t>(i)];
    left_out += line.in_view ? 1 : 0;
    line.in_view = false;
  }
  return left_out;
}

std::optional<bool> misses_tip(const CorrespondenceLines& lines, const LineLayout& layout) {
  int asked = 0;
  int agreeing = 0;
  for (int i = 0; i < layout.count && layout.s_mm(i) < kEndPiece_mm; ++i) {
    const CorrespondenceLine& line = lines[static_cast<std::size_t>(i)];
    asked += line.in_view ? 1 : 0;
    agreeing += line.in_view && line.agrees ? 1 : 0;
  }
  return asked < kMinTipLines ? std::nullopt : std::optional(2 * agreeing < asked);
}

int unseen_at_tip(const CorrespondenceLines& lines, const LineLayout& layout) {
  int unseen = 0;
  for (int i = 0; i < layout.count && layout.s_mm(i) < kTip_mm; ++i) {
    const CorrespondenceLine& line = lines[static_cast<std::size_t>(i)];
    unseen += line.in_view && !line.agrees ? 1 : 0;
  }
  return unseen;
}

Surprise greatest_surprise(const CorrespondenceLines& lines, const LineLayout& layout, double sigma_px) {
  constexpr int kStretch = 10;     // lines
  constexpr int kMinAgreeing = 7;  // of them
  Surprise greatest;
  for (int first = 0; first + kStretch <= layout.count; ++first) {
    int agreeing = 0;
    double seen_px2 = 0;
    double expected_px2 = 0;
    for (int i = first; i < first + kStretch; ++i) {
      const CorrespondenceLine& line = lines[static_cast<std::size_t>(i)];
      if (!line.in_view || !line.agrees || !(line.expected_variance_px2 > 0)) continue;
      ++agreeing;
      seen_px2 += squared(line.offset_px - line.expected_px);
      expected_px2 += line.expected_variance_px2 + line.variance_px2 + squared(sigma_px);
    }
    if (agreeing >= kMinAgreeing && seen_px2 > greatest.chi2 * expected_px2) {
      greatest = {seen_px2 / expected_px2, layout.s_mm(first + kStretch / 2)};
    }
  }
  return greatest;
}

}  // namespace tubed
