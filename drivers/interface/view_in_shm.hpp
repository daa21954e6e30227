// How a view stood, as an image in shared memory carries it.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <iterator>
#include <optional>

#include "idl/geometry/view_geometry.hpp"
#include "idl/shm_layout.h"

namespace tubed {

/// As it came, unchecked: refusal_of() says what is wrong with it. Nothing where the image brings none.
inline std::optional<ViewGeometry> geometry_of(const tubed_shm_image& image) {
  if (image.geometry != TUBED_SHM_GEOMETRY) {
    return std::nullopt;
  }
  const auto copy_to = [](auto& to, const auto& from) {
    std::copy(std::begin(from), std::end(from), to.begin());
  };
  ViewGeometry geometry{.fx = static_cast<double>(image.fx),
                        .fy = static_cast<double>(image.fy),
                        .cx = static_cast<double>(image.cx),
                        .cy = static_cast<double>(image.cy),
                        .sigma = {}};
  copy_to(geometry.q_camera_world, image.q_camera_world);
  copy_to(geometry.t_camera_world_mm, image.t_camera_world_mm);
  copy_to(geometry.sigma.rotation_rad, image.sigma_rotation_rad);
  copy_to(geometry.sigma.translation_mm, image.sigma_translation_mm);
  geometry.sigma.pivot_depth_mm = static_cast<double>(image.pivot_depth_mm);
  return geometry;
}

/// Fills `geometry` and what follows it of the image, rounded to float.
inline void write_geometry(const ViewGeometry& geometry, tubed_shm_image& image) {
  const auto copy_to = [](auto& to, const auto& from) {
    std::transform(from.begin(), from.end(), std::begin(to),
                   [](double value) { return static_cast<float>(value); });
  };
  image.geometry = TUBED_SHM_GEOMETRY;
  image.fx = static_cast<float>(geometry.fx);
  image.fy = static_cast<float>(geometry.fy);
  image.cx = static_cast<float>(geometry.cx);
  image.cy = static_cast<float>(geometry.cy);
  copy_to(image.q_camera_world, geometry.q_camera_world);
  copy_to(image.t_camera_world_mm, geometry.t_camera_world_mm);
  copy_to(image.sigma_rotation_rad, geometry.sigma.rotation_rad);
  copy_to(image.sigma_translation_mm, geometry.sigma.translation_mm);
  image.pivot_depth_mm = static_cast<float>(geometry.sigma.pivot_depth_mm);
}

}  // namespace tubed
