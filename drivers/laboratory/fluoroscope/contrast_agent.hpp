// Contrast agent that flows through a vessel.
#pragma once

#include <Eigen/Core>

#include "drivers/laboratory/fluoroscope/radiograph_settings.hpp"

namespace tubed {

/// Part of the undiluted agent, 0 .. 1, at `u_mm` along the vessel, `age_s` after the injection began at its
/// first point: a plug carried by the blood, blurred at its front, washed out exponentially behind, thinned
/// on its way.
double agent_concentration(const LumenSettings& lumen, double u_mm, double age_s);

/// Arc lengths of the points of a polyline from its first, mm.
Eigen::VectorXd arc_lengths_mm(const Eigen::Matrix3Xd& points_mm);

}  // namespace tubed
