#include "idl/geometry/image_mask.hpp"

#include <algorithm>
#include <cmath>

namespace tubed {

namespace {

constexpr std::size_t kNumbers = 4;  // of a mask

ImageMask mask_at(const std::vector<int>& masks, std::size_t number) {
  const int* const from = &masks[kNumbers * number];
  return {from[0], from[1], from[2], from[3]};
}

/// First and last square, of those that `first .. first + count - 1` pixels lie in.
struct Squares {
  int first = 0;
  int count = 0;
};

Squares squares_of(int first, int count, int binning, int size) {
  const int last = std::min((first + count - 1) / binning, size - 1);
  const int begin = first / binning;
  return {begin, std::max(0, last - begin + 1)};
}

}  // namespace

std::vector<ImageMask> masks_of(const CameraCalibration& camera) {
  std::vector<ImageMask> masks;
  for (std::size_t i = 0; i < camera.masks.size() / kNumbers; ++i) {
    ImageMask mask = mask_at(camera.masks, i);
    mask.width = std::min(mask.width, camera.width - mask.x);
    mask.height = std::min(mask.height, camera.height - mask.y);
    if (mask.width > 0 && mask.height > 0) {
      masks.push_back(mask);
    }
  }
  return masks;
}

std::string fault_of_masks(const std::vector<int>& masks, int width, int height) {
  if (masks.size() % kNumbers != 0) {
    return "expected four numbers for each mask: x, y, width, height; found " + std::to_string(masks.size()) +
           " numbers";
  }
  for (std::size_t i = 0; i < masks.size() / kNumbers; ++i) {
    const ImageMask mask = mask_at(masks, i);
    if (mask.width < 1 || mask.height < 1 || mask.x > width - mask.width || mask.y > height - mask.height) {
      return "mask " + std::to_string(i + 1) + ": expected a rectangle inside the image of " +
             std::to_string(width) + " x " + std::to_string(height) + " px, found x " +
             std::to_string(mask.x) + ", y " + std::to_string(mask.y) + ", width " +
             std::to_string(mask.width) + ", height " + std::to_string(mask.height);
    }
  }
  return "";
}

bool is_masked(const CameraCalibration& camera, const Eigen::Vector2d& p_image_px) {
  if (camera.masks.empty() || !p_image_px.allFinite()) {
    return false;
  }
  const Eigen::Vector2d nearest = p_image_px.array().round().max(-1e6).min(1e6);
  const int row = static_cast<int>(nearest.y());
  const int seen_column = static_cast<int>(nearest.x());
  const int column = camera.mirrored ? camera.width - 1 - seen_column : seen_column;
  for (std::size_t i = 0; i < camera.masks.size() / kNumbers; ++i) {
    if (mask_at(camera.masks, i).contains(column, row)) {
      return true;
    }
  }
  return false;
}

std::vector<int> binned_masks(const CameraCalibration& camera, int binning) {
  const int width = camera.width / binning;
  const int height = camera.height / binning;
  std::vector<int> binned;
  for (const ImageMask& mask : masks_of(camera)) {
    // Squares are counted in the image after `mirrored`.
    const int seen_x = camera.mirrored ? camera.width - mask.x - mask.width : mask.x;
    const Squares across = squares_of(seen_x, mask.width, binning, width);
    const Squares down = squares_of(mask.y, mask.height, binning, height);
    if (across.count > 0 && down.count > 0) {
      const int x = camera.mirrored ? width - across.first - across.count : across.first;
      binned.insert(binned.end(), {x, down.first, across.count, down.count});
    }
  }
  return binned;
}

}  // namespace tubed
