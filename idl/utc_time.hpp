// Times of certificates and permissions in words: always UTC, whatever the machine's time zone.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace tubed {

inline constexpr std::int64_t kSecondsPerDay = 86'400;

/// "2026-11-23T08:36:21Z"; `time_s`: seconds since 1970 in UTC.
std::string utc_text(std::int64_t time_s);

/// The reverse, "Z" left out or given; a day alone ("2026-11-23") is its beginning. Nothing when `text` is no
/// such time.
std::optional<std::int64_t> utc_from_text(const std::string& text);

}  // namespace tubed
