// What a page says to a recording, and what it is told of its time line. Pure.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "clients/playback/recording_position.hpp"
#include "idl/validity.hpp"

namespace tubed {

/// One wish of a page; what is not asked for is nothing.
struct PlaybackWish {
  std::optional<bool> play{};
  std::optional<double> seek_s{};
  std::optional<int> step{};    ///< instants
  std::optional<int> faster{};  ///< doublings of the speed; wishes that meet each other add up
};

/// {"play": true}, {"seek": 12.5}, {"step": -1}, {"faster": -1}; nothing for any other words.
std::optional<PlaybackWish> parse_wish(std::string_view words);

/// Does what is wished.
void follow(const PlaybackWish& wish, double now_s, RecordingPosition& position);

/// What the time line shows of an instant. NaN: not known.
struct InstantSummary {
  Validity validity = Validity::kNotAvailable;
  float residual_mm = 0;  ///< largest of the coils that are used
  float sigma_mm = 0;     ///< largest standard deviation of a point, in any direction
  float error_mm = 0;     ///< RMS distance from the true centreline, where that is known
};

/// A recording as its time line shows it.
struct TimeLine {
  std::string name;
  std::vector<double> times_s;           ///< of all instants, rising; at least one
  std::vector<InstantSummary> instants;  ///< of those that are ready, from the first on
  std::string trouble;                   ///< why there will be no more; empty: nothing is wrong
};

/// {"type": "timeline", "name", "begin", "end" (s), "ready" (s: until where), "done" (all instants are
/// ready), "trouble", "validity": a letter a piece (V, Q, I, N of the least valid instant in it, space:
/// none), "rows": [{"name", "unit", "values": the largest of each piece or null}]}. There are `pieces` of
/// equal length; a row without any value is left out.
nlohmann::json timeline_json(const TimeLine& line, std::size_t pieces);

/// {"type": "position", "at" (s), "instant", "frame", "playing", "speed"}.
nlohmann::json position_json(const RecordingPosition& position, std::uint32_t frame);

}  // namespace tubed
