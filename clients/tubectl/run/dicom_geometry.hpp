// How the C-arm stood for each image of a DICOM run, in the world of a configuration.
#pragma once

#ifdef TUBED_READS_DICOM_RUNS

#include <optional>
#include <string>
#include <vector>

#include "clients/dicom/dicom_run.hpp"
#include "idl/geometry/view_geometry.hpp"

namespace tubed {

/// One an image of the run; nothing for one whose file states no angles.
struct DicomGeometries {
  std::vector<std::optional<ViewGeometry>> of_frames;
  std::vector<std::string> remarks;  ///< what was taken from where
};

/// The C-arm of `camera` in the file `config`, with the angles that the run states for each image
/// (PositionerPrimaryAngle and its increments, likewise the secondary one) and, where it states them, with
/// its distances and pitch; place of the isocentre, table and principal point are the configuration's. The
/// poses' standard deviation is that of angles rounded as these are: 0.3 degrees for whole ones, otherwise
/// 0.1. Throws std::runtime_error for a configuration without that camera or its C-arm, for one that does not
/// take poses of images, and for a geometry that the daemon would refuse.
DicomGeometries geometries_of(const DicomRun& run, const std::string& config, const std::string& camera);

}  // namespace tubed

#endif
