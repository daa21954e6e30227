#include "clients/tubectl/see/demo_picture.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdio>
#include <iterator>

#include "clients/cpp/centreline.hpp"
#include "clients/svg/svg.hpp"
#include "clients/tubectl/see/dashes.hpp"
#include "idl/validity.hpp"

namespace tubed {

namespace {

constexpr int kPanelWidth = 380;
constexpr int kPanelHeight = 600;
constexpr int kPanelTop = 40;
constexpr double kMaxScale = 2.2;  // px a mm
constexpr double kMargin = 40;     // px around the tube
constexpr double kTextSize = 15;

constexpr const char* kPaper = "#0d1117";
constexpr const char* kPanelPaper = "#10151c";
constexpr const char* kWords = "#c9d1d9";
constexpr const char* kTruth = "#8b949e";
constexpr const char* kCoilsAlone = "#f85149";
constexpr const char* kFused = "#3fb950";
constexpr const char* kCoils = "#58a6ff";

/// How the room is drawn: along the camera's axes, so large that the tube fits.
struct Scale {
  RigidTransform T_camera_world;
  Eigen::Vector3d centre_mm;  // in the camera's frame
  double px_per_mm;
};

Scale scale_for(const SampledCentreline& truth, const SampledCentreline& fused,
                const RigidTransform& T_camera_world) {
  Eigen::AlignedBox3d box;
  for (const SampledCentreline* curve : {&truth, &fused}) {
    for (Eigen::Index i = 0; i < curve->p_world_mm.cols(); ++i)
      box.extend(T_camera_world * Eigen::Vector3d(curve->p_world_mm.col(i)));
  }
  const Eigen::Vector3d sizes_mm = box.sizes().cwiseMax(1.0);
  const double across_mm = std::max(sizes_mm.x(), sizes_mm.z());
  return {T_camera_world, box.center(),
          std::min({kMaxScale, (kPanelWidth - 2 * kMargin) / across_mm,
                    (kPanelHeight - 2 * kMargin) / sizes_mm.y()})};
}

/// One panel: the camera's axis `across` to the right, its y down.
struct Panel {
  int across;
  int left;
  const char* title;
  Scale scale;
  [[nodiscard]] SvgPoint at(const Eigen::Vector3d& p_world_mm) const {
    const Eigen::Vector3d p_mm = scale.T_camera_world * p_world_mm - scale.centre_mm;
    return {left + kPanelWidth / 2.0 + p_mm[across] * scale.px_per_mm,
            kPanelTop + kPanelHeight / 2.0 + p_mm.y() * scale.px_per_mm};
  }
};

template <typename... Values>
std::string format(const char* pattern, Values... values) {
  std::array<char, 512> text{};
  std::snprintf(text.data(), text.size(), pattern, values...);
  return text.data();
}

void draw_curve(Svg& svg, const Panel& panel, const SampledCentreline& curve, const SvgStroke& stroke) {
  std::vector<SvgPoint> points;
  for (Eigen::Index i = 0; i < curve.p_world_mm.cols(); i += 2) {
    points.push_back(panel.at(curve.p_world_mm.col(i)));
  }
  svg.polyline(points, stroke);
}

/// What nothing holds is dashed.
void draw_fused(Svg& svg, const Panel& panel, const tubed_TubeEstimate& fused,
                const SampledCentreline& centreline) {
  std::vector<SvgPoint> piece;
  for (std::size_t i = 0; i < centreline.s_mm.size(); ++i) {
    const bool is_drawn = is_drawn_at(fused, centreline.s_mm[i]);
    if (is_drawn) piece.push_back(panel.at(centreline.p_world_mm.col(static_cast<Eigen::Index>(i))));
    if (is_drawn && i + 1 < centreline.s_mm.size()) continue;
    if (piece.size() > 1) svg.polyline(piece, {kFused, 1.6});
    piece.clear();
  }
}

void draw_sigma_band(Svg& svg, const Panel& panel, const tubed_TubeEstimate& fused,
                     const SampledCentreline& centreline) {
  for (std::size_t i = 0; i < centreline.s_mm.size(); i += 3) {
    const double s_mm = centreline.s_mm[i];
    const Vector3 p = tubed::point_at(fused, s_mm);
    svg.disc(panel.at({p[0], p[1], p[2]}), sigma_mm_at(fused, s_mm) * panel.scale.px_per_mm, kFused, 0.16);
  }
}

void draw_coils(Svg& svg, const Panel& panel, const tubed_TubeEstimate& fused,
                const SampledCentreline& centreline) {
  const auto coils = std::min<std::size_t>(fused.coil_count, std::size(fused.coils));
  for (std::size_t i = 0; i < coils && !centreline.s_mm.empty(); ++i) {
    const double s_mm = static_cast<double>(fused.coils[i].offset_from_tip_mm);
    svg.ring(panel.at(point_at(centreline, s_mm)), 4, {kCoils, 1.5});
  }
}

void draw_panel(Svg& svg, const Panel& panel, const DemoFigures& figures, const DemoShapes& shapes) {
  const tubed_TubeEstimate& fused = *shapes.fused;
  const SampledCentreline centreline = DemoFigures::centreline_of(fused);
  const SvgPoint corner{static_cast<double>(panel.left), kPanelTop};
  svg.begin_clip(corner, kPanelWidth, kPanelHeight);
  svg.rectangle(corner, kPanelWidth, kPanelHeight, "none", kPanelPaper);
  draw_sigma_band(svg, panel, fused, centreline);
  draw_curve(svg, panel, figures.truth_at(fused.valid_time_monotonic_ns),
             {kTruth, 2.33 * panel.scale.px_per_mm, 0.8});
  if (shapes.em) {
    draw_curve(svg, panel, DemoFigures::centreline_of(*shapes.em), {kCoilsAlone, 1.6});
  }
  draw_fused(svg, panel, fused, centreline);
  draw_coils(svg, panel, fused, centreline);
  svg.end_clip();
  svg.text({corner.x, 30}, panel.title, kTextSize, TextAnchor::kStart, kWords);
}

void write_figures(Svg& svg, const DemoFigures& figures, const tubed_TubeEstimate& fused) {
  svg.text(
      {10, 692},
      format("%s (%s), %.1f Hz, exposure to subscriber p50 %.1f ms",
             std::string(name_of(static_cast<Validity>(fused.validity))).c_str(),
             names_of(Reasons(fused.reasons)).c_str(), figures.recent_rate_hz(), figures.latency_ms(0.5)),
      kTextSize, TextAnchor::kStart, kWords);
  const auto em_mm = figures.newest_rms_mm(1);
  const auto fused_mm = figures.newest_rms_mm(0);
  if (em_mm && fused_mm) {
    svg.text(
        {10, 716},
        format("RMS error of this shape: coils alone %.1f mm, with the image %.1f mm", *em_mm, *fused_mm),
        kTextSize, TextAnchor::kStart, kWords);
  }
}

}  // namespace

std::string demo_picture_svg(const DemoFigures& figures, const DemoShapes& shapes) {
  if (!shapes.fused || !has_shape(*shapes.fused)) {
    return {};
  }
  Svg svg(790, 730, kPaper);
  const Scale scale =
      scale_for(figures.truth_at(shapes.fused->valid_time_monotonic_ns),
                DemoFigures::centreline_of(*shapes.fused), figures.camera().calibration().T_camera_world);
  draw_panel(svg, {0, 10, "as the fluoroscope sees it", scale}, figures, shapes);
  draw_panel(svg, {2, 400, "from the side: depth to the right", scale}, figures, shapes);
  const double unheld = unheld_ratio(*shapes.fused);
  svg.text({10, 668},
           {{"truth (simulated)", kTruth},
            {"coils alone", kCoilsAlone},
            {"fused, with one sigma" +
                 (unheld > 0 ? format("; dashed: nothing holds it, %.0f %%", 100 * unheld) : ""),
             kFused},
            {"coils", kCoils}},
           kTextSize);
  write_figures(svg, figures, *shapes.fused);
  return svg.str();
}

}  // namespace tubed
