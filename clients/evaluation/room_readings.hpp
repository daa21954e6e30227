// Other ways to understand the numbers that describe a room: what a pose that is given the wrong way round
// was meant to be.
#pragma once

#include <string>
#include <vector>

#include "drivers/interface/room.hpp"

namespace tubed {

/// The room with some of its numbers understood in another way.
struct RoomReading {
  std::string words;   ///< "with the inverse of T_world_em"
  std::string advice;  ///< what to do where this is the right one
  RoomDescription room;
};

/// What people mix up: a transform and its inverse, the axes of a camera (z along its rays, x and y along
/// columns and rows of the image) and those of computer graphics (looking along -z, y up), metres and
/// millimetres, two cameras. Readings that change nothing are left out.
std::vector<RoomReading> other_readings(const RoomDescription& room);

}  // namespace tubed
