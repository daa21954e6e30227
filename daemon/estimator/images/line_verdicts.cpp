#include "daemon/estimator/images/line_verdicts.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "idl/geometry/squared.hpp"

namespace tubed {

namespace {

constexpr double kTip_mm = 32;
constexpr double kEndPiece_mm = 16;  // the tube's last piece, that may be seen or missed
constexpr int kMinTipLines = 4;      // in view, to say which
constexpr int kStretch = 10;         // lines that are surprising together
constexpr int kMinAgreeing = 7;      // of them, to say that the tube has jerked
constexpr int kMinTelling = 3;       // and, where it has, how far

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

int leave_out_beyond(double to_mm, const LineLayout& layout, CorrespondenceLines& lines) {
  int left_out = 0;
  for (int i = layout.count - 1; i >= 0 && layout.s_mm(i) > to_mm; --i) {
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

double Surprise::beyond_mm2_at(double s_mm, const LineLayout& layout) const {
  if (layout.count < kStretch) return 0;
  const auto line =
      std::clamp<long>(std::lround(s_mm / layout.spacing_mm), kStretch / 2, layout.count - kStretch / 2);
  return static_cast<double>(beyond_mm2[static_cast<std::size_t>(line)]);
}

// What lies between two places that the image shows is between what they say.
void Surprise::tell(int line, double variance_mm2, int known) {
  beyond_mm2[static_cast<std::size_t>(line)] = static_cast<float>(variance_mm2);
  for (int i = known + 1; known >= 0 && i < line; ++i) {
    const float share = static_cast<float>(i - known) / static_cast<float>(line - known);
    beyond_mm2[static_cast<std::size_t>(i)] = (1 - share) * beyond_mm2[static_cast<std::size_t>(known)] +
                                              share * beyond_mm2[static_cast<std::size_t>(line)];
  }
}

void Surprise::join(const Surprise& other) {
  chi2 = std::max(chi2, other.chi2);
  std::ranges::transform(beyond_mm2, other.beyond_mm2, beyond_mm2.begin(),
                         [](float a, float b) { return std::max(a, b); });
}

Surprise surprise_of(const CorrespondenceLines& lines, const LineLayout& layout, double sigma_px,
                     double radius_mm) {
  Surprise surprise;
  int known = -1;  // the line about which it was told last
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
    const int middle = first + kStretch / 2;
    const double px_per_mm = lines[static_cast<std::size_t>(middle)].half_width_px / radius_mm;
    if (agreeing < kMinTelling || !(px_per_mm > 0)) continue;
    if (agreeing >= kMinAgreeing) surprise.chi2 = std::max(surprise.chi2, seen_px2 / expected_px2);
    surprise.tell(middle, std::max(0.0, seen_px2 - expected_px2) / agreeing / squared(px_per_mm), known);
    known = middle;
  }
  return surprise;
}

}  // namespace tubed
