// What stands in the room as TOML, for the files that are written: sequence.toml and configurations.
#pragma once

#include <toml++/impl/forward_declarations.h>

#include "drivers/interface/room.hpp"

namespace tubed {

/// The four rows of the 4 x 4 matrix. Here and below numbers are written so that reading gives them back to
/// the last bit.
toml::array rows_of(const RigidTransform& transform);

/// Name, size, intrinsics, distortion and pose of a camera.
toml::table table_of(const CameraCalibration& camera);

}  // namespace tubed
