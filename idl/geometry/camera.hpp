// Pinhole camera with OpenCV's distortion (k1 k2 p1 p2 k3). Camera frame: x right, y down, z along the view
// (depth); image: px, the centre of the first pixel is (0, 0).
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "idl/geometry/rigid_transform.hpp"
#include "idl/geometry/view_geometry.hpp"
#include "idl/settings/bound_key.hpp"

namespace tubed {

inline constexpr double kMinFocal_px = 1;
inline constexpr double kMaxFocal_px = 1e6;
inline constexpr double kMaxPrincipal_px = 1e4;
inline constexpr double kMaxMaskPlace_px = 8192;
inline constexpr std::size_t kMaxMasks = 16;

/// What a detector's grey values are of the X-rays that reach a pixel.
enum class DetectorResponse {
  kAuto,    ///< found from the noise of its images
  kLinear,  ///< their intensity
  kLog,     ///< its logarithm, or whatever a console shows: used as it is
};

/// What is done about images that a console averages over time.
enum class TimeAveraging {
  kUndo,  ///< found from the noise of its images, and undone
  kKeep,  ///< nothing
};

/// Calibration of one view, as configuration and sequence folders give it.
struct CameraCalibration {
  std::string name;
  int width = 0;                       ///< px
  int height = 0;                      ///< px
  double fx = 0, fy = 0;               ///< focal lengths, px
  double cx = 0, cy = 0;               ///< principal point, px
  std::array<double, 5> distortion{};  ///< k1 k2 p1 p2 k3, OpenCV's order
  RigidTransform T_camera_world = RigidTransform::Identity();
  double white_level = 0;  ///< grey value of a saturated pixel of its detector; 0: not known
  DetectorResponse response = DetectorResponse::kAuto;
  TimeAveraging time_averaging = TimeAveraging::kUndo;
  int binning =
      0;  ///< squares of so many pixels a side are measured as one: 1, 2, 4, 8; 0: by the tube's width
  int averaged = 1;  ///< each of its pixels is such a square of the detector's already, so many a side
  GeometryUse geometry = GeometryUse::kImage;  ///< of what images bring of their own
  /// Its images come as seen from the detector, as displays show them: rows are read from right to left, and
  /// pixel coordinates count in what that makes.
  bool mirrored = false;
  /// Rectangles of its images that show no X-rays, such as burnt-in text: x, y, width and height of each, one
  /// after the other, in pixels as the source delivers them (before `mirrored`). See masks_of().
  std::vector<int> masks{};
  double source_isocentre_mm = 0;  ///< of the C-arm behind it; 0: not known
  double source_detector_mm = 0;   ///< the same
  /// By which its images' time stamps, as the source gives them, are late against the tracker's: the exposure
  /// is the stamp less this. Negative: they are early.
  double time_offset_ms = 0;
  /// How well `tubectl calibrate camera` knew what it wrote; nothing: it did not say. Standard deviations.
  std::optional<double> calibration_residual_px{};  ///< RMS distance of found points from where they project
  /// Of the pose's shift and turn along and about the camera's axes, as PoseSigma has them with the pivot at
  /// the depth of the phantom, each with all that intrinsics leave open.
  std::optional<std::array<double, 3>> pose_sigma_mm{};
  std::optional<std::array<double, 3>> pose_sigma_deg{};
  std::optional<double> focal_sigma{};           ///< of fx, relative
  std::optional<double> time_offset_sigma_ms{};  ///< of `tubectl calibrate time`

  /// A point that this view surely sees: the isocentre where it is known, otherwise the point of the optical
  /// axis nearest to the world's origin; nothing when that lies behind the camera.
  [[nodiscard]] std::optional<Eigen::Vector3d> looked_at_world_mm() const;

  /// Takes intrinsics and pose of `view`. Never allocates.
  void look_from(const ViewGeometry& view);
};

/// Of a [[camera]]: its name and where points are in its images, all required but the distortion.
inline BoundKeys<CameraCalibration> camera_intrinsics_keys() {
  using S = CameraCalibration;
  const KeyRange size_px{64, 2048};
  const KeyRange focal_px{kMinFocal_px, kMaxFocal_px};
  const KeyRange principal_px{-kMaxPrincipal_px, kMaxPrincipal_px};
  const auto number = [](const char* name, auto member, KeyRange range, const char* meaning,
                         const char* example) {
    return key::required(key::number(name, member, "px", range, meaning), example);
  };
  const auto live_number = [number](const char* name, auto member, KeyRange range, const char* meaning,
                                    const char* example, const char* replaced_by = "") {
    BoundKey<S> bound = number(name, member, range, meaning, example);
    bound.key.takes_effect = TakesEffect::kAtOnce;
    bound.key.replaced_by = replaced_by;
    return bound;
  };
  return {
      key::required(key::text("name", &S::name, key::published_name(32), "name of the view, unique"),
                    "\"A\""),
      number("width", &S::width, size_px, "width of the image", "400"),
      number("height", &S::height, size_px, "height of the image", "600"),
      live_number("fx", &S::fx, focal_px, "focal length along x", "2000.0", "c_arm"),
      live_number("fy", &S::fy, focal_px, "focal length along y", "2000.0", "c_arm"),
      live_number("cx", &S::cx, principal_px, "principal point, x; the first pixel's centre is 0", "200.0"),
      live_number("cy", &S::cy, principal_px, "principal point, y; the first pixel's centre is 0", "300.0"),
      key::numbers("distortion", &S::distortion, "", {-1000, 1000}, {5, 5},
                   "k1 k2 p1 p2 k3, as OpenCV defines them")};
}

/// What its grey values are, and what of its images is looked at, when.
inline BoundKeys<CameraCalibration> camera_image_keys() {
  using S = CameraCalibration;
  return {
      key::number("white_level", &S::white_level, "grey levels", {0, 65535},
                  "of a saturated pixel, such as 4095 of a detector of 12 bits; 0 = learnt from the images"),
      key::word(
          "response", &S::response,
          {{DetectorResponse::kAuto, "auto"},
           {DetectorResponse::kLinear, "linear"},
           {DetectorResponse::kLog, "log"}},
          "what grey values are of the X-rays. linear: their intensity, of which the logarithm is taken; "
          "log: a logarithm, or as a console shows it; auto: found from the noise of images of more "
          "than 8 bits"),
      key::word("time_averaging", &S::time_averaging,
                {{TimeAveraging::kUndo, "undo"}, {TimeAveraging::kKeep, "keep"}},
                "consoles average images over time, and what moves lags. undo: how much is found from the "
                "noise of the images, and taken out again; keep: images are measured as they come"),
      key::word("binning", &S::binning, {{0, "auto"}, {1, "1"}, {2, "2"}, {4, "4"}, {8, "8"}},
                "squares of so many pixels a side are measured as one; auto: as many as make the tube 3.5 to "
                "7 px wide, 1 where it is narrower"),
      key::word(
          "geometry", &S::geometry,
          {{GeometryUse::kConfiguration, "configuration"},
           {GeometryUse::kImage, "image"},
           {GeometryUse::kRequired, "required"}},
          "whose intrinsics and pose hold. configuration: those here, for every image; image: those that an "
          "image brings, those here where it brings none; required: an image that brings none is "
          "refused"),
      key::flag("mirrored", &S::mirrored,
                "images come as seen from the detector, as displays show them: each row is read from right "
                "to left before anything else, and fx .. T_camera_world are of what that makes"),
      key::optional(
          key::numbers(
              "masks", &S::masks, "px", {0, kMaxMaskPlace_px}, {0, 4 * kMaxMasks},
              "what of its images shows no X-rays, such as burnt-in text: x, y, width, height of each "
              "rectangle, one after the other, in the images as they come (of a card: as crop is). Covered "
              "before anything "
              "else sees them; nothing is looked for there"),
          std::vector<std::int64_t>{0, 0, 160, 24}),
      key::number(
          "time_offset_ms", &S::time_offset_ms, "ms", {-1000, 1000},
          "by which the time stamps of its source are late against the tracker's: the exposure is the "
          "stamp less this; negative: they are early. `tubectl calibrate time` finds it")};
}

/// T_camera_world, which is checked and set by whoever reads it.
inline BoundKey<CameraCalibration> camera_pose_key() {
  KeyDescription pose = key::required(
      key::transform("T_camera_world", "p_camera = T_camera_world * p_world; x right, y down, z depth"),
      "[[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 1200], [0, 0, 0, 1]]");
  pose.takes_effect = TakesEffect::kAtOnce;
  pose.replaced_by = "c_arm";
  return {std::move(pose)};
}

/// How well a calibration knew what it wrote, all optional.
inline BoundKeys<CameraCalibration> camera_sigma_keys() {
  using S = CameraCalibration;
  const auto found = [](const char* name, auto member, std::size_t count, const char* unit, double maximum,
                        const char* meaning, SettingValue shown) {
    BoundKey<S> bound = key::optional(key::numbers(name, member, unit, {0, maximum}, {count, count}, meaning),
                                      std::move(shown));
    bound.key.takes_effect = TakesEffect::kAtOnce;
    return bound;
  };
  const auto found_number = [](const char* name, auto member, const char* unit, double maximum,
                               const char* meaning, double shown) {
    BoundKey<S> bound = key::optional(key::number(name, member, unit, {0, maximum}, meaning), shown);
    bound.key.takes_effect = TakesEffect::kAtOnce;
    return bound;
  };
  return {
      found_number(
          "calibration_residual_px", &S::calibration_residual_px, "px", 1000,
          "RMS distance of the phantom's points from where they project; of tubectl calibrate camera", 0.1),
      found("pose_sigma_mm", &S::pose_sigma_mm, 3, "mm", 1000,
            "standard deviation of the pose along the camera's axes x, y, z at the depth of the phantom",
            std::vector<double>{0.2, 0.2, 0.5}),
      found("pose_sigma_deg", &S::pose_sigma_deg, 3, "deg", 180,
            "standard deviation of the pose about the camera's axes x, y, z",
            std::vector<double>{0.05, 0.05, 0.02}),
      found_number("focal_sigma", &S::focal_sigma, "", 1,
                   "standard deviation of fx as a share of it: 0.001 is 0.1 %", 0.001),
      found_number("time_offset_sigma_ms", &S::time_offset_sigma_ms, "ms", 1000,
                   "standard deviation of time_offset_ms; left out = 15 ms", 3.0)};
}

/// The keys of a [[camera]], in the order in which a person fills them in.
inline BoundKeys<CameraCalibration> camera_keys() {
  BoundKeys<CameraCalibration> keys = camera_intrinsics_keys();
  const auto add = [&keys](BoundKeys<CameraCalibration> more) {
    std::move(more.begin(), more.end(), std::back_inserter(keys));
  };
  add(camera_image_keys());
  keys.push_back(camera_pose_key());
  add(camera_sigma_keys());
  return keys;
}

/// A point in the image and how it moves with the point in the world.
struct Projection {
  Eigen::Vector2d p_image_px;
  Eigen::Matrix<double, 2, 3> J_image_world;  ///< px per mm
  double depth_mm;                            ///< z in the camera frame
};

/// Projects world points. What is const may be called from any thread; nothing allocates after construction.
class Camera {
 public:
  explicit Camera(CameraCalibration calibration);

  /// From here on with the intrinsics and pose of `view`; with nothing, those given at construction.
  void look_from(const std::optional<ViewGeometry>& view);

  /// pi of the paper: world to image with Jacobian; nothing for a point at or behind the camera's centre (or
  /// NaN). Far outside the field of view a distortion with negative k can fold points back into the image, as
  /// OpenCV's does.
  [[nodiscard]] std::optional<Projection> project(const Eigen::Vector3d& p_world_mm) const;

  /// Image point without distortion: the direction (x, y, 1) in the camera frame, by fixed-point iteration
  /// (to 1e-12, at most 100 rounds; the last value for a distortion that cannot be inverted there).
  [[nodiscard]] Eigen::Vector3d ray_camera(const Eigen::Vector2d& p_image_px) const;

  /// Inside the image by at least `margin_px` (negative: may be outside by as much)? The image reaches from
  /// the centre of its first pixel (0, 0) to that of its last (width - 1, height - 1): whatever is contained
  /// can be interpolated. Never true for NaN.
  [[nodiscard]] bool contains(const Eigen::Vector2d& p_image_px, double margin_px = 0) const;

  /// As it looks now.
  [[nodiscard]] const CameraCalibration& calibration() const { return calibration_; }

 private:
  struct Place {
    double fx, fy, cx, cy;
    RigidTransform T_camera_world;
  };

  CameraCalibration calibration_;
  Place at_construction_;
};

}  // namespace tubed
