// One file of a CT series.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace tubed {

/// One slice, as its file says. Lengths mm, DICOM's patient frame.
struct CtSlice {
  std::filesystem::path file;
  std::string series;              ///< SeriesInstanceUID
  int columns = 0, rows = 0;       ///< voxels
  Eigen::Vector2d spacing_mm;      ///< from column to column, from row to row
  Eigen::Vector3d along_row;       ///< unit, the way the column index grows
  Eigen::Vector3d along_column;    ///< unit, the way the row index grows
  Eigen::Vector3d first_voxel_mm;  ///< centre of voxel (0, 0)
  std::vector<float> hounsfield;   ///< row by row

  /// Unit, right-handed with the two axes.
  [[nodiscard]] Eigen::Vector3d normal() const;
};

/// Nothing for a file that is no DICOM. Throws CtSeriesError for one that is no usable CT slice.
std::optional<CtSlice> read_ct_slice(const std::filesystem::path& file);

}  // namespace tubed
