// An explanation as pictures.
#pragma once

#include <opencv2/core/mat.hpp>

#include "clients/evaluation/explanation.hpp"

namespace tubed {

/// One sheet, 8-bit colour: the image with predicted, estimated and true tube; the vesselness; the posterior
/// of the tube; the lines with what they found. Below it the words of the explanation and a legend. Where
/// there is no image, panels are empty and the words say why.
cv::Mat draw_sheet(const Explanation& explanation);

/// The panel of the lines alone, enlarged, cut to where they are. Empty without lines in view.
cv::Mat draw_lines(const Explanation& explanation);

}  // namespace tubed
