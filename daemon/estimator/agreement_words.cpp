#include "daemon/estimator/agreement_words.hpp"

#include <cmath>
#include <cstdio>

namespace tubed {

namespace {

constexpr double kDegrees = 180 / std::numbers::pi;

// What explains it, and what to do, behind "NAME: coils and images disagree: ".
void write_explanation(const CoilImageAgreement::Verdict& verdict, const InstrumentDescription& instrument,
                       std::span<const CameraCalibration> cameras, std::span<char> text) {
  const auto index = static_cast<std::size_t>(verdict.index);
  switch (verdict.explanation) {
    case Discord::kNone:
      text[0] = '\0';
      return;
    case Discord::kRegistration:
      std::snprintf(text.data(), text.size(),
                    "all coils are off together, by about %.0f mm and %.1f degrees: check the registration "
                    "(T_world_em), the table, and the camera's pose",
                    verdict.shift_mm.norm(), verdict.turn_rad.norm() * kDegrees);
      return;
    case Discord::kArcLengths:
      std::snprintf(
          text.data(), text.size(),
          "the tube ends about %.0f mm further %s in the image than the coils' arc lengths say: check "
          "offset_from_tip_mm of all coils",
          std::abs(verdict.end_mm), verdict.end_mm < 0 ? "back" : "out");
      return;
    case Discord::kClock:
      std::snprintf(text.data(), text.size(),
                    "images are stamped about %.0f ms too %s against the coils: `tubectl calibrate time` "
                    "measures it for "
                    "time_offset_ms of [[camera]]",
                    std::abs(verdict.clock_s) * 1e3, verdict.clock_s > 0 ? "late" : "early");
      return;
    case Discord::kMagnification:
      std::snprintf(
          text.data(), text.size(),
          "the focal length of camera %s looks about %.0f %% too %s: check fx, fy and the distances",
          index < cameras.size() ? cameras[index].name.c_str() : "?", std::abs(verdict.magnification) * 100,
          verdict.magnification > 0 ? "large" : "small");
      return;
    case Discord::kField:
      std::snprintf(text.data(), text.size(),
                    "coils are off, each in its own way: look for metal near the field generator");
      return;
    case Discord::kCoil:
      std::snprintf(
          text.data(), text.size(),
          "coil %d (sensor %d) is off by about %.0f mm: check its offset_from_tip_mm, and whether it is bent",
          verdict.index + 1, index < instrument.coils.size() ? instrument.coils[index].sensor : 0,
          std::hypot(verdict.coil_mm.norm(), verdict.arc_length_mm));
      return;
    case Discord::kCoilArcLength:
      std::snprintf(text.data(), text.size(),
                    "coil %d (sensor %d) lies about %.0f mm %s the tip than its offset_from_tip_mm says: "
                    "`tubectl calibrate coils` measures it",
                    verdict.index + 1, index < instrument.coils.size() ? instrument.coils[index].sensor : 0,
                    std::abs(verdict.arc_length_mm),
                    verdict.arc_length_mm > 0 ? "nearer to" : "further from");
      return;
  }
}

}  // namespace

void write_disagreement(const CoilImageAgreement::Verdict& verdict, const InstrumentDescription& instrument,
                        std::span<const CameraCalibration> cameras, std::span<char> text) {
  if (text.empty()) {
    return;
  }
  const int begun =
      std::snprintf(text.data(), text.size(), "%.60s: coils and images disagree: ", instrument.id.c_str());
  const std::size_t used = std::min(static_cast<std::size_t>(std::max(begun, 0)), text.size() - 1);
  write_explanation(verdict, instrument, cameras, text.subspan(used));
}

}  // namespace tubed
