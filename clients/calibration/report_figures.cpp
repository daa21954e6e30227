// Bars and plots of a report.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>

#include "clients/calibration/report_page.hpp"

namespace tubed {

namespace {

constexpr const char* kBlue = "#2b6cb0";
constexpr const char* kRed = "#b3261e";
constexpr const char* kGrey = "#777";

std::string short_number(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.3g", value);
  return text.data();
}

/// What an axis shows, and where its ticks stand: multiples of 1, 2 or 5 times a power of ten.
struct Scale {
  double begin = 0;
  double end = 1;
  double step = 1;
};

Scale scale_of(double min, double max) {
  if (!(max > min)) {
    const double around = std::max(std::abs(min), 1.0) * 0.5;
    min = std::isfinite(min) ? min - around : 0;
    max = min + 2 * around;
  }
  const double rough = (max - min) / 5;
  const double power = std::pow(10, std::floor(std::log10(rough)));
  const double mantissa = rough / power;
  const double step = power * (mantissa < 1.5 ? 1 : mantissa < 3.5 ? 2 : mantissa < 7.5 ? 5 : 10);
  return {std::floor(min / step) * step, std::ceil(max / step) * step, step};
}

struct Extent {
  SvgPoint min{std::numeric_limits<double>::max(), std::numeric_limits<double>::max()};
  SvgPoint max{std::numeric_limits<double>::lowest(), std::numeric_limits<double>::lowest()};
};

bool is_finite(const SvgPoint& point) { return std::isfinite(point.x) && std::isfinite(point.y); }

Extent extent_of(const std::vector<PlotSeries>& series) {
  Extent extent;
  for (const PlotSeries& one : series) {
    for (const SvgPoint& point : one.points) {
      if (!is_finite(point)) continue;
      extent.min = {std::min(extent.min.x, point.x), std::min(extent.min.y, point.y)};
      extent.max = {std::max(extent.max.x, point.x), std::max(extent.max.y, point.y)};
    }
  }
  return extent.max.x < extent.min.x ? Extent{{0, 0}, {1, 1}} : extent;
}

/// The area inside of the axes.
struct PlotArea {
  double left, top, right, bottom;
  Scale x, y;

  [[nodiscard]] SvgPoint at(const SvgPoint& value) const {
    return {left + (value.x - x.begin) / (x.end - x.begin) * (right - left),
            bottom - (value.y - y.begin) / (y.end - y.begin) * (bottom - top)};
  }
};

void draw_axes(Svg& svg, const PlotArea& area, const PlotAxes& axes) {
  svg.rectangle({area.left, area.top}, area.right - area.left, area.bottom - area.top, "#ccc", "none");
  for (double value = area.x.begin; value <= area.x.end + area.x.step / 2; value += area.x.step) {
    const SvgPoint at = area.at({value, area.y.begin});
    svg.line(at, {at.x, at.y + 4}, {kGrey});
    svg.text({at.x, at.y + 16}, short_number(std::abs(value) < area.x.step / 1e6 ? 0 : value), 10,
             TextAnchor::kMiddle, kGrey);
  }
  for (double value = area.y.begin; value <= area.y.end + area.y.step / 2; value += area.y.step) {
    const SvgPoint at = area.at({area.x.begin, value});
    svg.line({area.left, at.y}, {area.right, at.y}, {"#eee"});
    svg.text({at.x - 6, at.y + 3}, short_number(std::abs(value) < area.y.step / 1e6 ? 0 : value), 10,
             TextAnchor::kEnd, kGrey);
  }
  svg.text({(area.left + area.right) / 2, area.bottom + 32}, axes.x, 11, TextAnchor::kMiddle);
  svg.text({area.left - 42, area.top - 6}, axes.y, 11, TextAnchor::kStart);
}

void draw_series(Svg& svg, const PlotArea& area, const PlotSeries& series) {
  std::vector<SvgPoint> places;
  for (const SvgPoint& point : series.points) {
    if (is_finite(point)) places.push_back(area.at(point));
  }
  if (series.line) {
    svg.polyline(places, {series.colour, 1.6});
    return;
  }
  for (const SvgPoint& place : places) svg.disc(place, 2.5, series.colour, 0.7);
}

}  // namespace

void draw_bars(Svg& svg, const ReportPage::Room& room, const std::vector<Bar>& bars, const std::string& unit,
               double limit) {
  double greatest = limit;
  std::size_t longest = 0;
  for (const Bar& bar : bars) {
    greatest = std::max(greatest, bar.value);
    longest = std::max(longest, bar.label.size());
  }
  const double left = room.corner.x + 14 + 6.5 * static_cast<double>(std::min<std::size_t>(longest, 30));
  const double right = room.corner.x + room.width - 80;
  const double pitch =
      std::min(22.0, room.height / static_cast<double>(std::max<std::size_t>(bars.size(), 1)));
  const double scale = greatest > 0 ? (right - left) / greatest : 0;
  double y = room.corner.y;
  for (const Bar& bar : bars) {
    const bool is_beyond = limit > 0 && bar.value > limit;
    const double text_y = y + pitch / 2 + 4;
    svg.text({left - 8, text_y}, bar.label, 12, TextAnchor::kEnd);
    svg.rectangle({left, y + 2}, std::max(1.0, bar.value * scale), pitch - 4, "none",
                  is_beyond ? kRed : kBlue);
    svg.text({left + bar.value * scale + 6, text_y}, short_number(bar.value) + " " + unit, 12,
             TextAnchor::kStart, is_beyond ? kRed : "#222");
    y += pitch;
  }
  if (limit > 0) {
    svg.line({left + limit * scale, room.corner.y}, {left + limit * scale, y}, {kGrey, 1, 0.7});
  }
}

void draw_plot(Svg& svg, const ReportPage::Room& room, const PlotAxes& axes,
               const std::vector<PlotSeries>& series) {
  const Extent extent = extent_of(series);
  const PlotArea area{room.corner.x + 56,
                      room.corner.y + 22,
                      room.corner.x + room.width - 12,
                      room.corner.y + room.height - 40,
                      scale_of(extent.min.x, extent.max.x),
                      scale_of(extent.min.y, extent.max.y)};
  draw_axes(svg, area, axes);
  double legend_y = area.top + 16;
  for (const PlotSeries& one : series) {
    draw_series(svg, area, one);
    if (!one.name.empty()) {
      svg.text({area.right - 10, legend_y}, one.name, 11, TextAnchor::kEnd, one.colour);
      legend_y += 15;
    }
  }
}

}  // namespace tubed
