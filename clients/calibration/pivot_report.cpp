#include "clients/calibration/pivot_report.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "clients/calibration/formatted.hpp"
#include "clients/calibration/registration_report.hpp"

namespace tubed {

namespace {

using nlohmann::json;

/// Lengths of the residuals over the number of the measurement: those used, then outliers.
std::vector<PlotSeries> residual_series(const PivotCalibration& pivot) {
  std::vector<PlotSeries> series{{"used", "#2b6cb0", {}, false}, {"left out", "#b3261e", {}, false}};
  for (std::size_t i = 0; i < pivot.residuals_mm.size(); ++i) {
    const bool is_outlier = std::binary_search(pivot.outliers.begin(), pivot.outliers.end(), i);
    series[is_outlier ? 1 : 0].points.push_back({static_cast<double>(i + 1), pivot.residuals_mm[i].norm()});
  }
  return series;
}

std::vector<double> numbers_of(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

}  // namespace

std::string page_of(const JudgedPivot& judged, const std::string& source, const std::string& date) {
  const PivotCalibration& pivot = judged.pivot;
  ReportPage page("Tip of a probe", source + ", " + date);
  for (const CalibrationFinding& finding : judged.findings) {
    page.verdict(finding.verdict, finding.what + ": " + finding.evidence +
                                      (finding.advice.empty() ? "" : ". " + finding.advice));
  }
  if (worst(judged.findings) != ReportVerdict::kBad) {
    const Eigen::Vector3d sigma_mm = pivot.covariance_mm2.diagonal().cwiseMax(0).cwiseSqrt();
    page.heading("Tip in the sensor's frame");
    page.table({"", "x mm", "y mm", "z mm"},
               {{"offset", formatted("%.3f", pivot.tip_offset_mm.x()),
                 formatted("%.3f", pivot.tip_offset_mm.y()), formatted("%.3f", pivot.tip_offset_mm.z())},
                {"sigma", formatted("%.3f", sigma_mm.x()), formatted("%.3f", sigma_mm.y()),
                 formatted("%.3f", sigma_mm.z())}});
    if (pivot.freedom == ProbeFreedom::kFive) {
      page.text(
          "A 5-DOF coil does not know its turn about its axis: x and y are taken as 0, and are not known.");
    }
  }
  if (!pivot.residuals_mm.empty()) {
    page.heading("Residuals");
    page.figure(260, "Distance of the tip from the pivot, measurement by measurement; red: left out",
                [&](Svg& svg, const ReportPage::Room& room) {
                  draw_plot(svg, room, {"measurement", "mm"}, residual_series(pivot));
                });
  }
  return page.str();
}

json to_json(const JudgedPivot& judged) {
  const PivotCalibration& pivot = judged.pivot;
  json report{{"findings", to_json(judged.findings)}};
  if (worst(judged.findings) == ReportVerdict::kBad) return report;
  report["degrees_of_freedom"] = static_cast<int>(pivot.freedom);
  report["tip_offset_mm"] = numbers_of(pivot.tip_offset_mm);
  for (Eigen::Index row = 0; row < 3; ++row) {
    report["covariance_mm2"].push_back(numbers_of(pivot.covariance_mm2.row(row).transpose()));
  }
  report["pivot_em_mm"] = numbers_of(pivot.pivot_em_mm);
  report["residual_mm"] = pivot.residual_mm;
  report["across_mm"] = pivot.across_mm;
  report["outliers"] = pivot.outliers.size();
  return report;
}

std::string tip_offset_option(const PivotCalibration& pivot) {
  const Eigen::Vector3d& o_mm = pivot.tip_offset_mm;
  return pivot.freedom == ProbeFreedom::kFive
             ? formatted("--tip-offset 0,0,%.3f", o_mm.z())
             : formatted("--tip-offset=%.3f,%.3f,%.3f", o_mm.x(), o_mm.y(), o_mm.z());
}

}  // namespace tubed
