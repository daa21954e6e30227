// Who can send packets to the programs of tubed on this machine: each socket, its filter, and who is let in.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "clients/tubectl/check/doctor_checks.hpp"
#include "clients/tubectl/check/tracker_report.hpp"
#include "idl/interface_filter.hpp"

namespace tubed {

/// The interface filter on descriptor `fd` of process `pid`. Throws std::runtime_error when this process may
/// not see it.
using FilterReader = std::function<std::optional<AllowedInterfaces>(int pid, int fd)>;

/// Takes a look at the socket of another process: pidfd_getfd, which needs its user's rights or root's.
std::optional<AllowedInterfaces> filter_of_process(int pid, int fd);

/// One finding for each group of sockets of a running tubed, tubed-exporter or tubed-view that the same hosts
/// can reach; without a running tubed, what `network_interface` of the configuration will open.
std::vector<NamedFinding> examine_network(const Machine& machine, const std::string& network_interface,
                                          const FilterReader& filter_of = filter_of_process);

}  // namespace tubed
