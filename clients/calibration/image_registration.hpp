// The registration from a recording with images: coils lie on the tube that views from two directions show.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "clients/calibration/coil_recording.hpp"
#include "clients/calibration/configuration_fragment.hpp"
#include "clients/calibration/rigid_correction.hpp"
#include "clients/evaluation/configured_sequence.hpp"
#include "idl/geometry/rigid_transform.hpp"

namespace tubed {

struct ImageRegistration {
  RigidTransform T_world_em = RigidTransform::Identity();  ///< the corrected one
  RigidCorrection correction;  ///< of the recording's; its covariance is that of the corrected one
  std::size_t images = 0;      ///< in which the tube was seen beside a coil
  std::size_t sightings = 0;
  double apart_rad = 0;  ///< the largest angle between two directions of view
  std::vector<double>
      coil_rms_mm;  ///< what is left of each coil, across, and of the tube's end, along; 0: never seen
};

struct ImageRegistrationSettings {
  double max_sigma_mm = 2;  ///< what is known worse along some direction is refused
  /// What the tracker's field may shift all coils of the recording by alike, standard deviation an axis; it
  /// turns them by as much at 100 mm. It cannot be told from a registration, and is added to the covariance.
  double field_mm = 1;
};

/// Images are read, the correction is found, images are read again where coils then have the tube, until it
/// stays. Throws CalibrationError when there are no images, the tube was seen too seldom, or the shift stays
/// unknown to more than max_sigma_mm along some direction, as it does along the rays of a single direction of
/// view.
ImageRegistration register_by_images(const ConfiguredSequence& run,
                                     const ImageRegistrationSettings& settings);

/// em.T_world_em, its covariance about the coils' places, and what is left.
ConfigurationFragment fragment_of(const ImageRegistration& found);

/// One page, SVG.
std::string page_of(const ImageRegistration& found, const ConfigurationFragment& fragment);

}  // namespace tubed
