// What a calibration of a camera says to a person.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "clients/calibration/ball_matching.hpp"
#include "clients/calibration/camera_calibration.hpp"

namespace tubed {

/// "512 x 512 px".
std::string size_words(int width, int height);
/// A number with so many decimals.
std::string decimals(double value, int count);

/// Why an image with so few shadows is of no use.
std::string too_few_balls(const CalibrationPicture& picture, std::size_t found, const BallPhantom& phantom);

/// Why an image whose shadows are not the phantom's is of no use. `match`: the best there is; `unsized`: with
/// shadows of any width.
std::string not_recognised(const CalibrationPicture& picture, const std::vector<FoundBall>& found,
                           const BallPhantom& phantom, const std::optional<PhantomMatch>& match,
                           const std::optional<PhantomMatch>& unsized);

/// The verdict, the most important first.
std::vector<CameraStatement> statements_of(const CameraFindings& findings);

}  // namespace tubed
