#include "drivers/v4l2/picture_shape.hpp"

#include <utility>

namespace tubed {

namespace {

PictureSize decimated(const PictureShape& shape, PictureSize card) noexcept {
  const PictureArea crop = crop_of(shape, card);
  const bool is_inside = crop.x >= 0 && crop.y >= 0 && crop.width > 0 && crop.height > 0 &&
                         crop.width <= card.width - crop.x && crop.height <= card.height - crop.y;
  const PictureSize size{crop.width / shape.decimation, crop.height / shape.decimation};
  return is_inside && size.width > 0 && size.height > 0 ? size : PictureSize{};
}

/// The crop in the picture whose flip has been undone.
PictureArea unflipped(PictureArea crop, Flip flip, PictureSize card, PictureSize kept) noexcept {
  if (flips_x(flip)) {
    crop.x = card.width - crop.x - kept.width;
  }
  if (flips_y(flip)) {
    crop.y = card.height - crop.y - kept.height;
  }
  return crop;
}

// A new pixel's centre is the mean of the centres it is made of: u' = (u - (d - 1) / 2) / d.
void decimate(CameraCalibration& camera, int by) {
  camera.fx /= by;
  camera.fy /= by;
  camera.cx = (camera.cx - (by - 1) / 2.0) / by;
  camera.cy = (camera.cy - (by - 1) / 2.0) / by;
}

// u' = height - 1 - v, v' = u: the camera turns about its line of sight, x' = -y, y' = x. In OpenCV's
// tangential terms p1 multiplies r^2 + 2 y^2 in y and p2 multiplies r^2 + 2 x^2 in x.
void rotate_clockwise(CameraCalibration& camera) {
  std::swap(camera.fx, camera.fy);
  const double cx = camera.cx;
  camera.cx = camera.height - 1 - camera.cy;
  camera.cy = cx;
  std::swap(camera.width, camera.height);
  const double p1 = camera.distortion[2];
  camera.distortion[2] = camera.distortion[3];
  camera.distortion[3] = -p1;
  Eigen::Matrix3d R_rotated_camera;
  R_rotated_camera << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  camera.T_camera_world = RigidTransform(R_rotated_camera) * camera.T_camera_world;
}

}  // namespace

PictureArea crop_of(const PictureShape& shape, PictureSize card) noexcept {
  return shape.crop.width == 0 ? PictureArea{0, 0, card.width, card.height} : shape.crop;
}

PictureSize delivered_size(const PictureShape& shape, PictureSize card) noexcept {
  const PictureSize size = decimated(shape, card);
  return swaps_sides(shape.rotation) ? PictureSize{size.height, size.width} : size;
}

PictureSize card_size_for(const PictureShape& shape, PictureSize delivered) noexcept {
  const PictureSize size{delivered.width * shape.decimation, delivered.height * shape.decimation};
  return swaps_sides(shape.rotation) ? PictureSize{size.height, size.width} : size;
}

PicturePlaces places_of(const PictureShape& shape, PictureSize size) noexcept {
  const long width = size.width;
  const long height = size.height;
  PicturePlaces places;
  switch (shape.rotation) {
    case Rotation::k0:
      places = {0, 1, width};
      break;
    case Rotation::k90:
      places = {height - 1, height, -1};
      break;
    case Rotation::k180:
      places = {width * height - 1, -1, -width};
      break;
    case Rotation::k270:
      places = {(width - 1) * height, -height, 1};
      break;
  }
  if (flips_x(shape.flip)) {
    places.origin += (width - 1) * places.step_x;
    places.step_x = -places.step_x;
  }
  if (flips_y(shape.flip)) {
    places.origin += (height - 1) * places.step_y;
    places.step_y = -places.step_y;
  }
  return places;
}

CameraCalibration delivered_camera(const PictureShape& shape, const CameraCalibration& card) {
  const PictureSize whole{card.width, card.height};
  const PictureSize size = decimated(shape, whole);
  const PictureSize kept{size.width * shape.decimation, size.height * shape.decimation};
  const PictureArea crop = unflipped(crop_of(shape, whole), shape.flip, whole, kept);
  CameraCalibration camera = card;
  camera.cx -= crop.x;
  camera.cy -= crop.y;
  decimate(camera, shape.decimation);
  camera.width = size.width;
  camera.height = size.height;
  for (int quarter = 0; quarter < static_cast<int>(shape.rotation); ++quarter) {
    rotate_clockwise(camera);
  }
  return camera;
}

}  // namespace tubed
