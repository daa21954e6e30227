// Any text as a wire log: what `tubectl aurora-record --check` does with it, and written again it is the
// same.
#include <string>

#include "clients/tubectl/check/aurora_assumptions.hpp"
#include "clients/tubectl/check/wire_conversation.hpp"
#include "drivers/aurora/wire_log.hpp"
#include "tests/fuzz/fuzz_input.hpp"

using namespace tubed;
using namespace tubed::fuzz;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  const auto parsed = aurora::parse_wire_log(text);
  if (const auto* fault = std::get_if<aurora::WireLogFault>(&parsed)) {
    demand(fault->line >= 1 && !fault->why.empty());
    return 0;
  }
  const auto& log = std::get<aurora::WireLog>(parsed);
  const auto again = aurora::parse_wire_log(aurora::format_wire_log(log));
  demand(std::holds_alternative<aurora::WireLog>(again) &&
         std::get<aurora::WireLog>(again).entries.size() == log.entries.size());
  const WireConversation conversation = read_conversation(log);
  const auto judged = judge_assumptions(conversation);
  demand(judged.size() == aurora_assumptions().size());
  const std::string tracker = tracker_name(conversation);
  demand(!assumption_table(judged, 80).empty() && !assumption_table(judged, 160).empty());
  demand(!assumption_json(judged, tracker).empty());
  return 0;
}
