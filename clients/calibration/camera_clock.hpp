// The clock of one camera from a recording of a tube that moves in view.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "clients/calibration/clock_offset.hpp"
#include "clients/calibration/coil_recording.hpp"
#include "clients/calibration/configuration_fragment.hpp"
#include "clients/calibration/tube_sightings.hpp"

namespace tubed {

/// The sightings as numbers of channels: one a coil, and one for the tube's end, which is where the first
/// coil and its direction have it. Predictions are means over 80 ms of the coils' tracks.
std::vector<SeenNumber> numbers_of(const std::vector<TubeSighting>& sightings, const Sequence& sequence);

struct CameraClock {
  std::string camera;
  double configured_s = 0;  ///< that was taken off the stamps before
  ClockOffset found;        ///< of what remains
  std::size_t images = 0;   ///< in which the tube was seen
  [[nodiscard]] double offset_s() const { return configured_s + found.offset_s; }
};

/// Images are read, the offset is found, images are read again where coils then have the tube, until it
/// stays. Throws CalibrationError when the camera has no images, coils were measured less than 22 times a
/// second, the tube was not seen, it moved too little to tell the offset to `max_sigma_s`, or no offset
/// explains the images clearly better than the others.
CameraClock measure_clock(const ConfiguredSequence& run, int camera, double max_sigma_s);

/// camera[NAME].time_offset_ms and .time_offset_sigma_ms of each.
ConfigurationFragment fragment_of(const std::vector<CameraClock>& clocks);

/// One page, SVG.
std::string page_of(const std::vector<CameraClock>& clocks, const ConfigurationFragment& fragment);

}  // namespace tubed
