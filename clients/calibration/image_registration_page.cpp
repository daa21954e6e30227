#include "clients/calibration/formatted.hpp"
#include "clients/calibration/image_registration.hpp"
#include "clients/calibration/report_page.hpp"
#include "idl/geometry/degree.hpp"

namespace tubed {

namespace {

constexpr double kDoubtful_mm = 1.5;  // what is known worse is said to be looked at

std::vector<std::vector<std::string>> axis_rows(const RigidCorrection& correction) {
  const RegistrationQuality quality{correction.covariance, correction.centre_world_mm};
  const RegistrationQuality::Sigma sigma = quality.sigma_at(correction.centre_world_mm);
  std::vector<std::vector<std::string>> rows;
  for (int axis = 0; axis < 3; ++axis) {
    rows.push_back({std::string(1, "xyz"[axis]), formatted("%+.2f", correction.shift_mm[axis]),
                    formatted("%.2f", sigma.shift_mm[axis]),
                    formatted("%+.2f", correction.turn_rad[axis] / kDegree),
                    formatted("%.2f", sigma.turn_rad[axis] / kDegree)});
  }
  return rows;
}

}  // namespace

std::string page_of(const ImageRegistration& found, const ConfigurationFragment& fragment) {
  const RigidCorrection& correction = found.correction;
  ReportPage page("Registration of the EM tracker by images", fragment.found_by + ", " + fragment.date);
  page.verdict(
      correction.worst_shift_mm() > kDoubtful_mm ? ReportVerdict::kDoubtful : ReportVerdict::kGood,
      formatted(
          "The coils' middle is known to %.1f mm along the worst direction; directions of view lie %.0f "
          "degrees apart.",
          correction.worst_shift_mm(), found.apart_rad / kDegree));
  page.heading("The correction, about the coils' middle, along and about the axes of the world");
  page.table({"axis", "shift mm", "sigma mm", "turn deg", "sigma deg"}, axis_rows(correction));
  std::vector<Bar> bars;
  for (std::size_t i = 0; i < found.coil_rms_mm.size(); ++i) {
    bars.push_back(
        {i + 1 < found.coil_rms_mm.size() ? formatted("coil %zu", i + 1) : "the end", found.coil_rms_mm[i]});
  }
  page.figure(20.0 * static_cast<double>(bars.size()),
              "What is left of each coil, RMS across the tube, and of the tube's end along it",
              [&bars](Svg& svg, const ReportPage::Room& room) { draw_bars(svg, room, bars, "mm"); });
  page.heading("Remarks");
  for (const std::string& remark : fragment.remarks) page.text(remark);
  return page.str();
}

}  // namespace tubed
