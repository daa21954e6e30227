#include "clients/calibration/camera_clock.hpp"
#include "clients/calibration/formatted.hpp"
#include "clients/calibration/report_page.hpp"

namespace tubed {

namespace {

void draw_curve(const CameraClock& clock, Svg& svg, const ReportPage::Room& room) {
  PlotSeries series{"camera " + clock.camera, "#1f5fa8", {}, true};
  for (const ClockOffset::Tried& tried : clock.found.curve) {
    series.points.push_back({1e3 * (clock.configured_s + tried.offset_s), tried.rms_px});
  }
  draw_plot(svg, room, {"images late by, ms", "left, px"}, {series});
}

}  // namespace

std::string page_of(const std::vector<CameraClock>& clocks, const ConfigurationFragment& fragment) {
  ReportPage page("Clock of images against the tracker's", fragment.found_by + ", " + fragment.date);
  std::vector<std::vector<std::string>> rows;
  for (const CameraClock& clock : clocks) {
    page.verdict(
        ReportVerdict::kGood,
        "Camera " + clock.camera +
            formatted(": stamps are %+.1f ms late, sigma %.1f ms; the best offset is %.0f standard "
                      "deviations better than any other.",
                      1e3 * clock.offset_s(), 1e3 * clock.found.sigma_s, clock.found.peak_in_sigmas));
    rows.push_back({clock.camera, formatted("%.1f", 1e3 * clock.configured_s),
                    formatted("%.1f", 1e3 * clock.offset_s()), formatted("%.1f", 1e3 * clock.found.sigma_s),
                    formatted("%.1f", 1e3 * clock.found.white_sigma_s), std::to_string(clock.images),
                    std::to_string(clock.found.count), formatted("%.2f", clock.found.rms_px),
                    formatted("%.0f", clock.found.motion_px_s)});
  }
  page.table({"camera", "before ms", "now ms", "sigma ms", "if independent ms", "images", "places", "left px",
              "motion px/s"},
             rows);
  constexpr double kHeight_px = 200;
  for (const CameraClock& clock : clocks) {
    page.figure(kHeight_px, "What coils and images of camera " + clock.camera + " differ by, over the offset",
                [&clock](Svg& svg, const ReportPage::Room& room) { draw_curve(clock, svg, room); });
  }
  page.heading("Remarks");
  for (const std::string& remark : fragment.remarks) page.text(remark);
  return page.str();
}

}  // namespace tubed
