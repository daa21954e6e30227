// The view that is measured: that of the detector, of whose pixels squares are averaged where a tube is wide.
#pragma once

#include <span>

#include "drivers/interface/room.hpp"
#include "drivers/interface/timestamps.hpp"
#include "idl/estimate.hpp"
#include "idl/geometry/camera.hpp"

namespace tubed {

/// Squares of so many pixels a side may become one.
inline constexpr int kMaxBinning = 8;

/// How many pixels a side are averaged: camera.binning where it is given; otherwise the least of 1, 2, 4 and
/// 8 with which the thinnest of the instruments is at most 7 px wide, so that one that is wider than that
/// is 3.5 to 7 px wide, and what thinks in pixels (scales of the Frangi filter, profiles, reach) finds tubes
/// of one size whatever the detector. Its depth is that of what the camera looks at
/// (CameraCalibration::looked_at_world_mm()). At least 64 px a side are left. A function of the configuration
/// alone, therefore the same live and offline.
int binning_of(const CameraCalibration& camera, std::span<const InstrumentDescription> instruments);

/// The camera of an image whose pixel (i, j) is the mean of the pixels k i .. k i + k - 1, k j .. k j + k - 1
/// of `camera`'s, with k = `binning`: of what does not fill a square at the right and lower edges nothing is
/// left. The centre of square c lies at k c + (k - 1) / 2. Distortion is that of normalised coordinates and
/// stays.
CameraCalibration binned(CameraCalibration camera, int binning);
ViewGeometry binned(ViewGeometry geometry, int binning);

/// Where a place of the binned image is in the image of the detector, px.
inline Eigen::Vector2d unbinned_px(const Eigen::Vector2d& p_binned_px, int binning) {
  return ((p_binned_px.array() + 0.5) * binning - 0.5).matrix();
}

/// What the sample says of an image that takes part: the camera of that index in the room, as it was measured
/// and stood for it, in pixels of the detector. `sigma`: of the pose that came with the image; nullptr: it
/// was the configuration's.
ViewUsed used_view(std::size_t index, const CameraCalibration& measured, MonotonicTime exposure,
                   const PoseSigma* sigma);

/// The room with each camera as its images are measured. The same for a room that is that already.
RoomDescription measured_room(RoomDescription room);

}  // namespace tubed
