// A CT series as the patient of the simulated fluoroscope.
#pragma once

#include <filesystem>
#include <stdexcept>

#include "drivers/laboratory/fluoroscope/attenuation_volume.hpp"

namespace tubed {

/// A folder that cannot be used as a CT series; the message says which file, what is wrong and what to do.
class CtSeriesError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// How Hounsfield units become attenuation, and where the patient lies.
struct CtSeriesSettings {
  double water_attenuation_per_mm = 0.0205;  ///< at the beam's effective energy, about 65 keV
  /// From DICOM's patient frame (x left, y posterior, z superior, mm) to the room.
  RigidTransform T_room_patient = RigidTransform::Identity();
};

/// Reads the one CT series in `folder` (files that are no DICOM are passed over; sub-folders are not looked
/// at). Slices may come in any order and orientation, evenly spaced. Throws CtSeriesError: no such folder, no
/// DICOM file in it, another modality than CT, two series, slices of different size, missing or doubled
/// slices, a geometry that is no CT's (for example spacings in metres), compressed pixels.
AttenuationVolume read_ct_series(const std::filesystem::path& folder, const CtSeriesSettings& settings = {});

}  // namespace tubed
