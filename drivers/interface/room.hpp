// What stands in the room and how it is calibrated: cameras, tracker, instruments. Values from the
// configuration; a simulated source draws from it, the estimator measures with it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "daemon/geometry/camera.hpp"
#include "daemon/geometry/rigid_transform.hpp"

namespace tubed {

/// One coil of an instrument.
struct CoilPlacement {
  int sensor = 1;                 ///< counts from 1 in the tracker's measurement
  double offset_from_tip_mm = 0;  ///< s along the catheter
  bool flipped = false;           ///< mounted the other way round: its +z points away from the tip
  int port = 0;                   ///< of the tracker, counts from 1; 0: not given
  int channel = 0;                ///< of the port: two coils may share a plug
  std::optional<std::uint32_t> tool_serial =
      std::nullopt;                   ///< of the tool that has to be in that plug; not given: any
  std::string tool_part_number = {};  ///< the same; empty: any
};

/// One tracked catheter.
struct InstrumentDescription {
  std::string id;  ///< the DDS key
  double diameter_mm = 2.33;
  double length_mm = 380;            ///< from the tip, the part whose shape is asked for
  std::vector<CoilPlacement> coils;  ///< tip first
};

struct RoomDescription {
  RigidTransform T_world_em = RigidTransform::Identity();
  bool registered = true;  ///< false: T_world_em was not given; estimates say NO_REGISTRATION
  std::vector<CameraCalibration> cameras;
  std::vector<InstrumentDescription> instruments;
};

}  // namespace tubed
