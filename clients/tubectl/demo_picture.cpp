#include "clients/tubectl/demo_picture.hpp"

#include <array>
#include <cstdio>

#include "clients/cpp/centreline.hpp"
#include "idl/validity.hpp"

namespace tubed {

namespace {

constexpr int kPanelWidth = 380;
constexpr int kPanelHeight = 600;
constexpr double kScale = 2.2;  // SVG units a mm
constexpr double kCentreDown_mm = 25;

/// One panel: world axis `across` to the right, y down.
struct Panel {
  int across;
  int left;
  const char* title;
  [[nodiscard]] double x(const Eigen::Vector3d& p) const {
    return left + kPanelWidth / 2.0 + p[across] * kScale;
  }
  [[nodiscard]] static double y(const Eigen::Vector3d& p) {
    return 40 + kPanelHeight / 2.0 + (p[1] - kCentreDown_mm) * kScale;
  }
};

template <typename... Values>
std::string format(const char* pattern, Values... values) {
  std::array<char, 512> text{};
  std::snprintf(text.data(), text.size(), pattern, values...);
  return text.data();
}

std::string polyline(const Panel& panel, const SampledCentreline& curve, const char* colour, double width,
                     double opacity) {
  std::string points;
  for (Eigen::Index i = 0; i < curve.p_world_mm.cols(); i += 2) {
    points += format("%.1f,%.1f ", panel.x(curve.p_world_mm.col(i)), Panel::y(curve.p_world_mm.col(i)));
  }
  return format(
             "<polyline fill='none' stroke='%s' stroke-width='%.1f' stroke-opacity='%.2f' "
             "stroke-linecap='round' points='",
             colour, width, opacity) +
         points + "'/>\n";
}

std::string draw_panel(const Panel& panel, const DemoFigures& figures, const DemoShapes& shapes) {
  const tubed_TubeEstimate& fused = *shapes.fused;
  const SampledCentreline centreline = DemoFigures::centreline_of(fused);
  std::string svg = format(
      "<svg x='0' y='0'><clipPath id='c%d'><rect x='%d' y='40' width='%d' height='%d'/></clipPath><g "
      "clip-path='url(#c%d)'>\n",
      panel.left, panel.left, kPanelWidth, kPanelHeight, panel.left);
  svg += format("<rect x='%d' y='40' width='%d' height='%d' fill='#10151c'/>\n", panel.left, kPanelWidth,
                kPanelHeight);
  for (int s = 0; s <= static_cast<int>(fused.length_mm); s += 3) {
    const Vector3 p = tubed::point_at(fused, s);
    svg += format("<circle cx='%.1f' cy='%.1f' r='%.1f' fill='#3fb950' fill-opacity='0.16'/>\n",
                  panel.x({p[0], p[1], p[2]}), Panel::y({p[0], p[1], p[2]}), sigma_mm_at(fused, s) * kScale);
  }
  svg += polyline(panel, figures.truth_at(fused.valid_time_monotonic_ns), "#8b949e", 2.33 * kScale, 0.8);
  if (shapes.em) {
    svg += polyline(panel, DemoFigures::centreline_of(*shapes.em), "#f85149", 1.6, 1);
  }
  svg += polyline(panel, centreline, "#3fb950", 1.6, 1);
  for (std::uint32_t i = 0; i < fused.coil_count && !centreline.s_mm.empty(); ++i) {
    const Eigen::Vector3d p = point_at(centreline, static_cast<double>(fused.coils[i].offset_from_tip_mm));
    svg += format("<circle cx='%.1f' cy='%.1f' r='4' fill='none' stroke='#58a6ff' stroke-width='1.5'/>\n",
                  panel.x(p), Panel::y(p));
  }
  return svg + format("</g></svg><text x='%d' y='30' fill='#c9d1d9'>%s</text>\n", panel.left, panel.title);
}

}  // namespace

std::string demo_picture_svg(const DemoFigures& figures, const DemoShapes& shapes) {
  if (!shapes.fused || !has_shape(*shapes.fused)) {
    return {};
  }
  std::string svg =
      "<svg xmlns='http://www.w3.org/2000/svg' width='790' height='730' font-family='sans-serif' "
      "font-size='15'>\n"
      "<rect width='790' height='730' fill='#0d1117'/>\n";
  svg += draw_panel({0, 10, "as the fluoroscope sees it"}, figures, shapes);
  svg += draw_panel({2, 400, "from the side: depth"}, figures, shapes);
  const auto em = figures.newest_rms_mm(1);
  const auto fused = figures.newest_rms_mm(0);
  svg +=
      "<text x='10' y='668' fill='#8b949e'>truth (simulated)<tspan fill='#f85149' dx='16'>coils alone</tspan>"
      "<tspan fill='#3fb950' dx='16'>coils and image, with one sigma</tspan><tspan fill='#58a6ff' "
      "dx='16'>coils</tspan></text>\n";
  svg += format(
      "<text x='10' y='692' fill='#c9d1d9'>%s (%s), %.1f Hz, exposure to subscriber p50 %.1f ms</text>\n",
      std::string(name_of(static_cast<Validity>(shapes.fused->validity))).c_str(),
      names_of(Reasons(shapes.fused->reasons)).c_str(), figures.recent_rate_hz(), figures.latency_ms(0.5));
  if (em && fused) {
    svg += format(
        "<text x='10' y='716' fill='#c9d1d9'>RMS error of this shape: coils alone %.1f mm, with the image "
        "%.1f mm</text>\n",
        *em, *fused);
  }
  return svg + "</svg>\n";
}

}  // namespace tubed
