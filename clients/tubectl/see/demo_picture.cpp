#include "clients/tubectl/see/demo_picture.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdio>
#include <iterator>

#include "clients/cpp/centreline.hpp"
#include "clients/svg/svg.hpp"
#include "idl/validity.hpp"

namespace tubed {

namespace {

constexpr int kPanelWidth = 380;
constexpr int kPanelHeight = 600;
constexpr int kPanelTop = 40;
constexpr double kScale = 2.2;  // px a mm
constexpr double kCentreDown_mm = 25;
constexpr double kTextSize = 15;

constexpr const char* kPaper = "#0d1117";
constexpr const char* kPanelPaper = "#10151c";
constexpr const char* kWords = "#c9d1d9";
constexpr const char* kTruth = "#8b949e";
constexpr const char* kCoilsAlone = "#f85149";
constexpr const char* kFused = "#3fb950";
constexpr const char* kCoils = "#58a6ff";

/// One panel: world axis `across` to the right, y down.
struct Panel {
  int across;
  int left;
  const char* title;
  [[nodiscard]] SvgPoint at(const Eigen::Vector3d& p_world_mm) const {
    return {left + kPanelWidth / 2.0 + p_world_mm[across] * kScale,
            kPanelTop + kPanelHeight / 2.0 + (p_world_mm[1] - kCentreDown_mm) * kScale};
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

void draw_sigma_band(Svg& svg, const Panel& panel, const tubed_TubeEstimate& fused,
                     const SampledCentreline& centreline) {
  for (std::size_t i = 0; i < centreline.s_mm.size(); i += 3) {
    const double s_mm = centreline.s_mm[i];
    const Vector3 p = tubed::point_at(fused, s_mm);
    svg.disc(panel.at({p[0], p[1], p[2]}), sigma_mm_at(fused, s_mm) * kScale, kFused, 0.16);
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
  draw_curve(svg, panel, figures.truth_at(fused.valid_time_monotonic_ns), {kTruth, 2.33 * kScale, 0.8});
  if (shapes.em) {
    draw_curve(svg, panel, DemoFigures::centreline_of(*shapes.em), {kCoilsAlone, 1.6});
  }
  draw_curve(svg, panel, centreline, {kFused, 1.6});
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
  draw_panel(svg, {0, 10, "as the fluoroscope sees it"}, figures, shapes);
  draw_panel(svg, {2, 400, "from the side: depth"}, figures, shapes);
  svg.text({10, 668},
           {{"truth (simulated)", kTruth},
            {"coils alone", kCoilsAlone},
            {"coils and image, with one sigma", kFused},
            {"coils", kCoils}},
           kTextSize);
  write_figures(svg, figures, *shapes.fused);
  return svg.str();
}

}  // namespace tubed
