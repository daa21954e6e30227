// Whether the limits that this process was given let it run: found out before the start, in words, rather
// than by whichever library first gets no memory, thread or file and ends the process.
#pragma once

#include "daemon/config/configuration.hpp"

namespace tubed {

/// Throws std::runtime_error, which names the limit and what it has to be, when the stack (RLIMIT_STACK) is
/// too small for any further step. The first call of main; needs no memory but for the exception.
void require_stack();

/// The same for address space (RLIMIT_AS, RLIMIT_DATA), open files (RLIMIT_NOFILE) and threads (RLIMIT_NPROC,
/// TasksMax=): takes once what a daemon of this configuration uses, and gives it back. Main thread, before
/// anything else is started.
void require_limits(const Configuration& configuration);

}  // namespace tubed
