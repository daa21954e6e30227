// Pictures of latencies, made from the rows of a report's JSON.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace tubed {

/// One curve: a row of the JSON under the name the legend gives it.
struct PlottedRow {
  std::string label;
  nlohmann::json row;
};

/// One panel; several stand below each other in a picture.
struct PlotPanel {
  std::string title;
  std::vector<PlottedRow> rows;
};

/// Latency over percentile: across 1 - p on a logarithmic scale, so that the tail has its room; up on a
/// logarithmic one. Rows without a "curve" are left out.
std::string percentile_plots(const std::string& title, const std::vector<PlotPanel>& panels);

/// Share of the values by latency, logarithmic bins.
std::string histogram_plots(const std::string& title, const std::vector<PlotPanel>& panels);

/// Medians of short stretches over time, and their greatest values as thin lines.
std::string series_plots(const std::string& title, const std::vector<PlotPanel>& panels);

/// What something costs over what grows; both axes linear.
struct GrowthCurve {
  std::string label;
  std::vector<double> x;
  std::vector<double> y;
};
struct GrowthPanel {
  std::string title;   ///< "CPU, % of a core"
  std::string across;  ///< "subscribers"
  std::vector<GrowthCurve> curves;
};
std::string growth_plots(const std::string& title, const std::vector<GrowthPanel>& panels);

/// The rows whose names begin so, labelled with the rest of the name.
PlotPanel panel_of(const std::string& title, const nlohmann::json& report, const std::string& prefix);

}  // namespace tubed
