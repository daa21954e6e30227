// Sentences put together where nothing may allocate.
#pragma once

#include "drivers/interface/bounded_text.hpp"

namespace tubed::aurora {

/// What a person is told about a session.
using Problem = BoundedText<255>;

}  // namespace tubed::aurora
