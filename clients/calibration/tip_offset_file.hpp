// The tip of a probe as a file: `tubectl pivot --out` writes it, `tubectl register --tip-offset-file` reads
// it.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>

#include "clients/calibration/pivot_calibration.hpp"

namespace tubed {

/// TOML: tip_offset_mm, sigma_mm along each axis, residual_mm, degrees_of_freedom, date.
std::string tip_offset_text(const PivotCalibration& pivot, const std::string& date);

/// The key tip_offset_mm of such a file, three finite numbers. Throws MarkerFileError "FILE:LINE:COLUMN:
/// ...".
Eigen::Vector3d read_tip_offset(const std::filesystem::path& file);

}  // namespace tubed
