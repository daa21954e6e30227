#include "drivers/v4l2/picture_shape.hpp"

#include <algorithm>
#include <utility>

#include "idl/geometry/image_mask.hpp"

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

/// What of a mask lies in the crop, in pixels of the cropped and decimated picture, each that it touches.
ImageMask decimated(const ImageMask& mask, const PictureArea& crop, PictureSize size, int by) {
  const auto span = [by](int from, int count, int crop_from, int limit, int& first) {
    const int last = std::min((from + count - 1 - crop_from) / by, limit - 1);
    first = std::max(from - crop_from, 0) / by;
    return from + count <= crop_from ? 0 : std::max(0, last - first + 1);
  };
  ImageMask kept;
  kept.width = span(mask.x, mask.width, crop.x, size.width, kept.x);
  kept.height = span(mask.y, mask.height, crop.y, size.height, kept.y);
  return kept;
}

/// In a picture of `size`, flipped, then rotated.
ImageMask turned(ImageMask mask, const PictureShape& shape, PictureSize size) {
  if (flips_x(shape.flip)) mask.x = size.width - mask.x - mask.width;
  if (flips_y(shape.flip)) mask.y = size.height - mask.y - mask.height;
  for (int quarter = 0; quarter < static_cast<int>(shape.rotation); ++quarter) {
    mask = {size.height - mask.y - mask.height, mask.x, mask.height, mask.width};
    std::swap(size.width, size.height);
  }
  return mask;
}

std::vector<int> delivered_masks(const PictureShape& shape, const CameraCalibration& card, PictureSize size) {
  const PictureArea crop = crop_of(shape, {card.width, card.height});
  std::vector<int> delivered;
  for (ImageMask of_card : masks_of(card)) {
    if (shape.fields != FieldUse::kBoth) {
      // Rows that are filled in are means of those above and below.
      const int bottom = std::min(of_card.y + of_card.height + 1, card.height);
      of_card.y = std::max(of_card.y - 1, 0);
      of_card.height = bottom - of_card.y;
    }
    const ImageMask kept = decimated(of_card, crop, size, shape.decimation);
    if (kept.width > 0 && kept.height > 0) {
      const ImageMask mask = turned(kept, shape, size);
      delivered.insert(delivered.end(), {mask.x, mask.y, mask.width, mask.height});
    }
  }
  return delivered;
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
  camera.masks = delivered_masks(shape, card, size);
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
