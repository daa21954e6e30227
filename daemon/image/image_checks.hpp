// The door of the image half: what cannot be an X-ray image is refused before it is measured.
#pragma once

#include "daemon/image/detector_response.hpp"
#include "daemon/image/image_measurement.hpp"
#include "daemon/image/measured_view.hpp"
#include "daemon/image/temporal_filter.hpp"
#include "idl/geometry/camera.hpp"

namespace tubed {

/// Lets in the images of one camera, and says how its view stood for each. Called by one thread (that
/// camera's Frangi stage); never allocates after construction.
class ImageDoor {
 public:
  /// As `camera` has size, white level, response, use of the images' geometry, and mirrored rows. Squares of
  /// `binning` pixels a side become one: see binning_of().
  explicit ImageDoor(CameraCalibration camera, int binning = 1)
      : camera_(std::move(camera)),
        binning_(binning),
        configured_(static_cast<float>(camera_.white_level)),
        sums_(static_cast<std::size_t>(camera_.width / binning * binning)),
        averaging_(camera_.width / binning, camera_.height / binning),
        undoing_(camera_.width / binning, camera_.height / binning) {}

  /// `white_level`: grey value of a pixel that is saturated. 0: learnt. A detector of 10, 12 or 14 bits that
  /// delivers words of 16 saturates far below the greatest word; until one of its pixels was brighter, its
  /// white level is taken for the least of 255, 1023, 4095, 16383 and 65535 that no pixel has passed.
  explicit ImageDoor(double white_level = 0) : configured_(static_cast<float>(white_level)) {
    camera_.response = DetectorResponse::kLog;
    camera_.time_averaging = TimeAveraging::kKeep;
  }

  /// From here on an image without a geometry of its own was taken with this one instead of the one given at
  /// construction.
  void look_from(const ViewGeometry& configured) {
    camera_.look_from(configured);
    looks_from_ = binned(configured, binning_);
  }

  /// Copies the pixels of `frame` into `measurement.grey` (reserved for the size of binned()), with darkest,
  /// brightest and the geometry of what was copied, and says whether they can be used: size as configured, a
  /// geometry where one is required and none that cannot be (refusal_of()), not bit by bit equal to the image
  /// before, not saturated (more than half of the pixels at the white level), not even (spread of less than a
  /// 255th of the white level). What a console has averaged over time is taken apart again, unless the
  /// camera keeps it: see TemporalFilterFinder. A linear detector's are copied as logarithms: see LogTable.
  /// `measurement` says when it was exposed.
  ImageRejection take(const ImageFrame& frame, ImageMeasurement& measurement);

  /// What is wrong with the geometry of the newest image that was refused for it.
  [[nodiscard]] const char* geometry_fault() const { return geometry_fault_; }

  /// Of images like the last one; 0 before the first of a door that learns.
  [[nodiscard]] float white_level() const { return configured_ > 0 ? configured_ : learnt_; }

  /// What is of earlier images in each image, and is undone.
  [[nodiscard]] const TemporalFilter& averaging() const { return averaging_.filter(); }
  /// Less of them where something moves: see MotionGhosts.
  [[nodiscard]] bool averaging_gives_way() const { return averaging_.ghosts().are_there(); }

  /// Are grey values intensities, of which the logarithm is taken? With response "auto" as the newest image
  /// of 16-bit words showed that could show it first; of images of 8 bits never.
  [[nodiscard]] bool is_linear() const {
    return camera_.response == DetectorResponse::kLinear ||
           (camera_.response == DetectorResponse::kAuto && finder_.is_linear());
  }

 private:
  /// Of the pixels of a frame.
  struct GreyRange {
    float least = 0;
    float greatest = 0;
  };

  ImageRejection take_geometry(const ImageFrame& frame, ImageMeasurement& measurement);
  template <typename Pixel>
  ImageRejection take_pixels(const ImageFrame& frame, ImageMeasurement& measurement);
  void undo_averaging(float white, ImageMeasurement& measurement);
  void take_logarithms(float white, ImageMeasurement& measurement);
  template <typename Pixel>
  GreyRange copy(const ImageFrame& frame, ImageMeasurement& measurement);
  template <typename Pixel>
  GreyRange average(const ImageFrame& frame, ImageMeasurement& measurement);
  [[nodiscard]] bool has_size_of_camera(const ImageFrame& frame, const ImageMeasurement& measurement) const;

  CameraCalibration camera_;
  int binning_ = 1;
  std::optional<ViewGeometry> looks_from_;  ///< nothing: as at construction
  const char* geometry_fault_ = "";
  float configured_;
  float learnt_ = 0;
  std::uint64_t previous_sum_ = 0;  ///< over the pixels of the last image
  ResponseFinder finder_;
  LogTable logs_;
  std::vector<std::uint32_t> sums_;  ///< scratch: of each column of a row of squares
  TemporalFilterFinder averaging_{0, 0};
  TemporalFilterInverse undoing_{0, 0};
};

}  // namespace tubed
