// Where a view stands that moved without a word, as the estimator found it from coils and images.
#pragma once

#include <optional>
#include <string>

#include "clients/calibration/configuration_fragment.hpp"
#include "clients/evaluation/configured_sequence.hpp"
#include "idl/estimate.hpp"

namespace tubed {

/// The pose that shapes of GEOMETRY_CHANGED use.
struct FoundView {
  std::string camera;  ///< its name
  ViewUsed view;
  double focal_ratio = 1;  ///< its focal length over the configured one
};

/// In that estimate: of the camera that `camera` names, or the only one (empty). Nothing while no pose is
/// found. An image that brings a geometry of its own needs none: nothing either.
std::optional<FoundView> found_view_in(const TubeEstimate& estimate, const RoomDescription& room,
                                       const std::string& camera);

/// That of the newest shape of a recording, which is reconstructed for it. Throws CalibrationError when the
/// view did not move, or it was not found where to.
FoundView find_view(const ConfiguredSequence& run, const std::string& camera);

/// camera.T_camera_world and its sigma; the focal lengths as well where the magnification changed.
ConfigurationFragment fragment_of(const FoundView& found);

}  // namespace tubed
