#include "clients/calibration/camera_report.hpp"

#include <algorithm>
#include <cmath>

#include "clients/calibration/camera_words.hpp"
#include "clients/calibration/report_page.hpp"
#include "idl/geometry/degree.hpp"

namespace tubed {

namespace {

constexpr const char* kBlue = "#2b6cb0";
constexpr const char* kRed = "#b3261e";
constexpr const char* kGreen = "#1b7f3b";

std::vector<double> residuals_px(const CameraFindings& findings) {
  std::vector<double> lengths;
  for (const FittedView& view : findings.chosen.fit.views) {
    for (const Eigen::Vector2d& residual : view.residual_px) lengths.push_back(residual.norm());
  }
  std::sort(lengths.begin(), lengths.end());
  return lengths;
}

/// A power of ten, twice or five times that, with which a usual residual is as long as a fiftieth of the
/// image.
double exaggeration_of(const CameraFindings& findings) {
  const double wanted = findings.width / 50.0 / std::max(1e-3, findings.chosen.fit.rms_px);
  const double power = std::pow(10, std::floor(std::log10(wanted)));
  const double mantissa = wanted / power;
  return std::max(1.0, power * (mantissa < 2 ? 1 : mantissa < 5 ? 2 : 5));
}

/// The points of all images in one frame, with what is left of each.
void draw_points(const CameraFindings& findings, double exaggeration, Svg& svg,
                 const ReportPage::Room& room) {
  const double scale = std::min(room.width / findings.width, room.height / findings.height);
  const SvgPoint corner{room.corner.x + (room.width - scale * findings.width) / 2, room.corner.y};
  svg.rectangle(corner, scale * findings.width, scale * findings.height, "#999", "#f4f4f4");
  const auto at = [&](const Eigen::Vector2d& p) {
    return SvgPoint{corner.x + scale * p.x(), corner.y + scale * p.y()};
  };
  for (const FoundBall& ball : findings.images.front().found) {
    svg.ring(at(ball.p_image_px), scale * ball.diameter_px / 2, {"#bbb", 1, 1});
  }
  for (std::size_t i = 0; i < findings.chosen.views.size(); ++i) {
    const auto& points = findings.chosen.views[i].points;
    for (std::size_t k = 0; k < points.size(); ++k) {
      const Eigen::Vector2d& found = points[k].p_image_px;
      const Eigen::Vector2d& residual = findings.chosen.fit.views[i].residual_px[k];
      if (i == 0) svg.disc(at(found - residual), 1.6, kGreen);
      svg.line(at(found), at(found + exaggeration * residual), {i == 0 ? kBlue : "#9bb8d8", 1.2, 1});
    }
  }
  for (const LeftOutPoint& out : findings.chosen.left_out) {
    if (out.view == 0) svg.ring(at(out.point.p_image_px), 6, {kRed, 1.5, 1});
  }
}

std::vector<Bar> histogram(const std::vector<double>& lengths) {
  constexpr int kBars = 8;
  const double most =
      std::max(1e-3, lengths[static_cast<std::size_t>(0.98 * static_cast<double>(lengths.size() - 1))]);
  std::vector<Bar> bars;
  for (int i = 0; i < kBars; ++i) {
    const double from = most * i / kBars;
    const double to = i + 1 == kBars ? 1e9 : most * (i + 1) / kBars;
    const auto count =
        std::count_if(lengths.begin(), lengths.end(), [&](double l) { return l >= from && l < to; });
    bars.push_back({decimals(from, 3) + " px and more", static_cast<double>(count)});
  }
  return bars;
}

std::vector<std::vector<std::string>> numbers(const CameraFindings& findings) {
  const CameraFit& fit = findings.chosen.fit;
  const FittedView& view = fit.views.front();
  const Eigen::Vector3d t = view.T_camera_world.translation();
  const Eigen::Vector3d mm = view.sigma_mm();
  const Eigen::Vector3d deg = view.sigma_rad() / kDegree;
  const auto row = [](const char* what, double value, int count, double sigma, int sigma_count,
                      const char* unit) {
    return std::vector<std::string>{what, decimals(value, count), decimals(sigma, sigma_count), unit};
  };
  std::vector<std::vector<std::string>> rows{
      row("focal length fx", fit.intrinsics.fx, 2, fit.sigma_of(0), 2, "px"),
      row("fy", fit.intrinsics.fx * fit.intrinsics.aspect, 2, fit.sigma_of(0), 2, "px"),
      row("principal point cx", fit.intrinsics.cx, 2, fit.sigma_of(2), 2, "px"),
      row("cy", fit.intrinsics.cy, 2, fit.sigma_of(3), 2, "px")};
  const char* const names[] = {"k1", "k2", "p1", "p2", "k3"};
  for (int term = 0; term < findings.chosen.model.distortion_terms; ++term) {
    rows.push_back(row(names[term], fit.intrinsics.distortion[static_cast<std::size_t>(term)], 5,
                       fit.sigma_of(4 + term), 5, ""));
  }
  const char* const axes[] = {"camera x", "camera y", "camera z"};
  for (int axis = 0; axis < 3; ++axis) {
    rows.push_back(row(axes[axis], t[axis], 2, mm[axis], 2, "mm, world's origin"));
  }
  for (int axis = 0; axis < 3; ++axis) {
    rows.push_back({std::string("turn about ") + axes[axis], "", decimals(deg[axis], 4), "deg"});
  }
  return rows;
}

void add_c_arm(const CameraFindings& findings, ReportPage& page) {
  if (!findings.c_arm) return;
  page.heading("Angles against poses");
  std::vector<std::vector<std::string>> rows;
  for (const ExplainedView& view : findings.c_arm->views) {
    rows.push_back({decimals(view.angles.primary_deg, 1), decimals(view.angles.secondary_deg, 1),
                    decimals(view.turn_deg.norm(), 3), decimals(view.shift_mm.norm(), 2)});
  }
  page.table({"primary, deg", "secondary, deg", "turned by, deg", "shifted by, mm"}, rows);
}

}  // namespace

std::string camera_report(const CameraFindings& findings) {
  ReportPage page("Calibration of camera " + findings.settings.camera,
                  std::to_string(findings.images.size()) + " images of " +
                      size_words(findings.width, findings.height) + ", " + date_of_today());
  for (const CameraStatement& statement : findings.statements)
    page.verdict(statement.verdict, statement.words);
  const double exaggeration = exaggeration_of(findings);
  const std::vector<double> lengths = residuals_px(findings);
  constexpr double kFigure_px = 300;
  page.figure(
      kFigure_px,
      "Left, image 1: shadows found (grey rings), balls projected (green), left out (red). Lines: what is "
      "left, " +
          decimals(exaggeration, 0) +
          " times as long; pale: the other images. Right: points by their distance from where they project.",
      [&](Svg& svg, const ReportPage::Room& room) {
        draw_points(findings, exaggeration, svg, {room.corner, 0.5 * room.width, room.height});
        const SvgPoint right{room.corner.x + 0.55 * room.width, room.corner.y};
        draw_bars(svg, {right, 0.45 * room.width, room.height}, histogram(lengths), "");
      });
  page.heading("What was found");
  page.table({"of image 1", "value", "std. dev.", "unit"}, numbers(findings));
  add_c_arm(findings, page);
  return page.str();
}

}  // namespace tubed
