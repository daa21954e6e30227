// Cyclone's log in a program of a client's: by default it is a line on standard error for every packet that
// it cannot read.
#pragma once

#include <chrono>
#include <cstdio>

#include "idl/cyclone_log.hpp"

namespace tubed {

/// From here on Cyclone's warnings and errors come to standard error five in ten seconds at most, as they may
/// be shown. Called once, before the first subscriber; a program that has a log of its own calls
/// route_cyclone_log() instead.
inline void limit_cyclone_log() {
  route_cyclone_log({.say =
                         [](std::string_view words) {
                           std::fprintf(stderr, "Cyclone DDS: %.*s\n", static_cast<int>(words.size()),
                                        words.data());
                         },
                     .monotonic_ns =
                         [] {
                           const auto now = std::chrono::steady_clock::now().time_since_epoch();
                           return std::int64_t{std::chrono::nanoseconds(now).count()};
                         }});
}

}  // namespace tubed
