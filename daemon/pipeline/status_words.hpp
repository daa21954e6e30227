#pragma once

#include <string>
#include <vector>

#include "daemon/pipeline/publisher_stage.hpp"

namespace tubed {

/// The daemon's state in one line: every instrument's validity, why, and how old its newest estimate is, then
/// the stages that are not running. `instruments` has one id for each of status.instruments.
std::string status_words(const std::vector<std::string>& instruments, const PipelineStatus& status);

}  // namespace tubed
