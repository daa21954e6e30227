// The room of the paper's simulation: one camera 1200 mm away, five coils on a 7 Fr catheter (Sec. 3.1).
#pragma once

#include <map>
#include <string>

#include "drivers/interface/room.hpp"
#include "drivers/simulation/simulation_driver.hpp"

namespace tubed {

inline CameraCalibration paper_camera() {
  CameraCalibration camera;
  camera.name = "A";
  camera.width = 400;
  camera.height = 600;
  camera.fx = camera.fy = 2000;
  camera.cx = 200;
  camera.cy = 300;
  camera.T_camera_world.translation() = Eigen::Vector3d(0, 0, 1200);
  return camera;
}

inline InstrumentDescription paper_catheter(const std::string& id, int first_sensor) {
  InstrumentDescription catheter;
  catheter.id = id;
  for (const double offset_mm : {10.0, 90.0, 170.0, 270.0, 370.0}) {
    catheter.coils.push_back({first_sensor++, offset_mm, false});
  }
  return catheter;
}

inline RoomDescription paper_room() {
  RoomDescription room;
  room.cameras = {paper_camera()};
  room.instruments = {paper_catheter("cath-1", 1)};
  return room;
}

inline DriverSettings default_settings() {
  std::map<std::string, SettingValue> values;
  for (const KeyDescription& setting : simulation_settings()) {
    values[setting.name] = setting.default_value;
  }
  return DriverSettings(values);
}

}  // namespace tubed
