// Where a view stands that moved without a word, as the estimator found it from coils and images.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>

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

/// In that estimate: of the camera that `camera` names, or of any (empty). Nothing while no pose is found.
/// Where one view moved and another one brings its geometry with each image, the estimate does not tell which
/// is which: throws CalibrationError that asks for `camera` when several have a pose of their own.
std::optional<FoundView> found_view_in(const TubeEstimate& estimate, const RoomDescription& room,
                                       const std::string& camera);

/// Of estimates in the order of time, the pose that holds at the end.
class FoundViewSearch {
 public:
  FoundViewSearch(const RoomDescription& room, std::string camera)
      : room_(room), camera_(std::move(camera)) {}

  /// Throws as found_view_in().
  void take(const TubeEstimate& estimate);

  /// Nothing when the view is back, has moved on, or was never found.
  [[nodiscard]] const std::optional<FoundView>& found() const { return found_; }
  [[nodiscard]] bool has_moved() const { return has_moved_; }

 private:
  const RoomDescription& room_;
  std::string camera_;
  std::optional<FoundView> found_;
  std::int64_t found_ns_ = 0;
  bool has_moved_ = false;
};

/// That of a recording, which is reconstructed for it. Throws CalibrationError when the view did not move, it
/// was not found where to, or the estimator's mode does not look for it.
FoundView find_view(const ConfiguredSequence& run, const std::string& camera);

/// camera.T_camera_world and its sigma; the focal lengths as well where the magnification changed.
ConfigurationFragment fragment_of(const FoundView& found);

}  // namespace tubed
