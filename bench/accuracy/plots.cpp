#include "bench/accuracy/plots.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "bench/support/value_axis.hpp"
#include "clients/evaluation/statistics.hpp"

namespace tubed {

namespace {

constexpr const char* kEmColour = "#c62828";
constexpr const char* kFusedColour = "#2e7d32";
constexpr std::array<const char*, 8> kColours{"#c62828", "#1565c0", "#2e7d32", "#ef6c00",
                                              "#6a1b9a", "#00838f", "#5d4037", "#455a64"};
constexpr double kRowHeight = 300;
constexpr double kGroupWidth = 150;
constexpr double kLeft = 50;
constexpr double kWide = 900;
constexpr double kPanelHeight = 190;
constexpr double kMaxShown = 1.25;  // times the 99th percentile: a snap must not flatten all the rest

const char* colour_of(std::size_t i) { return kColours[i % kColours.size()]; }

std::string formatted(const char* format, double first, double second) {
  char text[64];
  std::snprintf(text, sizeof text, format, first, second);
  return text;
}

double greatest(const std::vector<double>& values) {
  return values.empty() ? 0 : *std::max_element(values.begin(), values.end());
}

void draw_box(Svg& svg, const ValueAxis& axis, double centre, const std::vector<double>& values,
              const char* colour) {
  if (values.empty()) return;
  constexpr double kHalf = 22;
  const double low = axis.y(quantile(values, 0.25));
  const double high = axis.y(quantile(values, 0.75));
  const double middle = axis.y(quantile(values, 0.5));
  const double least = axis.y(quantile(values, 0));
  const double most = axis.y(quantile(values, 1));
  svg.line({centre, least}, {centre, low}, {colour});
  svg.line({centre, high}, {centre, most}, {colour});
  svg.line({centre - kHalf / 2, least}, {centre + kHalf / 2, least}, {colour});
  svg.line({centre - kHalf / 2, most}, {centre + kHalf / 2, most}, {colour});
  svg.rectangle({centre - kHalf, high}, 2 * kHalf, low - high, colour, "white");
  svg.line({centre - kHalf, middle}, {centre + kHalf, middle}, {colour, 2.5});
}

void draw_pair(Svg& svg, const BoxPair& pair, double above) {
  double top = 0.1;
  for (const Metric& metric : kMetrics) {
    top = std::max({top, greatest(pair.em->values_mm(metric)), greatest(pair.fused->values_mm(metric))});
  }
  top *= 1.12;  // room for the words above the highest whisker
  const ValueAxis axis{kLeft, kLeft + kGroupWidth * static_cast<double>(kMetrics.size()),
                       above + kRowHeight - 50, kRowHeight - 100, top};
  axis.draw(svg, "mm");
  svg.text({axis.right - 190, above + 22}, pair.em_name, 13, TextAnchor::kEnd, kEmColour);
  svg.text({axis.right - 180, above + 22}, pair.fused_name, 13, TextAnchor::kStart, kFusedColour);
  const auto comparison = compare(*pair.em, *pair.fused);
  for (std::size_t i = 0; i < kMetrics.size(); ++i) {
    const double centre = kLeft + kGroupWidth * (static_cast<double>(i) + 0.5);
    const std::vector<double> em = pair.em->values_mm(kMetrics[i]);
    const std::vector<double> fused = pair.fused->values_mm(kMetrics[i]);
    draw_box(svg, axis, centre - 30, em, kEmColour);
    draw_box(svg, axis, centre + 30, fused, kFusedColour);
    svg.text({centre, axis.bottom + 18}, std::string(kMetrics[i].name), 12, TextAnchor::kMiddle);
    if (comparison) {
      const MedianAndIqr& gain = comparison->metrics[i].improvement_percent;
      svg.text({centre, axis.y(std::max(greatest(em), greatest(fused))) - 6},
               formatted("%.1f | %.1f %%", gain.median, gain.iqr), 11, TextAnchor::kMiddle);
    }
  }
}

/// Errors of one metric by instant; NaN where there is none.
std::vector<double> by_instant(const MethodEvaluation& evaluation, const Metric& metric) {
  std::vector<double> values;
  for (const auto& error : evaluation.errors) {
    values.push_back(error ? (*error).*metric.value_mm : std::nan(""));
  }
  return values;
}

void draw_error_panel(Svg& svg, double above, const std::vector<double>& t_s,
                      const std::vector<ErrorCurve>& curves, const Metric& metric) {
  std::vector<double> all;
  for (const ErrorCurve& curve : curves) {
    const std::vector<double> values = curve.evaluation->values_mm(metric);
    all.insert(all.end(), values.begin(), values.end());
  }
  if (all.empty()) return;
  const double top = std::max(0.1, kMaxShown * quantile(all, 0.99));
  const ValueAxis axis{kLeft, kWide - 20, above + kPanelHeight - 30, kPanelHeight - 60, top};
  axis.draw(svg, std::string(metric.name) + ", mm");
  const double duration_s = std::max(t_s.back() - t_s.front(), 1e-9);
  for (std::size_t c = 0; c < curves.size(); ++c) {
    const std::vector<double> values = by_instant(*curves[c].evaluation, metric);
    std::vector<SvgPoint> stretch;
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (std::isfinite(values[i])) {
        stretch.push_back({axis.left + (axis.right - axis.left) * (t_s[i] - t_s.front()) / duration_s,
                           axis.y(std::min(values[i], top))});
        continue;
      }
      svg.polyline(stretch, {colour_of(c), 1.2});
      stretch.clear();
    }
    svg.polyline(stretch, {colour_of(c), 1.2});
  }
  for (int i = 0; i <= 5; ++i) {
    svg.text({axis.left + (axis.right - axis.left) * i / 5.0, axis.bottom + 16},
             formatted("%.1f s", t_s.front() + duration_s * i / 5, 0), 11, TextAnchor::kMiddle);
  }
}

template <typename Curves>
void draw_legend(Svg& svg, double y, const Curves& curves) {
  double x = kLeft;
  for (std::size_t i = 0; i < curves.size(); ++i) {
    svg.line({x, y - 4}, {x + 20, y - 4}, {colour_of(i), 3});
    svg.text({x + 25, y}, curves[i].name, 12, TextAnchor::kStart);
    x += 55 + 8 * static_cast<double>(curves[i].name.size());
  }
}

void draw_sensitivity_panel(Svg& svg, double above, const SensitivityPanel& panel) {
  double top = 0.1;
  double first = INFINITY;
  double last = -INFINITY;
  for (const SensitivityCurve& curve : panel.curves) {
    top = std::max(top, greatest(curve.error_mm));
    first = std::min(first, *std::min_element(curve.values.begin(), curve.values.end()));
    last = std::max(last, greatest(curve.values));
  }
  const ValueAxis axis{kLeft, kWide - 20, above + kPanelHeight - 30, kPanelHeight - 60, 1.1 * top};
  axis.draw(svg, "median RMS, mm, against " + panel.varied);
  const auto x = [&](double value) {
    return axis.left + 20 + (axis.right - axis.left - 40) * (value - first) / std::max(last - first, 1e-12);
  };
  for (std::size_t c = 0; c < panel.curves.size(); ++c) {
    std::vector<SvgPoint> points;
    for (std::size_t i = 0; i < panel.curves[c].values.size(); ++i) {
      points.push_back({x(panel.curves[c].values[i]), axis.y(panel.curves[c].error_mm[i])});
      svg.rectangle({points.back().x - 2, points.back().y - 2}, 4, 4, colour_of(c), colour_of(c));
    }
    svg.polyline(points, {colour_of(c), 1.2});
  }
  for (const double value : panel.curves.front().values) {
    svg.text({x(value), axis.bottom + 16}, formatted("%g", value, 0), 11, TextAnchor::kMiddle);
  }
}

}  // namespace

std::string box_plots(const std::string& title, const std::vector<BoxPair>& pairs) {
  Svg svg(kLeft + kGroupWidth * static_cast<double>(kMetrics.size()) + 20,
          40 + kRowHeight * static_cast<double>(pairs.size()));
  svg.text({kLeft, 24}, title, 15, TextAnchor::kStart);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    draw_pair(svg, pairs[i], 30 + kRowHeight * static_cast<double>(i));
  }
  return svg.str();
}

std::string error_over_time(const std::string& title, const std::vector<double>& t_s,
                            const std::vector<ErrorCurve>& curves) {
  Svg svg(kWide, 60 + 3 * kPanelHeight);
  svg.text({kLeft, 24}, title, 15, TextAnchor::kStart);
  draw_legend(svg, 46, curves);
  constexpr std::array<std::size_t, 3> kShown{1, 2, 4};  // RMS, x, z
  for (std::size_t i = 0; i < kShown.size(); ++i) {
    draw_error_panel(svg, 50 + kPanelHeight * static_cast<double>(i), t_s, curves, kMetrics[kShown[i]]);
  }
  return svg.str();
}

std::string sensitivity_plots(const std::string& title, const std::vector<SensitivityPanel>& panels) {
  Svg svg(kWide, 60 + kPanelHeight * static_cast<double>(panels.size()));
  svg.text({kLeft, 24}, title, 15, TextAnchor::kStart);
  if (!panels.empty()) draw_legend(svg, 46, panels.front().curves);
  for (std::size_t i = 0; i < panels.size(); ++i) {
    draw_sensitivity_panel(svg, 50 + kPanelHeight * static_cast<double>(i), panels[i]);
  }
  return svg.str();
}

}  // namespace tubed
