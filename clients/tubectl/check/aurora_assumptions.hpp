// The assumptions about an Aurora that the driver rests on, as drivers/aurora/README.md words them, and what
// a conversation says about each. Pure.
#pragma once

#include <string>
#include <vector>

#include "clients/tubectl/check/aurora_judgement.hpp"

namespace tubed {

/// One assumption. Texts are constant, and the same as in drivers/aurora/README.md.
struct Assumption {
  const char* id;        ///< "A1"
  const char* text;      ///< one sentence
  const char* known_by;  ///< "recorded", "vendor", "client", "guide", "assumed"
  Judgement (*judge)(const WireConversation& conversation);
};

/// All of them, in the order of their numbers.
[[nodiscard]] const std::vector<Assumption>& aurora_assumptions();

struct JudgedAssumption {
  const Assumption* assumption = nullptr;
  Judgement judgement;
};

/// Every assumption, judged by one conversation.
[[nodiscard]] std::vector<JudgedAssumption> judge_assumptions(const WireConversation& conversation);

/// A table for a terminal `width` columns wide, each line with its line feed, and a last line that counts.
/// From 110 columns on the evidence stands beside the assumption, else below it.
[[nodiscard]] std::string assumption_table(const std::vector<JudgedAssumption>& judged, int width);

/// What the tracker calls itself: "AURORA Rev 006, API D.001.005", as far as it was asked.
[[nodiscard]] std::string tracker_name(const WireConversation& conversation);

/// The same as JSON: {"tracker", "assumptions": [{"id", "assumption", "known_by", "verdict", "time_s",
/// "evidence"}], "holds": n, "does_not_hold": n, "not_tried": n}. time_s is null when nothing was tried.
[[nodiscard]] std::string assumption_json(const std::vector<JudgedAssumption>& judged,
                                          const std::string& tracker);

}  // namespace tubed
