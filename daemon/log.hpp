// What the daemon says of itself: to standard error in lines, or under systemd to the journal in words and
// fields.
#pragma once

#include <spdlog/common.h>

#include <string>
#include <string_view>
#include <vector>

#include "daemon/publishing/journal.hpp"

namespace tubed {

/// From here on spdlog's default logger is asynchronous: a thread of its own writes. Called once.
void start_logging(const std::string& level);

/// Says `words`; the fields, named TUBED_..., go to the journal only. What cannot be shown in either is
/// replaced: nobody whose words are repeated begins a line or a field.
void log_with_fields(spdlog::level::level_enum level, std::string_view words,
                     const std::vector<JournalField>& fields);

}  // namespace tubed
