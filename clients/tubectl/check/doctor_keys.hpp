// Whether DDS Security is on, whose keys they are and until when.
#pragma once

#include <cstdint>

#include "clients/tubectl/check/doctor_checks.hpp"
#include "clients/tubectl/check/tracker_report.hpp"
#include "daemon/config/configuration.hpp"

namespace tubed {

/// Of the keys that the daemon's configuration names; `now_s`: seconds since 1970, UTC. Keys that only root
/// and the daemon may read are a note, not a fault.
NamedFinding examine_security(const Configuration& configuration, std::int64_t now_s);

}  // namespace tubed
