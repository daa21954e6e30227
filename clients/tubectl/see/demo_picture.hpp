// The picture of a demonstration as SVG, for people who have no terminal at hand.
#pragma once

#include <string>

#include "clients/tubectl/see/demo_figures.hpp"
#include "clients/tubectl/see/demo_view.hpp"

namespace tubed {

/// The newest shapes in two projections (as the fluoroscope sees it, and from the side), with the tube's
/// width and one standard deviation of the fused shape as a band, and the figures below. Empty before the
/// first shape.
std::string demo_picture_svg(const DemoFigures& figures, const DemoShapes& shapes);

}  // namespace tubed
