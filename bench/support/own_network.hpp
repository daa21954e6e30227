// Benchmarks that use DDS run in a network of their own, so that neither disturbs the other.
#pragma once

namespace tubed {

/// Moves this process into namespaces in which only a loopback interface exists, with /dev/shm and /tmp of
/// its own. Before the first thread. Throws std::runtime_error, with what to do, when that is not allowed.
void enter_own_network();

}  // namespace tubed
