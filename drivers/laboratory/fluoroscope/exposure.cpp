#include "drivers/laboratory/fluoroscope/exposure.hpp"

#include <algorithm>
#include <cmath>

#include "drivers/laboratory/fluoroscope/large_scale.hpp"
#include "drivers/laboratory/fluoroscope/pixel_kernels.hpp"

namespace tubed {

namespace {

constexpr float kPatient = 0.3F;  ///< line integrals below are air or skin

/// The value below which the share `part` of those values lies whose weight is not 0; 0 when there is none.
float quantile(std::span<const float> values, std::span<const float> weight, double part) {
  std::vector<float> chosen;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (weight[i] > 0) {
      chosen.push_back(values[i]);
    }
  }
  if (chosen.empty()) {
    return 0;
  }
  const auto at = static_cast<std::ptrdiff_t>(part * static_cast<double>(chosen.size() - 1));
  std::nth_element(chosen.begin(), chosen.begin() + at, chosen.end());
  return chosen[static_cast<std::size_t>(at)];
}

/// 1 in the patient, 0 beside; 1 everywhere when the patient is not in the picture.
std::vector<float> patient_mask(std::span<const float> attenuation) {
  std::vector<float> mask(attenuation.size());
  std::transform(attenuation.begin(), attenuation.end(), mask.begin(),
                 [](float a) { return a > kPatient ? 1.0F : 0.0F; });
  if (std::find(mask.begin(), mask.end(), 1.0F) == mask.end()) {
    std::fill(mask.begin(), mask.end(), 1.0F);
  }
  return mask;
}

}  // namespace

Exposure settled_exposure(std::span<const float> attenuation, int width, int height,
                          const DetectorSettings& detector, const DisplaySettings& display) {
  const std::vector<float> patient = patient_mask(attenuation);
  const std::vector<float> everywhere(attenuation.size(), 1.0F);
  std::vector<float> primary(attenuation.size());
  transmissions(attenuation, primary);

  std::vector<float> scattered(attenuation.size());
  std::transform(attenuation.begin(), attenuation.end(), primary.begin(), scattered.begin(),
                 [](float a, float p) { return a * p; });
  Exposure exposure;
  exposure.scatter_quanta = large_scale(scattered, everywhere, width, height, detector.scatter_width_px);
  const float spread = quantile(exposure.scatter_quanta, patient, 0.5);
  const float of_primary =
      spread > 0 ? static_cast<float>(detector.scatter_to_primary) * quantile(primary, patient, 0.5) / spread
                 : 0.0F;

  std::vector<float> logs(attenuation.size());
  for (std::size_t i = 0; i < logs.size(); ++i) {
    exposure.scatter_quanta[i] *= of_primary;
    logs[i] = primary[i] + exposure.scatter_quanta[i];
  }
  const double wanted = std::isfinite(detector.quanta_per_pixel) ? detector.quanta_per_pixel : 1e6;
  exposure.open_beam_quanta = static_cast<float>(wanted) / quantile(logs, patient, 0.5);
  for (float& quanta : exposure.scatter_quanta) {
    quanta *= exposure.open_beam_quanta;
  }

  negative_logs(logs);
  exposure.large_scale_log = large_scale(logs, patient, width, height, display.compression_width_px);
  const float middle = quantile(logs, patient, 0.5);
  for (std::size_t i = 0; i < logs.size(); ++i) {
    exposure.large_scale_log[i] =
        static_cast<float>(display.range_compression) * (exposure.large_scale_log[i] - middle);
    logs[i] -= exposure.large_scale_log[i];
  }
  const float low = quantile(logs, patient, 0.06);
  const float high = quantile(logs, patient, 0.985);
  const float half = std::max(0.60F * (high - low), 0.05F) / static_cast<float>(display.contrast);
  exposure.dark = (low + high) / 2 + half;
  exposure.bright = (low + high) / 2 - half;
  return exposure;
}

}  // namespace tubed
