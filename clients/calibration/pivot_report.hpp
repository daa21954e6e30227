// A judged pivot calibration as a page and as numbers for machines.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "clients/calibration/pivot_calibration.hpp"

namespace tubed {

/// Findings, tip offset, residuals over the measurements.
std::string page_of(const JudgedPivot& judged, const std::string& source, const std::string& date);

/// Findings; tip offset, covariance and pivot unless a finding is bad.
nlohmann::json to_json(const JudgedPivot& judged);

/// The option of tubectl register: "--tip-offset 0,0,98.31".
std::string tip_offset_option(const PivotCalibration& pivot);

}  // namespace tubed
