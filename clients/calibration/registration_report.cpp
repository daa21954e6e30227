#include "clients/calibration/registration_report.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "clients/calibration/formatted.hpp"
#include "clients/calibration/registration_values.hpp"
#include "idl/printable_text.hpp"

namespace tubed {

namespace {

using nlohmann::json;

std::string axes_remark(MarkerAxes axes) {
  return axes == MarkerAxes::kAsWritten
             ? "world axes: as the markers' file has them, nobody said which (--axes LPS or RAS)"
             : "world axes: " + std::string(name_of(axes));
}

double expected_mm(const JudgedRegistration& judged, const Eigen::Vector3d& p_world_mm) {
  return expected_tre_mm(judged.registration, p_world_mm);
}

bool is_outlier(const JudgedRegistration& judged, std::size_t marker) {
  return std::find(judged.outliers.begin(), judged.outliers.end(), marker) != judged.outliers.end();
}

/// Every `step`-th place, and the last.
std::vector<TubePlace> some_of(const std::vector<TubePlace>& tube, double step_mm) {
  std::vector<TubePlace> some;
  for (const TubePlace& place : tube) {
    if (some.empty() || place.s_mm - some.back().s_mm >= step_mm - 1e-9) some.push_back(place);
  }
  if (!some.empty() && some.back().s_mm < tube.back().s_mm) some.push_back(tube.back());
  return some;
}

std::string place_text(const Eigen::Vector3d& p_mm) {
  return formatted("%.1f, %.1f, %.1f", p_mm.x(), p_mm.y(), p_mm.z());
}

/// Markers as rings, where they were touched as discs, the residuals between them drawn larger.
void draw_projection(Svg& svg, const ReportPage::Room& room, const JudgedRegistration& judged,
                     std::array<Eigen::Index, 2> axes, double exaggeration) {
  const Eigen::Matrix3Xd& markers = judged.pairs.p_world_mm;
  const Eigen::Vector3d middle = (markers.rowwise().minCoeff() + markers.rowwise().maxCoeff()) / 2;
  const double extent_mm = (markers.rowwise().maxCoeff() - markers.rowwise().minCoeff()).maxCoeff();
  const double px_per_mm = 0.72 * std::min(room.width, room.height) / std::max(extent_mm, 1.0);
  const auto at = [&](const Eigen::Vector3d& p_mm) {
    const Eigen::Vector3d d_px = (p_mm - middle) * px_per_mm;
    return SvgPoint{room.corner.x + room.width / 2 + d_px(axes[0]),
                    room.corner.y + room.height / 2 - d_px(axes[1])};
  };
  svg.rectangle(room.corner, room.width, room.height, "#ccc", "none");
  const std::string names = "xyz";
  svg.text({room.corner.x + 8, room.corner.y + 16},
           std::string("world ") + names[static_cast<std::size_t>(axes[0])] + " to the right, " +
               names[static_cast<std::size_t>(axes[1])] + " up",
           11, TextAnchor::kStart, "#777");
  for (std::size_t i = 0; i < judged.pairs.size(); ++i) {
    const auto column = static_cast<Eigen::Index>(i);
    const char* const colour = is_outlier(judged, i) ? "#b3261e" : "#2b6cb0";
    const Eigen::Vector3d marker_mm = markers.col(column);
    const SvgPoint touched = at(marker_mm + exaggeration * judged.registration.residual_world_mm.col(column));
    svg.ring(at(marker_mm), 5, {"#555"});
    svg.line(at(marker_mm), touched, {colour, 1.4});
    svg.disc(touched, 3, colour);
    svg.text({at(marker_mm).x + 8, at(marker_mm).y - 6}, printable_text(judged.pairs.names[i]), 10,
             TextAnchor::kStart);
  }
}

/// A round factor that makes the largest residual about an eighth of the markers' extent.
double exaggeration_of(const JudgedRegistration& judged) {
  const Eigen::Matrix3Xd& markers = judged.pairs.p_world_mm;
  const double extent_mm = (markers.rowwise().maxCoeff() - markers.rowwise().minCoeff()).maxCoeff();
  const double max_mm = judged.registration.residual_world_mm.colwise().norm().maxCoeff();
  for (const double factor : {100.0, 50.0, 20.0, 10.0, 5.0, 2.0}) {
    if (factor * max_mm < extent_mm / 8) return factor;
  }
  return 1;
}

void add_residuals(ReportPage& page, const JudgedRegistration& judged) {
  std::vector<Bar> bars;
  for (std::size_t i = 0; i < judged.pairs.size(); ++i) {
    bars.push_back({printable_text(judged.pairs.names[i]), judged.registration.residual_mm(i)});
  }
  page.heading("Residuals");
  page.figure(std::min(20.0 * static_cast<double>(bars.size()), 260.0),
              "Distance of the registered touch from its marker, mm; the line is what one marker in " +
                  std::to_string(100 * bars.size()) + " exceeds",
              [&](Svg& svg, const ReportPage::Room& room) {
                draw_bars(svg, room, bars, "mm", judged.outlier_limit_mm);
              });
  const double factor = exaggeration_of(judged);
  page.figure(240,
              formatted("Rings: markers; discs: where they were touched, residuals drawn %.0f times", factor),
              [&](Svg& svg, const ReportPage::Room& room) {
                const double half = room.width / 2 - 6;
                draw_projection(svg, {room.corner, half, room.height}, judged, {0, 1}, factor);
                draw_projection(svg, {{room.corner.x + half + 12, room.corner.y}, half, room.height}, judged,
                                {0, 2}, factor);
              });
}

std::vector<std::vector<std::string>> marker_rows(const JudgedRegistration& judged) {
  std::vector<std::vector<std::string>> rows;
  for (std::size_t i = 0; i < judged.pairs.size(); ++i) {
    const auto column = static_cast<Eigen::Index>(i);
    rows.push_back({printable_text(judged.pairs.names[i]), place_text(judged.pairs.p_world_mm.col(column)),
                    formatted("%.2f", judged.registration.residual_mm(i)),
                    judged.left_out.empty() ? "-" : formatted("%.2f", judged.left_out[i].error_mm),
                    judged.left_out.empty() ? "-" : formatted("%.2g", judged.left_out[i].p_value)});
  }
  return rows;
}

void add_expected_errors(ReportPage& page, const JudgedRegistration& judged,
                         const RegistrationContext& context) {
  page.heading("Expected error (TRE)");
  page.text(formatted("At the centre of the markers %.2f mm RMS.",
                      expected_mm(judged, judged.registration.centroid_world_mm)));
  if (!context.targets.empty()) {
    std::vector<std::vector<std::string>> rows;
    for (const Target& target : context.targets) {
      rows.push_back({printable_text(target.name), place_text(target.p_world_mm),
                      formatted("%.2f", expected_mm(judged, target.p_world_mm))});
    }
    page.table({"target", "x, y, z in the world, mm", "TRE mm RMS"}, rows);
  }
  if (!context.tube.empty()) {
    PlotSeries series{"TRE", "#2b6cb0", {}, true};
    for (const TubePlace& place : context.tube) {
      series.points.push_back({place.s_mm, expected_mm(judged, place.p_world_mm)});
    }
    page.figure(150, "Expected error along the tube, root mean square",
                [&](Svg& svg, const ReportPage::Room& room) {
                  draw_plot(svg, room, {"arc length from the tip, mm", "TRE, mm"}, {series});
                });
  }
}

std::string_view word_of(ReportVerdict verdict) {
  return verdict == ReportVerdict::kGood ? "fine" : verdict == ReportVerdict::kDoubtful ? "look" : "WRONG";
}

}  // namespace

ConfigurationFragment fragment_of(const JudgedRegistration& judged, const RegistrationContext& context) {
  const MarkerRegistration& registration = judged.registration;
  ConfigurationFragment fragment{
      "tubectl register, " + std::to_string(registration.size()) + " markers", context.date, {}, {}};
  fragment.remarks.push_back(formatted(
      "FRE %.2f mm RMS, FLE %.2f mm, expected error at the markers' centre %.2f mm", registration.fre_mm,
      registration.fle_mm, expected_mm(judged, registration.centroid_world_mm)));
  fragment.remarks.push_back(axes_remark(context.world_axes));
  for (const std::string& remark : context.remarks) fragment.remarks.push_back(remark);
  for (const CalibrationFinding& finding : judged.findings) {
    if (finding.verdict == ReportVerdict::kDoubtful) {
      fragment.remarks.push_back("look at: " + finding.what + ": " + finding.evidence);
    }
  }
  add_registration(registration.T_world_em, registration.quality, registration.fre_mm, fragment);
  if (context.world_axes != MarkerAxes::kAsWritten) {
    fragment.values.push_back({"dds.world_axes", std::string(name_of(context.world_axes))});
  }
  return fragment;
}

std::string page_of(const JudgedRegistration& judged, const RegistrationContext& context) {
  ReportPage page("Registration of the EM tracker", std::to_string(judged.pairs.size()) + " markers, " +
                                                        context.date + ", " +
                                                        axes_remark(context.world_axes));
  for (const CalibrationFinding& finding : judged.findings) {
    page.verdict(finding.verdict, finding.what + ": " + finding.evidence +
                                      (finding.advice.empty() ? "" : ". " + finding.advice));
  }
  for (const std::string& remark : context.remarks) page.text(remark);
  add_residuals(page, judged);
  page.table({"marker", "x, y, z in the world, mm", "residual mm", "left out mm", "p"}, marker_rows(judged),
             judged.outliers);
  if (worst(judged.findings) != ReportVerdict::kBad) add_expected_errors(page, judged, context);
  return page.str();
}

json to_json(const std::vector<CalibrationFinding>& findings) {
  json list = json::array();
  for (const CalibrationFinding& finding : findings) {
    list.push_back({{"what", finding.what},
                    {"verdict", std::string(word_of(finding.verdict))},
                    {"evidence", finding.evidence},
                    {"advice", finding.advice}});
  }
  return list;
}

json to_json(const JudgedRegistration& judged, const RegistrationContext& context) {
  const MarkerRegistration& registration = judged.registration;
  json report{{"findings", to_json(judged.findings)},
              {"fre_mm", registration.fre_mm},
              {"fle_mm", registration.fle_mm},
              {"world_axes", std::string(name_of(context.world_axes))},
              {"remarks", context.remarks}};
  for (std::size_t i = 0; i < judged.pairs.size(); ++i) {
    json marker{{"name", judged.pairs.names[i]},
                {"residual_mm", registration.residual_mm(i)},
                {"is_outlier", is_outlier(judged, i)}};
    if (!judged.left_out.empty()) {
      marker["left_out_error_mm"] = judged.left_out[i].error_mm;
      marker["left_out_p"] = judged.left_out[i].p_value;
    }
    report["markers"].push_back(marker);
  }
  if (worst(judged.findings) == ReportVerdict::kBad) return report;
  for (Eigen::Index row = 0; row < 4; ++row) {
    const Eigen::RowVector4d entries = registration.T_world_em.matrix().row(row);
    report["T_world_em"].push_back(std::vector<double>(entries.begin(), entries.end()));
  }
  report["covariance"] = upper_triangle(registration.quality.covariance);
  const Eigen::Vector3d& centre_mm = registration.centroid_world_mm;
  report["centre_mm"] = std::vector<double>(centre_mm.begin(), centre_mm.end());
  for (const Target& target : context.targets) {
    report["targets"].push_back({{"name", target.name}, {"tre_mm", expected_mm(judged, target.p_world_mm)}});
  }
  for (const TubePlace& place : context.tube) {
    report["tube"].push_back({{"s_mm", place.s_mm}, {"tre_mm", expected_mm(judged, place.p_world_mm)}});
  }
  return report;
}

std::string to_text(const std::vector<CalibrationFinding>& findings) {
  std::string text;
  for (const CalibrationFinding& finding : findings) {
    text += formatted("%-7s%-12s", std::string(word_of(finding.verdict)).c_str(), finding.what.c_str()) +
            finding.evidence + '\n';
    if (!finding.advice.empty()) text += std::string(19, ' ') + "-> " + finding.advice + '\n';
  }
  return text;
}

std::string to_text(const JudgedRegistration& judged, const RegistrationContext& context) {
  std::string text = "marker          residual mm  left out mm        p\n";
  for (const auto& row : marker_rows(judged)) {
    text +=
        formatted("%-16s%11s%13s%9s", row[0].c_str(), row[2].c_str(), row[3].c_str(), row[4].c_str()) + '\n';
  }
  if (worst(judged.findings) == ReportVerdict::kBad) return text;
  text += "\nexpected error (TRE), mm RMS\n" +
          formatted("%-16s%11.2f\n", "centre", expected_mm(judged, judged.registration.centroid_world_mm));
  for (const Target& target : context.targets) {
    text += formatted("%-16s%11.2f\n", printable_text(target.name).c_str(),
                      expected_mm(judged, target.p_world_mm));
  }
  for (const TubePlace& place : some_of(context.tube, 50)) {
    text += formatted("tube at %-8.0f%11.2f\n", place.s_mm, expected_mm(judged, place.p_world_mm));
  }
  return text;
}

}  // namespace tubed
