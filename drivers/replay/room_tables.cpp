#include "drivers/replay/room_tables.hpp"

#include <toml++/toml.h>

#include <utility>

namespace tubed {

toml::array rows_of(const RigidTransform& transform) {
  toml::array rows;
  for (Eigen::Index r = 0; r < 4; ++r) {
    toml::array row;
    for (Eigen::Index c = 0; c < 4; ++c) row.push_back(transform.matrix()(r, c));
    rows.push_back(std::move(row));
  }
  return rows;
}

toml::table table_of(const CameraCalibration& camera) {
  toml::array distortion;
  for (const double coefficient : camera.distortion) distortion.push_back(coefficient);
  toml::table table{{"name", camera.name},
                    {"width", camera.width},
                    {"height", camera.height},
                    {"fx", camera.fx},
                    {"fy", camera.fy},
                    {"cx", camera.cx},
                    {"cy", camera.cy},
                    {"distortion", std::move(distortion)},
                    {"T_camera_world", rows_of(camera.T_camera_world)}};
  if (!camera.masks.empty()) {
    toml::array masks;
    for (const int number : camera.masks) masks.push_back(number);
    table.insert("masks", std::move(masks));
  }
  return table;
}

}  // namespace tubed
