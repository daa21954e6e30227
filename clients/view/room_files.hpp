// What stands in the room beside the tube, out of files: the vessel's surface and registration points.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "clients/markers/marker_file.hpp"

namespace tubed {

/// Of a surface that the page fetches and reads by itself.
struct VesselNote {
  std::string name;      ///< of the file, without its folder
  std::string kind;      ///< "stl" or "vtp"; empty: there is none
  std::size_t size = 0;  ///< bytes
};

struct RoomFiles {
  VesselNote vessel;
  MarkerFile points;   ///< registration points; world frame, in the file's axes
  MarkerFile touched;  ///< the same points as they were touched; frame of the tracker, RAS if that is known
};

/// "stl" or "vtp", by what the bytes begin and end with; `name` is of the file. Throws std::invalid_argument
/// with the name and what to do for what the page could not read, as far as that is seen here: other formats,
/// files that were cut off, other kinds of VTK data, compression by LZ4 and LZMA.
std::string kind_of_surface(const std::string& name, std::string_view bytes);

/// The bytes of a surface of 64 MB at most, and in `note` what it is. Throws std::invalid_argument.
std::string read_surface(const std::string& file, VesselNote& note);

/// The points of a file as `tubectl register` reads it, kMaxPoints at most. Throws std::invalid_argument.
MarkerFile read_points(const std::string& file);
inline constexpr std::size_t kMaxPoints = 500;

}  // namespace tubed
