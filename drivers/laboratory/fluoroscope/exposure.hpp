// How bright an empty picture of the patient is and how it is shown: fixed for a run.
#pragma once

#include <span>
#include <vector>

#include "drivers/laboratory/fluoroscope/radiograph_settings.hpp"

namespace tubed {

/// What automatic exposure control and the console settle on from the patient at rest.
struct Exposure {
  float open_beam_quanta = 0;          ///< a pixel, without patient
  std::vector<float> scatter_quanta;   ///< a pixel
  std::vector<float> large_scale_log;  ///< what range compression takes from -log of each pixel
  float dark = 1, bright = 0;          ///< the window, in compressed -log
};

/// `attenuation`: line integrals of the patient at rest, row by row. Scatter comes from where attenuation
/// takes place: the primary times the attenuation, spread out.
Exposure settled_exposure(std::span<const float> attenuation, int width, int height,
                          const DetectorSettings& detector, const DisplaySettings& display);

}  // namespace tubed
