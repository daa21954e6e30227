#include "daemon/image/measured_view.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "idl/geometry/image_mask.hpp"

namespace tubed {

namespace {

constexpr double kMaxWidth_px = 7;  // of a tube in the measured image
constexpr int kMinSide_px = 64;     // of the measured image

/// Of the thinnest instrument, at the depth of what the camera looks at; 0 where that is not in front of it.
double expected_width_px(const CameraCalibration& camera,
                         std::span<const InstrumentDescription> instruments) {
  const auto p_world_mm = camera.looked_at_world_mm();
  if (!p_world_mm || instruments.empty()) {
    return 0;
  }
  double diameter_mm = std::numeric_limits<double>::infinity();
  for (const InstrumentDescription& instrument : instruments) {
    diameter_mm = std::min(diameter_mm, instrument.diameter_mm);
  }
  return diameter_mm * std::min(camera.fx, camera.fy) / (camera.T_camera_world * *p_world_mm).z();
}

/// Of anything with intrinsics. Bit by bit the same where nothing is averaged.
template <typename Pinhole>
void bin_intrinsics(Pinhole& camera, int binning) {
  if (binning > 1) {
    camera.fx /= binning;
    camera.fy /= binning;
    camera.cx = (camera.cx + 0.5) / binning - 0.5;
    camera.cy = (camera.cy + 0.5) / binning - 0.5;
  }
}

}  // namespace

int binning_of(const CameraCalibration& camera, std::span<const InstrumentDescription> instruments) {
  const double width_px = expected_width_px(camera, instruments);
  const int side_px = std::min(camera.width, camera.height);
  const auto fits = [&](int binning) { return side_px / binning >= kMinSide_px; };
  int binning = 1;
  while (binning < kMaxBinning && fits(2 * binning) &&
         (camera.binning > 0 ? binning < camera.binning : width_px > kMaxWidth_px * binning)) {
    binning *= 2;
  }
  return binning;
}

CameraCalibration binned(CameraCalibration camera, int binning) {
  bin_intrinsics(camera, binning);
  camera.masks = binned_masks(camera, binning);
  camera.width /= binning;
  camera.height /= binning;
  if (camera.calibration_residual_px) {
    *camera.calibration_residual_px /= binning;
  }
  camera.binning = 1;
  camera.averaged *= binning;
  return camera;
}

ViewGeometry binned(ViewGeometry geometry, int binning) {
  bin_intrinsics(geometry, binning);
  return geometry;
}

ViewUsed used_view(std::size_t index, const CameraCalibration& measured, MonotonicTime exposure,
                   const PoseSigma* sigma) {
  ViewUsed used{.camera = static_cast<std::uint32_t>(index),
                .has_own_geometry = sigma != nullptr,
                .exposure_monotonic_ns = to_ns(exposure)};
  const Eigen::Vector2d centre_px = unbinned_px({measured.cx, measured.cy}, measured.averaged);
  used.focal_length_px = {measured.fx * measured.averaged, measured.fy * measured.averaged};
  used.principal_point_px = {centre_px.x(), centre_px.y()};
  using RowMajor = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;
  Eigen::Map<RowMajor>(used.T_camera_world.data()) = measured.T_camera_world.matrix();
  if (sigma != nullptr) {
    std::transform(sigma->rotation_rad.begin(), sigma->rotation_rad.end(), used.sigma_rotation_rad.begin(),
                   [](double x) { return static_cast<float>(x); });
    std::transform(sigma->translation_mm.begin(), sigma->translation_mm.end(),
                   used.sigma_translation_mm.begin(), [](double x) { return static_cast<float>(x); });
  }
  return used;
}

RoomDescription measured_room(RoomDescription room) {
  for (CameraCalibration& camera : room.cameras) {
    camera = binned(std::move(camera), binning_of(camera, room.instruments));
  }
  return room;
}

}  // namespace tubed
