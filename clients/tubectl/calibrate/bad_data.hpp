// What was named is not what it should be: said, with an exit code of its own.
#pragma once

#include <functional>

namespace tubed {

/// Runs it. What it throws as CalibrationError, FragmentError, SequenceError, ConfigurationError or another
/// error about what it was given is said on standard error, and kExitBadData returned.
int saying_bad_data(const std::function<int()>& run);

}  // namespace tubed
