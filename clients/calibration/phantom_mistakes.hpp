// A phantom's file that is partly wrong: which of its balls are not where it says, and where images have
// them.
#pragma once

#include <string>
#include <vector>

#include "clients/calibration/camera_calibration.hpp"

namespace tubed {

/// What a person gets wrong in some rows of the file: a sign, two exchanged axes, a decimal point, two balls
/// exchanged. A ball that is not matched in most of the images that should show it is put where each mistake
/// would have it; a shadow there, of its width and of no other ball, in most of these images speaks for it.
/// One sentence a mistake, with the balls' names; then one for balls that nothing explains, if there are more
/// of them than overlap hides. Empty for a file that fits.
std::vector<CameraStatement> phantom_mistakes(const CameraFindings& findings, const BallPhantom& phantom);

}  // namespace tubed
