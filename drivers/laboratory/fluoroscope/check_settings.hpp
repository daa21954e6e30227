// Refuses settings that cannot be.
#pragma once

#include "drivers/laboratory/fluoroscope/radiograph_settings.hpp"

namespace tubed {

/// `settings` as they are. Throws std::invalid_argument with the name of the setting, its value and its
/// range.
const RadiographSettings& checked(const RadiographSettings& settings);

}  // namespace tubed
