// The page about a camera's calibration.
#pragma once

#include <string>

#include "clients/calibration/camera_calibration.hpp"

namespace tubed {

/// SVG: verdicts, numbers with their standard deviations, the first image's points with what is left of them
/// drawn larger, a histogram of that, and the images one by one.
std::string camera_report(const CameraFindings& findings);

}  // namespace tubed
