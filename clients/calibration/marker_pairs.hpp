// Which touched marker is which: markers in the world and the same ones in the tracker's frame, side by side.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "clients/markers/marker_file.hpp"

namespace tubed {

/// The same markers in both frames, column by column.
struct MarkerPairs {
  std::vector<std::string> names;
  Eigen::Matrix3Xd p_world_mm;
  Eigen::Matrix3Xd p_em_mm;

  [[nodiscard]] std::size_t size() const { return names.size(); }
  /// Without one of them.
  [[nodiscard]] MarkerPairs without(std::size_t index) const;
};

enum class Correspondence { kByName, kByOrder };

struct PairedMarkers {
  MarkerPairs pairs;
  std::vector<std::string> remarks;  ///< which markers of either file were left out
};

/// Pairs markers by their names, in the order of `world`; markers in one file only are left out, and a remark
/// says so. By order the first of one file is the first of the other, named as in the world, and both have as
/// many. `excluded` names markers of the world that are not used. Throws MarkerFileError for names that do
/// not match (fewer than three in common while both files have three), other counts by order, an excluded
/// name that is none, more than 1000 markers, and touched markers that are where the world's are, whatever
/// the signs of their coordinates.
PairedMarkers pair_markers(const MarkerFile& world, const MarkerFile& touched, Correspondence correspondence,
                           const std::vector<std::string>& excluded = {});

}  // namespace tubed
