// Settings of the estimator by name, for ablations on the command line.
#pragma once

#include <string>

#include "daemon/estimator/estimator_settings.hpp"

namespace tubed {

/// "KEY=VALUE", e.g. "paper.weights=printed" or "sigma_position_mm=1". Throws std::invalid_argument for a key
/// or value there is none of.
void apply_option(const std::string& option, EstimatorSettings& settings);

/// All keys with what they take.
std::string settings_help();

}  // namespace tubed
