// A picture of a simulated catheterisation: where the catheter lay, and how good the mechanics were.
#pragma once

#include <filesystem>

#include "drivers/laboratory/scenario.hpp"

namespace tubed {

/// Writes a PNG: the vessel as the first view sees it (brighter where it is deeper) with the catheter at four
/// steps, its coils, and below over the steps: wall penetration, move of the tip, move of the node that moved
/// most beyond following the catheter's path. Throws std::runtime_error when the file cannot be written.
void draw_simulation(const Scenario& scenario, const Catheterisation& run, const std::filesystem::path& file);

}  // namespace tubed
