#include "bench/geometry/sensitivity_table.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <optional>

#include "clients/evaluation/statistics.hpp"

namespace tubed {

namespace {

template <typename... Values>
std::string formatted(const char* format, Values... values) {
  std::array<char, 256> text{};
  std::snprintf(text.data(), text.size(), format, values...);
  return text.data();
}

std::optional<double> median_without(const std::vector<std::string>& mistakes,
                                     const std::vector<PooledRuns>& runs) {
  const auto none = std::find(mistakes.begin(), mistakes.end(), "none");
  if (none == mistakes.end()) return std::nullopt;
  const PooledRuns& without = runs[static_cast<std::size_t>(none - mistakes.begin())];
  if (without.rms_mm.empty()) return std::nullopt;
  return quantile(without.rms_mm, 0.5);
}

std::string row_of(const std::string& mistake, const PooledRuns& run, std::optional<double> without_mm) {
  std::string row = "| `" + mistake + "` | ";
  if (run.rms_mm.empty()) {
    row += "- | - | - | ";
  } else {
    const double median_mm = quantile(run.rms_mm, 0.5);
    const auto [least, greatest] = std::minmax_element(run.median_rms_mm.begin(), run.median_rms_mm.end());
    row += formatted("%.2f (%.2f to %.2f) | ", median_mm, *least, *greatest);
    row += without_mm ? formatted("%+.2f | ", median_mm - *without_mm) : "- | ";
    row += formatted("%.2f | ", quantile(run.tip_mm, 0.5));
  }
  return row + formatted("%.1f | %.1f | %.1f |\n", percent(run.valid, run.due),
                         percent(run.of_valid.misleading, run.of_valid.instants),
                         percent(run.of_all.misleading, run.of_all.instants));
}

}  // namespace

std::vector<std::string> operator_errors() {
  return {"none",
          "registration=1,0",
          "registration=2,0",
          "registration=5,0",
          "registration=0,1",
          "registration=0,2",
          "pose=1,0",
          "pose=2,0",
          "pose=5,0",
          "pose=0,0.5",
          "pose=0,1",
          "pose=0,2",
          "offsets=1",
          "offsets=2",
          "offsets=5",
          "focal=1.01",
          "focal=1.02",
          "focal=1.05",
          "clock=10",
          "clock=30",
          "clock=100"};
}

std::string sensitivity_table(const std::vector<std::string>& mistakes, const std::vector<PooledRuns>& runs) {
  std::string table =
      "| mistake | RMS in view, mm (medians of the seeds) | more than without | tip, mm | VALID, % | "
      "misleading, "
      "% of VALID | of all |\n|---|---|---|---|---|---|---|\n";
  const std::optional<double> without_mm = median_without(mistakes, runs);
  for (std::size_t i = 0; i < mistakes.size(); ++i) table += row_of(mistakes[i], runs[i], without_mm);
  return table;
}

}  // namespace tubed
