#pragma once

#include <string>

#include "daemon/publishing/published_values.hpp"

namespace tubed {

/// Which tracker and which tools, in one line for the log; nothing of what the tracker did not say.
std::string tracker_words(const TrackerIdentityValues& tracker);

}  // namespace tubed
