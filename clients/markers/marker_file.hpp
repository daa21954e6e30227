// Named points as files hold them: CSV, and the two formats of 3D Slicer, .mrk.json and .fcsv.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace tubed {

/// What x, y, z of a file mean: the patient's left, posterior, superior; right, anterior, superior; or
/// whatever whoever wrote it meant.
enum class MarkerAxes { kAsWritten, kLps, kRas };

/// "as written", "LPS", "RAS".
std::string_view name_of(MarkerAxes axes);

struct Marker {
  std::string name;
  Eigen::Vector3d p_mm = Eigen::Vector3d::Zero();
};

struct MarkerFile {
  std::string name;  ///< of the file, for messages
  MarkerAxes axes = MarkerAxes::kAsWritten;
  std::vector<Marker> markers;  ///< in the file's order, each name once, all finite
};

/// A file of markers, or two of them together, cannot be used; what() says where and what to do.
class MarkerFileError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Reads a file by what its name ends with: ".fcsv", ".json", anything else is CSV with the columns name, x,
/// y, z in any order. Markups of Slicer (schema 1.0.x): the control points of all fiducial lists that have a
/// position; their coordinateSystem is returned. fcsv: its line "# CoordinateSystem = LPS|RAS|0|1" (0 is RAS,
/// 1 is LPS) has to be there. `csv_axes` is what a CSV is taken as. Throws MarkerFileError "FILE:LINE:COLUMN:
/// ..." for a file that is none of these, a name twice or empty, a number that is not finite, no marker at
/// all.
MarkerFile read_markers(const std::filesystem::path& file, MarkerAxes csv_axes = MarkerAxes::kAsWritten);

/// The same points along other axes: x and y change their sign between LPS and RAS. Nothing changes where one
/// of both is not known.
MarkerFile along(MarkerFile file, MarkerAxes axes);

/// Writes name,x,y,z with four decimals. Throws MarkerFileError when it cannot.
void write_markers(const std::filesystem::path& file, const std::vector<Marker>& markers);

/// "M1, M2 and M3"; at most `max_count` of them, then "and 4 more".
std::string list_of(const std::vector<std::string>& names, std::size_t max_count = 12);

}  // namespace tubed
