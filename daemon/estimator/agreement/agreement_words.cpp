#include "daemon/estimator/agreement/agreement_words.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "idl/geometry/degree.hpp"

namespace tubed {

namespace {

using CoilName = std::array<char, 48>;

// By its number from the tip and, where that is known, the tracker's.
CoilName name_of_coil(std::size_t index, const InstrumentDescription& instrument) {
  CoilName name{};
  const int sensor = index < instrument.coils.size() ? instrument.coils[index].sensor : 0;
  if (sensor > 0) {
    std::snprintf(name.data(), name.size(), "coil %zu (sensor %d)", index + 1, sensor);
  } else {
    std::snprintf(name.data(), name.size(), "coil %zu", index + 1);
  }
  return name;
}

const char* name_of_camera(std::size_t index, std::span<const CameraCalibration> cameras) {
  return index < cameras.size() ? cameras[index].name.c_str() : "?";
}

// Images that show the tube when they are read in another way.
void write_misreading(Discord reading, const char* camera, std::span<char> text) {
  if (reading == Discord::kNegative) {
    std::snprintf(text.data(), text.size(),
                  "images of camera %s show the tube when they are read as negatives: leave polarity "
                  "of [frangi] at \"auto\"",
                  camera);
  } else {
    std::snprintf(text.data(), text.size(),
                  "images of camera %s show the tube when they are mirrored left to right: say mirrored = "
                  "true (or leave it out) in its [[camera]]",
                  camera);
  }
}

// What explains it, and what to do, behind "NAME: coils and images disagree: ".
void write_explanation(const EmImageAgreement& agreement, const InstrumentDescription& instrument,
                       std::span<const CameraCalibration> cameras, std::span<char> text) {
  const auto index = static_cast<std::size_t>(agreement.index);
  switch (agreement.explanation) {
    case Discord::kNone:
      text[0] = '\0';
      return;
    case Discord::kRegistration:
      std::snprintf(text.data(), text.size(),
                    "all coils are off together, by about %.0f mm and %.1f degrees: check the registration "
                    "(T_world_em), the table, and the camera's pose",
                    length_of(agreement.shift_mm), length_of(agreement.turn_rad) / kDegree);
      return;
    case Discord::kArcLengths:
      std::snprintf(
          text.data(), text.size(),
          "the tube ends about %.0f mm further %s in the image than the coils' arc lengths say: check "
          "offset_from_tip_mm of all coils",
          static_cast<double>(std::abs(agreement.end_mm)), agreement.end_mm < 0 ? "back" : "out");
      return;
    case Discord::kClock:
      std::snprintf(text.data(), text.size(),
                    "images are stamped about %.0f ms too %s against the coils: `tubectl calibrate time` "
                    "measures it for "
                    "time_offset_ms of [[camera]]",
                    static_cast<double>(std::abs(agreement.clock_s)) * 1e3,
                    agreement.clock_s > 0 ? "late" : "early");
      return;
    case Discord::kMagnification:
      std::snprintf(
          text.data(), text.size(),
          "the focal length of camera %s looks about %.0f %% too %s: check fx, fy and the distances",
          name_of_camera(index, cameras), static_cast<double>(std::abs(agreement.magnification)) * 100,
          agreement.magnification > 0 ? "large" : "small");
      return;
    case Discord::kField:
      std::snprintf(text.data(), text.size(),
                    "coils are off, each in its own way: look for metal near the field generator");
      return;
    case Discord::kCoil:
      std::snprintf(text.data(), text.size(),
                    "%s is off by about %.0f mm: check its offset_from_tip_mm, and whether it is bent",
                    name_of_coil(index, instrument).data(),
                    std::hypot(length_of(agreement.coil_mm), static_cast<double>(agreement.arc_length_mm)));
      return;
    case Discord::kCoilArcLength:
      std::snprintf(text.data(), text.size(),
                    "%s lies about %.0f mm %s the tip than its offset_from_tip_mm says: "
                    "`tubectl calibrate coils` measures it",
                    name_of_coil(index, instrument).data(),
                    static_cast<double>(std::abs(agreement.arc_length_mm)),
                    agreement.arc_length_mm > 0 ? "nearer to" : "further from");
      return;
    case Discord::kNegative:
    case Discord::kMirrored:
      write_misreading(agreement.explanation, name_of_camera(index, cameras), text);
      return;
  }
}

}  // namespace

void write_disagreement(const EmImageAgreement& agreement, const InstrumentDescription& instrument,
                        std::span<const CameraCalibration> cameras, std::span<char> text) {
  if (text.empty()) {
    return;
  }
  const int begun =
      std::snprintf(text.data(), text.size(), "%.60s: coils and images disagree: ", instrument.id.c_str());
  const std::size_t used = std::min(static_cast<std::size_t>(std::max(begun, 0)), text.size() - 1);
  write_explanation(agreement, instrument, cameras, text.subspan(used));
}

void write_missing_marks(const InstrumentDescription& instrument, std::span<char> text) {
  std::snprintf(
      text.data(), text.size(),
      "%.60s: images do not show its marks where marks_mm has them: check marks_mm and mark_length_mm, "
      "and which catheter is in use",
      instrument.id.c_str());
}

void write_common_jump(const InstrumentDescription& instrument, double jump_mm, std::span<char> text) {
  std::snprintf(
      text.data(), text.size(),
      "%.60s: all coils have jumped by %.0f mm together, within the last minute: has metal come near "
      "the field generator, or was the patient moved? One sigma has %.0f mm of it where no image "
      "holds the shape",
      instrument.id.c_str(), jump_mm, std::sqrt(0.5) * jump_mm);
}

double length_of(const std::array<float, 3>& vector) {
  return static_cast<double>(std::hypot(vector[0], vector[1], vector[2]));
}

std::string explanation_of(const EmImageAgreement& agreement, const InstrumentDescription& instrument,
                           std::span<const CameraCalibration> cameras) {
  std::array<char, 192> text{};
  write_explanation(agreement, instrument, cameras, text);
  return text.data();
}

std::string describe_agreement(const EmImageAgreement& agreement, const InstrumentDescription& instrument,
                               std::span<const CameraCalibration> cameras) {
  if (agreement.probability <= 0) {
    return "coils and images were not compared yet";
  }
  std::array<char, 256> text{};
  const double as_stated_percent = 100 * static_cast<double>(agreement.as_stated);
  if (agreement.disagree && agreement.explanation != Discord::kNone) {
    std::snprintf(text.data(), text.size(), "coils and images disagree (as stated %.0f %%): %s",
                  as_stated_percent, explanation_of(agreement, instrument, cameras).c_str());
    return text.data();
  }
  std::snprintf(
      text.data(), text.size(),
      "coils and images agree (as stated %.0f %%): seen off by %.1f mm and %.1f degrees together, may be "
      "by %.1f and %.1f; %.1f mm along the tube, %.0f ms",
      as_stated_percent, length_of(agreement.shift_mm), length_of(agreement.turn_rad) / kDegree,
      static_cast<double>(agreement.unsure_mm), static_cast<double>(agreement.unsure_rad) / kDegree,
      static_cast<double>(agreement.arc_length_mm), static_cast<double>(agreement.clock_s) * 1e3);
  return text.data();
}

}  // namespace tubed
