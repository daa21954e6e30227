// The door of the image half: what cannot be an X-ray image is refused before it is measured.
#pragma once

#include "daemon/image/image_measurement.hpp"
#include "idl/geometry/camera.hpp"

namespace tubed {

/// Lets in the images of one camera, and says how its view stood for each. Called by one thread (that
/// camera's Frangi stage); never allocates after construction.
class ImageDoor {
 public:
  /// As `camera` has white level, use of the images' geometry, and mirrored rows.
  explicit ImageDoor(CameraCalibration camera)
      : camera_(std::move(camera)), configured_(static_cast<float>(camera_.white_level)) {}

  /// `white_level`: grey value of a pixel that is saturated. 0: learnt. A detector of 10, 12 or 14 bits that
  /// delivers words of 16 saturates far below the greatest word; until one of its pixels was brighter, its
  /// white level is taken for the least of 255, 1023, 4095, 16383 and 65535 that no pixel has passed.
  explicit ImageDoor(double white_level = 0) : configured_(static_cast<float>(white_level)) {}

  /// From here on an image without a geometry of its own was taken with this one instead of the one given at
  /// construction.
  void look_from(const ViewGeometry& configured) {
    camera_.look_from(configured);
    looks_from_ = configured;
  }

  /// Copies the pixels of `frame` into `measurement.grey` (reserved for the camera's size), with depth,
  /// darkest, brightest and geometry, and says whether they can be used: size as configured, a geometry where
  /// one is required and none that cannot be (refusal_of()), not bit by bit equal to the image before, not
  /// saturated (more than half of the pixels at the white level), not even (spread of less than a 255th of
  /// the white level).
  ImageRejection take(const ImageFrame& frame, ImageMeasurement& measurement);

  /// What is wrong with the geometry of the newest image that was refused for it.
  [[nodiscard]] const char* geometry_fault() const { return geometry_fault_; }

  /// Of images like the last one; 0 before the first of a door that learns.
  [[nodiscard]] float white_level() const { return configured_ > 0 ? configured_ : learnt_; }

 private:
  ImageRejection take_geometry(const ImageFrame& frame, ImageMeasurement& measurement);

  CameraCalibration camera_;
  std::optional<ViewGeometry> looks_from_;  ///< nothing: as at construction
  const char* geometry_fault_ = "";
  float configured_;
  float learnt_ = 0;
  std::uint64_t previous_sum_ = 0;  ///< over the pixels of the last image
};

}  // namespace tubed
