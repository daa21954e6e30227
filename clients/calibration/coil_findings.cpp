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

/// Of any list of coils with sensor, stated_mm, found_mm, sigma_mm and was_found.
template <typename Coils>
void add_offsets(const Coils& coils, const std::string& instrument_id, bool from_tip,
                 ConfigurationFragment& fragment) {
  for (std::size_t k = 0; k < coils.size(); ++k) {
    const auto& coil = coils[k];
    if (!coil.was_found) {
      fragment.remarks.push_back(
          words("coil %zu (sensor %d) stays at %.1f mm", k + 1, coil.sensor, coil.stated_mm));
      continue;
    }
    fragment.remarks.push_back(change_words(k, coil.sensor, coil.stated_mm, coil.found_mm, coil.sigma_mm));
    fragment.values.push_back(
        {path_of(instrument_id, k, "offset_from_tip_mm"), rounded(coil.found_mm, 0.01)});
    if (from_tip) {
      fragment.values.push_back({path_of(instrument_id, k, "offset_sigma_mm"), rounded(coil.sigma_mm, 0.01)});
    }
  }
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
  add_offsets(found.coils, instrument_id, found.has_tip, fragment);
  return fragment;
}

ConfigurationFragment fragment_of(const ArcLengths& found, const std::string& instrument_id) {
  ConfigurationFragment fragment;
  fragment.found_by = words("tubectl calibrate arc-lengths, %d measurements, the end in %zu images",
                            found.pieces.front().measurements, found.ends_seen);
  fragment.date = date_of_today();
  if (found.ends_seen == 0) {
    fragment.remarks.emplace_back(
        "the tube's end was seen in too few images: only distances between coils, the first one stays as "
        "stated");
  } else {
    fragment.remarks.push_back(
        words("where the tube's end lies beyond the first coil scatters by %.1f mm from image to image",
              found.end_scatter_mm));
  }
  for (std::size_t k = 0; k < found.pieces.size(); ++k) {
    const MeasuredPiece& piece = found.pieces[k];
    fragment.remarks.push_back(
        words("from coil %zu to coil %zu: %.1f mm before, %.1f mm now, sigma %.2f mm, one measurement "
              "scatters by %.1f mm",
              k + 1, k + 2, piece.stated_mm, piece.found_mm, piece.sigma_mm, piece.scatter_mm));
  }
  add_offsets(found.coils, instrument_id, found.ends_seen > 0, fragment);
  return fragment;
}

ConfigurationFragment fragment_of(const StillNoise& noise, double field_axis_mm) {
  return fragment_of_noise(noise, "still", field_axis_mm);
}

ConfigurationFragment fragment_of(const MovingNoise& noise, double field_axis_mm) {
  return fragment_of_noise(noise, "moving", field_axis_mm);
}

}  // namespace tubed
