// Memory that is never waited for.
#pragma once

#include <string>

namespace tubed {

/// Keeps every page of this process in memory: programs and libraries as a whole and at once (but for direct
/// solvers that Ceres is linked with and nobody calls: of them what is touched), what is allocated later from
/// its first use on (real-time threads use their stacks before they begin, see StageThread). Freed memory
/// stays with the process. Called once, before threads start. Returns what was refused and what to do about
/// it; empty when it was granted.
std::string lock_memory();

/// Gives every page of the heap its memory now, also of what is only reserved: a real-time thread must not be
/// the first to write it. Called after lock_memory(), when everything those threads use has been made. Does
/// nothing on kernels before 5.14, where such a page comes at its first use.
void populate_heap();

}  // namespace tubed
