// A camera from images of a phantom: what is found, how well it is known, and what looks wrong.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "clients/calibration/ball_detection.hpp"
#include "clients/calibration/ball_phantom.hpp"
#include "clients/calibration/c_arm_fit.hpp"
#include "clients/calibration/chequerboard.hpp"
#include "clients/calibration/configuration_fragment.hpp"
#include "clients/calibration/fit_choice.hpp"
#include "clients/calibration/report_page.hpp"

namespace tubed {

/// What a person says of the camera beside the images.
struct CameraSettings {
  std::string camera;                  ///< its name in the configuration
  bool mirrored = false;               ///< images are read from right to left
  std::optional<double> focal_px;      ///< known and held
  std::vector<GantryAngles> angles{};  ///< one an image, or none
  std::optional<double> pixel_pitch_mm;
  std::optional<double> source_detector_mm;
  std::optional<double> source_isocentre_mm;
  BallLook look{};
  /// The camera as it is configured, for comparison.
  std::optional<CameraCalibration> configured{};
};

/// What was found on one image.
struct CalibratedImage {
  std::string name;
  std::vector<FoundBall> found;  ///< in the image that `mirrored` makes; empty with a chequerboard
  std::size_t in_image = 0;      ///< points that have to be there
  std::size_t matched = 0;       ///< points that were found and named
  double clipped_share = 0;      ///< CalibrationPicture::clipped_share()
};

/// A sentence of the verdict.
struct CameraStatement {
  ReportVerdict verdict;
  std::string words;
};

struct CameraFindings {
  CameraSettings settings;
  int width = 0, height = 0;  ///< px
  bool mirrored = false;      ///< found, or as the settings have it
  std::vector<CalibratedImage> images;
  ChosenFit chosen;
  ResidualPattern pattern;
  double distortion_px = 0;  ///< largest displacement in the image
  std::optional<CArmFit> c_arm;
  std::vector<std::string> point_names;  ///< of the phantom
  std::vector<CameraStatement> statements;

  /// Nothing speaks against its use.
  [[nodiscard]] bool is_usable() const;
  /// With the pose of the first image.
  [[nodiscard]] CameraCalibration calibration() const;
};

/// From radiographs of a phantom of balls. Throws PhantomError when no camera comes of it: images of
/// different size, too few balls, no pose that explains them, a plane in one image.
CameraFindings calibrate_with_balls(const std::vector<CalibrationPicture>& pictures,
                                    const BallPhantom& phantom, const CameraSettings& settings);

/// From pictures of a chequerboard. The world is the board on the first picture. Throws PhantomError.
CameraFindings calibrate_with_board(const std::vector<CalibrationPicture>& pictures,
                                    const Chequerboard& board, const CameraSettings& settings);

/// The values for the configuration: fx .. T_camera_world, or c_arm.* where angles were given, and how well
/// they are known.
ConfigurationFragment fragment_of(const CameraFindings& findings);

}  // namespace tubed
