// Memory that is never waited for.
#pragma once

#include <string>

namespace tubed {

/// Keeps every page of this process in memory, those of threads still to come included: their stacks are
/// filled with pages when they are made. Freed memory stays with the process. Called once, before threads
/// start. Returns what was refused and what to do about it; empty when it was granted.
std::string lock_memory();

}  // namespace tubed
