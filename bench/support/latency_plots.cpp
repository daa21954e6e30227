#include "bench/support/latency_plots.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>

#include "bench/support/value_axis.hpp"

namespace tubed {

namespace {

constexpr std::array<const char*, 10> kColours{"#c62828", "#1565c0", "#2e7d32", "#ef6c00", "#6a1b9a",
                                               "#00838f", "#5d4037", "#455a64", "#ad1457", "#9e9d24"};
constexpr double kWide = 900;
constexpr double kPanelHeight = 300;
constexpr double kLeft = 60;
constexpr double kLegendWidth = 230;

const char* colour_of(std::size_t i) { return kColours[i % kColours.size()]; }

/// A stretch of values mapped onto px, linear or logarithmic.
struct Scale {
  double least = 0;
  double most = 1;
  double from_px = 0;
  double to_px = 1;
  bool is_logarithmic = false;

  [[nodiscard]] double px(double value) const {
    const auto shown = [this](double v) { return is_logarithmic ? std::log10(std::max(v, 1e-12)) : v; };
    const double share = (shown(value) - shown(least)) / std::max(shown(most) - shown(least), 1e-12);
    return from_px + (to_px - from_px) * std::clamp(share, 0.0, 1.0);
  }
};

/// The frame of one panel.
struct Frame {
  double left = kLeft;
  double right = kWide - kLegendWidth;
  double top;
  double bottom;
  explicit Frame(std::size_t panel)
      : top(70 + kPanelHeight * static_cast<double>(panel)), bottom(top + kPanelHeight - 80) {}
};

/// Equal round steps.
std::vector<double> round_steps(const Scale& scale) {
  const double step = round_step(scale.most - scale.least);
  std::vector<double> values;
  const auto first = static_cast<int>(std::ceil(scale.least / step - 1e-9));
  for (int i = first; i * step <= scale.most * 1.0001; ++i) values.push_back(i * step);
  return values;
}

/// Round values between least and most; on a logarithmic scale powers of ten with 2 and 5 where there is
/// room.
std::vector<double> round_values(const Scale& scale) {
  if (!scale.is_logarithmic || scale.most / scale.least < 8) return round_steps(scale);
  const bool is_wide = scale.most / scale.least > 1000;
  std::vector<double> values;
  for (double power = std::pow(10, std::floor(std::log10(scale.least))); power <= scale.most; power *= 10) {
    for (const double digit : {1.0, 2.0, 5.0}) {
      const double value = digit * power;
      if (value >= scale.least * 0.999 && value <= scale.most * 1.001 && (digit == 1 || !is_wide)) {
        values.push_back(value);
      }
    }
  }
  return values;
}

void draw_frame(Svg& svg, const Frame& frame, const Scale& y, const std::string& title) {
  for (const double value : round_values(y)) {
    svg.line({frame.left, y.px(value)}, {frame.right, y.px(value)}, {"#ddd"});
    svg.text({frame.left - 6, y.px(value) + 4}, short_number(value), 11, TextAnchor::kEnd);
  }
  svg.line({frame.left, frame.bottom}, {frame.right, frame.bottom}, {"#555"});
  svg.text({frame.left - 40, frame.top - 10}, title, 12, TextAnchor::kStart);
}

void mark_across(Svg& svg, const Frame& frame, double x, const std::string& words) {
  svg.line({x, frame.bottom}, {x, frame.bottom + 4}, {"#555"});
  svg.text({x, frame.bottom + 17}, words, 11, TextAnchor::kMiddle);
}

void name_across(Svg& svg, const Frame& frame, const std::string& words) {
  svg.text({(frame.left + frame.right) / 2, frame.bottom + 33}, words, 11, TextAnchor::kMiddle);
}

void draw_legend(Svg& svg, const Frame& frame, std::size_t i, const std::string& label) {
  const double y = frame.top + 8 + 17 * static_cast<double>(i);
  svg.line({frame.right + 12, y - 4}, {frame.right + 30, y - 4}, {colour_of(i), 3});
  svg.text({frame.right + 35, y}, label, 11, TextAnchor::kStart);
}

std::string unit_of(const PlotPanel& panel) {
  return panel.rows.empty() ? "" : panel.rows.front().row.value("unit", "");
}

/// Least and greatest of what `pick` finds in an element, over all rows that have `member`.
Scale range_of(const PlotPanel& panel, const char* member,
               const std::function<void(const nlohmann::json&, const std::function<void(double)>&)>& pick) {
  double least = std::numeric_limits<double>::infinity();
  double most = 0;
  for (const PlottedRow& plotted : panel.rows) {
    for (const auto& element : plotted.row.value(member, nlohmann::json::array())) {
      pick(element, [&](double value) {
        least = std::min(least, std::max(value, 1e-9));
        most = std::max(most, value);
      });
    }
  }
  return {least, std::max(most, least * 1.01), 0, 1, false};
}

std::string picture(const std::string& title, std::size_t panels,
                    const std::function<void(Svg&, std::size_t)>& draw_panel) {
  Svg svg(kWide, 60 + kPanelHeight * static_cast<double>(panels));
  svg.text({kLeft - 40, 26}, title, 15, TextAnchor::kStart);
  for (std::size_t i = 0; i < panels; ++i) draw_panel(svg, i);
  return svg.str();
}

void draw_percentiles(Svg& svg, std::size_t index, const PlotPanel& panel) {
  const Frame frame(index);
  constexpr double kMaxNines = 4;
  Scale y = range_of(panel, "curve", [](const auto& point, const auto& see) { see(point[1]); });
  y = {y.least, y.most, frame.bottom, frame.top, true};
  if (!std::isfinite(y.least)) return;
  draw_frame(svg, frame, y, panel.title + ", " + unit_of(panel));
  const auto x = [&](double percent) {
    const double nines = -std::log10(std::max(1 - percent / 100, 1e-9));
    return frame.left + (frame.right - frame.left) * std::min(nines, kMaxNines) / kMaxNines;
  };
  for (const double percent : {0.0, 50.0, 90.0, 99.0, 99.9, 99.99}) {
    mark_across(svg, frame, x(percent), short_number(percent));
  }
  name_across(svg, frame, "percentile");
  for (std::size_t i = 0; i < panel.rows.size(); ++i) {
    std::vector<SvgPoint> points;
    for (const auto& point : panel.rows[i].row.value("curve", nlohmann::json::array())) {
      if (point[0].get<double>() < 100) points.push_back({x(point[0]), y.px(point[1])});
    }
    svg.polyline(points, {colour_of(i), 1.6});
    draw_legend(svg, frame, i, panel.rows[i].label);
  }
}

void draw_histogram(Svg& svg, std::size_t index, const PlotPanel& panel) {
  const Frame frame(index);
  Scale x = range_of(panel, "histogram", [](const auto& bin, const auto& see) {
    see(bin[0]);
    see(bin[1]);
  });
  if (!std::isfinite(x.least)) return;
  x = {x.least, x.most, frame.left, frame.right, true};
  double most = 0;
  for (const PlottedRow& plotted : panel.rows) {
    for (const auto& bin : plotted.row.value("histogram", nlohmann::json::array())) {
      most = std::max(most, bin[2].get<double>() / plotted.row["n"].get<double>());
    }
  }
  const Scale y{0, most, frame.bottom, frame.top, false};
  draw_frame(svg, frame, y, panel.title + ": share of the samples");
  for (const double value : round_values(x)) mark_across(svg, frame, x.px(value), short_number(value));
  name_across(svg, frame, unit_of(panel));
  for (std::size_t i = 0; i < panel.rows.size(); ++i) {
    std::vector<SvgPoint> points;
    double last = 0;
    for (const auto& bin : panel.rows[i].row.value("histogram", nlohmann::json::array())) {
      const double share = bin[2].get<double>() / panel.rows[i].row["n"].get<double>();
      const double from = bin[0];
      if (last > 0 && from > last * 1.001)
        points.insert(points.end(), {{x.px(last), y.px(0)}, {x.px(from), y.px(0)}});
      if (last == 0) points.push_back({x.px(from), y.px(0)});
      points.insert(points.end(), {{x.px(from), y.px(share)}, {x.px(bin[1]), y.px(share)}});
      last = bin[1];
    }
    if (last > 0) points.push_back({x.px(last), y.px(0)});
    svg.polyline(points, {colour_of(i), 1.6});
    draw_legend(svg, frame, i, panel.rows[i].label);
  }
}

void draw_series(Svg& svg, std::size_t index, const PlotPanel& panel) {
  const Frame frame(index);
  Scale y = range_of(panel, "series", [](const auto& point, const auto& see) {
    see(point[1]);
    see(point[2]);
  });
  Scale x = range_of(panel, "series", [](const auto& point, const auto& see) { see(point[0]); });
  if (!std::isfinite(y.least)) return;
  x = {0, x.most, frame.left, frame.right, false};
  y = {y.least, y.most, frame.bottom, frame.top, y.most / y.least > 5};
  draw_frame(svg, frame, y, panel.title + ", " + unit_of(panel));
  for (const double value : round_values(x)) mark_across(svg, frame, x.px(value), short_number(value));
  name_across(svg, frame, "s since the start; thick: medians, thin: greatest of each stretch");
  for (std::size_t i = 0; i < panel.rows.size(); ++i) {
    for (const std::size_t column : {std::size_t{1}, std::size_t{2}}) {
      std::vector<SvgPoint> points;
      for (const auto& point : panel.rows[i].row.value("series", nlohmann::json::array())) {
        points.push_back({x.px(point[0]), y.px(point[column])});
      }
      svg.polyline(points, {colour_of(i), column == 1 ? 1.8 : 0.5});
    }
    draw_legend(svg, frame, i, panel.rows[i].label);
  }
}

void draw_growth(Svg& svg, std::size_t index, const GrowthPanel& panel) {
  const Frame frame(index);
  Scale x{0, 0, frame.left, frame.right, false};
  Scale y{0, 0, frame.bottom, frame.top, false};
  for (const GrowthCurve& curve : panel.curves) {
    for (const double value : curve.x) x.most = std::max(x.most, 1.05 * value);
    for (const double value : curve.y) y.most = std::max(y.most, 1.1 * value);
  }
  if (x.most <= 0 || y.most <= 0) return;
  draw_frame(svg, frame, y, panel.title);
  for (const double value : round_values(x)) mark_across(svg, frame, x.px(value), short_number(value));
  name_across(svg, frame, panel.across);
  for (std::size_t i = 0; i < panel.curves.size(); ++i) {
    std::vector<SvgPoint> points;
    for (std::size_t k = 0; k < panel.curves[i].x.size(); ++k) {
      points.push_back({x.px(panel.curves[i].x[k]), y.px(panel.curves[i].y[k])});
      svg.rectangle({points.back().x - 2.5, points.back().y - 2.5}, 5, 5, colour_of(i), colour_of(i));
    }
    svg.polyline(points, {colour_of(i), 1.6});
    draw_legend(svg, frame, i, panel.curves[i].label);
  }
}

}  // namespace

std::string percentile_plots(const std::string& title, const std::vector<PlotPanel>& panels) {
  return picture(title, panels.size(), [&](Svg& svg, std::size_t i) { draw_percentiles(svg, i, panels[i]); });
}

std::string histogram_plots(const std::string& title, const std::vector<PlotPanel>& panels) {
  return picture(title, panels.size(), [&](Svg& svg, std::size_t i) { draw_histogram(svg, i, panels[i]); });
}

std::string series_plots(const std::string& title, const std::vector<PlotPanel>& panels) {
  return picture(title, panels.size(), [&](Svg& svg, std::size_t i) { draw_series(svg, i, panels[i]); });
}

std::string growth_plots(const std::string& title, const std::vector<GrowthPanel>& panels) {
  return picture(title, panels.size(), [&](Svg& svg, std::size_t i) { draw_growth(svg, i, panels[i]); });
}

PlotPanel panel_of(const std::string& title, const nlohmann::json& report, const std::string& prefix) {
  PlotPanel panel{title, {}};
  for (const auto& row : report.at("rows")) {
    const auto name = row.at("name").get<std::string>();
    if (name.starts_with(prefix)) panel.rows.push_back({name.substr(prefix.size()), row});
  }
  return panel;
}

}  // namespace tubed
