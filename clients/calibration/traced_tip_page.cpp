#include <algorithm>
#include <cmath>
#include <iterator>

#include "clients/calibration/formatted.hpp"
#include "clients/calibration/report_page.hpp"
#include "clients/calibration/traced_tip.hpp"

namespace tubed {

namespace {

constexpr double kWellTraced_mm = 0.5;
constexpr double kUsualLength_mm = 150;

std::string words_of(const RestArc& arc) {
  return arc.radius_mm == 0 ? "straight" : formatted("%.1f", std::abs(arc.radius_mm));
}

/// Points and curve to one scale, as large as the room allows.
void draw_curve(const TracedCurve& found, const TracedTip& drawing, Svg& svg, const ReportPage::Room& room) {
  constexpr double kMargin_px = 24;
  const Eigen::Vector2d min = drawing.points_mm.rowwise().minCoeff();
  const Eigen::Vector2d size = drawing.points_mm.rowwise().maxCoeff() - min;
  const double scale = std::min((room.width - 2 * kMargin_px) / std::max(size.x(), 1.0),
                                (room.height - 2 * kMargin_px) / std::max(size.y(), 1.0));
  const SvgPoint corner{room.corner.x + (room.width - scale * size.x()) / 2,
                        room.corner.y + (room.height - scale * size.y()) / 2};
  const auto at = [&](const Eigen::Vector2d& p) {
    return SvgPoint{corner.x + scale * (p.x() - min.x()), corner.y + scale * (p.y() - min.y())};
  };
  std::vector<SvgPoint> line;
  for (Eigen::Index i = 0; i < found.line_mm.cols(); ++i) line.push_back(at(found.line_mm.col(i)));
  svg.polyline(line, {"#2b6cb0", 3, 0.5});
  for (Eigen::Index i = 0; i < drawing.points_mm.cols(); ++i)
    svg.disc(at(drawing.points_mm.col(i)), 2, "#222");
  double end_mm = 0;
  for (const RestArc& arc : found.curve.arcs) {
    end_mm += arc.length_mm;
    const auto i = std::min<Eigen::Index>(std::lround(2 * end_mm), found.line_mm.cols() - 1);
    svg.ring(at(found.line_mm.col(i)), 5, {"#c0561a", 1.5});
  }
  svg.ring(at(drawing.points_mm.col(0)), 7, {"#2d8a4e", 2});
  const SvgPoint bar{room.corner.x + kMargin_px, room.corner.y + room.height - 10};
  svg.line(bar, {bar.x + 10 * scale, bar.y}, {"#777", 2});
  svg.text({bar.x, bar.y - 5}, "10 mm", 10, TextAnchor::kStart, "#777");
}

}  // namespace

std::vector<std::string> doubts_of(const TracedCurve& found) {
  std::vector<std::string> doubts;
  if (found.drawn_mm > kUsualLength_mm) {
    doubts.push_back(
        formatted("the drawing is %.0f mm long, %.0f are enough for a tip and its shaft: are these "
                  "millimetres, not the pixels of a photograph (x_px,y_px and --mm-per-px)?",
                  found.drawn_mm, kUsualLength_mm));
  }
  const RestArc& first = found.curve.arcs.front();
  if (first.radius_mm == 0 && first.length_mm > found.shaft_mm) {
    doubts.push_back(
        formatted("the drawing is straight over its first %.0f mm and over its last %.0f: is the first point "
                  "the tip? If it is, trace on along the shaft",
                  first.length_mm, found.shaft_mm));
  } else if (found.ends_bent) {
    doubts.emplace_back(
        "the drawing ends where the catheter is still bent: trace on until it is straight, or the rest is "
        "lost");
  }
  return doubts;
}

ConfigurationFragment fragment_of(const TracedCurve& found, const TracedTip& drawing,
                                  const std::string& instrument_id) {
  ConfigurationFragment fragment;
  fragment.found_by =
      "tubectl calibrate tip, " + formatted("%d points", static_cast<int>(drawing.points_mm.cols()));
  fragment.date = date_of_today();
  fragment.remarks.push_back(
      formatted("arcs explain the drawing to %.2f mm RMS, %.2f mm at most", found.rms_mm, found.max_mm));
  std::ranges::copy(doubts_of(found), std::back_inserter(fragment.remarks));
  std::vector<double> numbers;
  for (const RestArc& arc : found.curve.arcs) numbers.insert(numbers.end(), {arc.length_mm, arc.radius_mm});
  const std::string table = "instrument[" + instrument_id + "].";
  fragment.values = {{table + "rest_shape", std::string("arcs")}, {table + "rest_arcs_mm", numbers}};
  return fragment;
}

std::string page_of(const TracedCurve& found, const TracedTip& drawing,
                    const ConfigurationFragment& fragment) {
  ReportPage page("Rest shape of a tip", fragment.found_by + ", " + fragment.date);
  page.verdict(found.rms_mm <= kWellTraced_mm ? ReportVerdict::kGood : ReportVerdict::kDoubtful,
               fragment.remarks.front() + (found.rms_mm <= kWellTraced_mm
                                               ? "."
                                               : ". A careful drawing comes to 0.5 mm: trace it once more."));
  for (const std::string& doubt : doubts_of(found)) page.verdict(ReportVerdict::kDoubtful, doubt + ".");
  std::vector<std::vector<std::string>> rows;
  for (const RestArc& arc : found.curve.arcs) {
    rows.push_back({std::to_string(rows.size() + 1), formatted("%.1f", arc.length_mm), words_of(arc),
                    arc.radius_mm == 0  ? ""
                    : arc.radius_mm > 0 ? "to one side"
                                        : "to the other side",
                    formatted("%.0f", std::abs(arc.length_mm * arc.curvature_per_mm()) * 180 / M_PI)});
  }
  page.table({"arc, from the tip", "length mm", "radius mm", "turns", "degrees"}, rows);
  page.figure(420, "Black: the points as drawn. Blue: the arcs. Green: the tip. Orange: where an arc ends.",
              [&](Svg& svg, const ReportPage::Room& room) { draw_curve(found, drawing, svg, room); });
  page.text("Is the tip where the green ring is? Points have to go from the tip to the shaft.");
  return page.str();
}

}  // namespace tubed
