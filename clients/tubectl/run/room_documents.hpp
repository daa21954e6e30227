// The two documents of DDS Security that say what a room protects and who may do what in it: DDS Security 1.1
// Sec. 9.4.1.2 (governance) and 9.4.1.3 (permissions).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace tubed {

/// What an identity is for.
enum class Role {
  kDaemon,      ///< publishes and reads tubed's topics
  kSubscriber,  ///< reads them: displays, robots, recorders, bridges, tubed-exporter, tubectl
};

/// "daemon", "subscriber".
std::string_view name_of(Role role);
std::optional<Role> role_named(std::string_view name);

/// From when until when; seconds since 1970, UTC.
struct Period {
  std::int64_t from_s = 0;
  std::int64_t until_s = 0;
};

/// Nobody without keys; discovery, liveliness and data encrypted, every message and submessage signed for
/// each receiver apart, so that one subscriber cannot speak to another in the daemon's name.
std::string governance_document();

/// What `role` may do in `partition` (without characters that XML escapes). `subject` as RFC 2253 orders it.
std::string permissions_document(Role role, const std::string& subject, const std::string& partition,
                                 const Period& period);

}  // namespace tubed
