#include "clients/calibration/coil_findings.hpp"

#include <array>
#include <cmath>
#include <cstdio>

namespace tubed {

namespace {

std::string words(const char* format, auto... values) {
  std::array<char, 320> text{};
  std::snprintf(text.data(), text.size(), format, values...);
  return text.data();
}

constexpr double kArcLengthStep_mm = 0.01;  // to which arc lengths are written

/// Divided at the end, not multiplied: 90.35, not 90.35000000000001.
double rounded(double value, double step) { return std::round(value / step) / std::round(1 / step); }

std::string path_of(const std::string& instrument_id, std::size_t coil, const char* key) {
  return "instrument[" + instrument_id + "].coil[" + std::to_string(coil + 1) + "]." + key;
}

/// Before and after of one coil, with a warning where much changes.
std::string change_words(std::size_t coil, int sensor, double stated_mm, double found_mm, double sigma_mm) {
  std::string text = words("coil %zu (sensor %d): %.1f mm before, %.1f mm now (%+.1f), sigma %.2f mm",
                           coil + 1, sensor, stated_mm, found_mm, found_mm - stated_mm, sigma_mm);
  if (std::abs(found_mm - stated_mm) > kNotedChange_mm) {
    text +=
        words("; WARNING: by more than %.0f mm: every shape changes; is it the catheter that is configured?",
              kNotedChange_mm);
  }
  return text;
}

/// Of any list of coils with sensor, stated_mm, found_mm and sigma_mm; `stays` says of which nothing is
/// offered.
template <typename Coils, typename Stays>
void add_offsets(const Coils& coils, const std::string& instrument_id, bool from_tip, Stays stays,
                 ConfigurationFragment& fragment) {
  for (std::size_t k = 0; k < coils.size(); ++k) {
    const auto& coil = coils[k];
    if (stays(coil)) {
      fragment.remarks.push_back(
          words("coil %zu (sensor %d) stays at %.1f mm", k + 1, coil.sensor, coil.stated_mm));
      continue;
    }
    fragment.remarks.push_back(change_words(k, coil.sensor, coil.stated_mm, coil.found_mm, coil.sigma_mm));
    fragment.values.push_back(
        {path_of(instrument_id, k, "offset_from_tip_mm"), rounded(coil.found_mm, kArcLengthStep_mm)});
    if (from_tip) {
      fragment.values.push_back(
          {path_of(instrument_id, k, "offset_sigma_mm"), rounded(coil.sigma_mm, kArcLengthStep_mm)});
    }
  }
}

/// Stated and measured length of a piece, and which of both is taken.
std::string piece_words(const std::string& name, const MeasuredPiece& piece) {
  return name +
         words(
             ": %.1f mm stated, %.1f mm measured (%+.1f), sigma %.2f mm, one measurement scatters by "
             "%.1f mm; ",
             piece.stated_mm, piece.found_mm, piece.change_mm(), piece.sigma_mm, piece.scatter_mm) +
         (piece.is_lone_coil ? "taken, as if one coil alone were elsewhere"
          : piece.is_changed ? "taken as measured"
                             : "no more than chance, stays as stated");
}

void add_remarks(const std::vector<std::string>& remarks, ConfigurationFragment& fragment) {
  fragment.remarks.insert(fragment.remarks.end(), remarks.begin(), remarks.end());
}

/// Of StillNoise or MovingNoise.
template <typename Noise>
ConfigurationFragment fragment_of_noise(const Noise& noise, const char* how, double field_axis_mm) {
  ConfigurationFragment fragment;
  fragment.found_by = words("tubectl calibrate noise, %zu %s coils", noise.coils.size(), how);
  fragment.date = date_of_today();
  fragment.remarks.push_back(words("white noise of a measurement: %.3f mm an axis, direction %.5f an axis",
                                   noise.position_mm, noise.tangent));
  add_remarks(noise.remarks, fragment);
  if (field_axis_mm < 0) {
    fragment.remarks.push_back(
        words("sigma_position_mm and sigma_tangent are noise and the field's error together: %s coils do not "
              "show the field, so that neither is set; see --places and --field-mm",
              how));
    return fragment;
  }
  const double total_mm = std::hypot(noise.position_mm, field_axis_mm);
  fragment.remarks.push_back(
      words("the field's error: %.2f mm an axis; together %.2f mm", field_axis_mm, total_mm));
  fragment.remarks.emplace_back("sigma_tangent stays: places say nothing about directions");
  fragment.values.push_back({"estimator.sigma_position_mm", rounded(total_mm, 0.01)});
  return fragment;
}

}  // namespace

ConfigurationFragment fragment_of(const StraightCatheter& found, const std::string& instrument_id) {
  ConfigurationFragment fragment;
  fragment.found_by = words("tubectl calibrate coils, %d placement%s of the groove", found.placements,
                            found.placements == 1 ? "" : "s");
  fragment.date = date_of_today();
  if (!found.has_tip) {
    fragment.remarks.emplace_back("only distances between coils: the first one stays as stated");
  }
  add_remarks(found.remarks, fragment);
  add_offsets(
      found.coils, instrument_id, found.has_tip, [](const StraightCoil& coil) { return !coil.was_found; },
      fragment);
  return fragment;
}

ConfigurationFragment fragment_of(const ArcLengths& found, const std::string& instrument_id) {
  ConfigurationFragment fragment;
  fragment.found_by = words("tubectl calibrate arc-lengths, %d measurements, the end in %d images",
                            found.pieces.front().measurements, found.end.measurements);
  fragment.date = date_of_today();
  if (!found.has_end()) {
    fragment.remarks.emplace_back(
        "the tube's end was seen in too few images: only distances between coils, the first one stays as "
        "stated");
  } else {
    fragment.remarks.push_back(piece_words("from the tube's end, as images show it, to coil 1", found.end));
  }
  for (std::size_t k = 0; k < found.pieces.size(); ++k) {
    fragment.remarks.push_back(
        piece_words(words("from coil %zu to coil %zu", k + 1, k + 2), found.pieces[k]));
  }
  const auto stays = [](const MeasuredCoil& coil) {
    return !coil.was_found || std::abs(coil.change_mm()) < kArcLengthStep_mm / 2;
  };
  add_offsets(found.coils, instrument_id, found.has_end(), stays, fragment);
  if (fragment.values.empty()) {
    fragment.remarks.emplace_back(
        "every arc length is as stated as far as this recording tells; --all takes what was measured");
  }
  return fragment;
}

ConfigurationFragment fragment_of(const StillNoise& noise, double field_axis_mm) {
  return fragment_of_noise(noise, "still", field_axis_mm);
}

ConfigurationFragment fragment_of(const MovingNoise& noise, double field_axis_mm) {
  return fragment_of_noise(noise, "moving", field_axis_mm);
}

}  // namespace tubed
