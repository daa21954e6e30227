#include "drivers/aurora/identity_questions.hpp"

#include <algorithm>
#include <array>

namespace tubed::aurora {

namespace {

/// Items of VER, Sec. "VER" of the guide: firmware, field generator, units.
constexpr std::array<int, 3> kVersions = {4, 7, 8};

void note(auto& kept, std::optional<std::string_view> found) noexcept {
  if (found && !found->empty()) {
    kept = {};
    kept.printable(*found);
  }
}

}  // namespace

CommandLine IdentityQuestions::command() const noexcept {
  return question_ == 0 ? apirev_command() : ver_command(kVersions[question_ - 1]);
}

bool IdentityQuestions::take(const Reply* reply) noexcept {
  const std::string_view said =
      reply != nullptr && reply->kind == ReplyKind::kText ? reply->text() : std::string_view();
  switch (question_) {
    case 0:
      api_revision_ = parse_api_revision(said);
      note(learnt_.api_revision, said);
      break;
    case 1:
      note(learnt_.firmware, find_firmware(said));
      break;
    case 2:
      note(learnt_.field_generator, find_serial_number(said));
      break;
    default:
      note(learnt_.control_unit_serial, find_serial_number(said));
  }
  if (++question_ <= kVersions.size()) {
    return false;
  }
  asked_ = true;
  return true;
}

void IdentityQuestions::take_tools(const PortSetup& ports) noexcept {
  note(learnt_.control_unit_serial, ports.control_unit_serial());
  learnt_.tool_count = 0;
  for (const FoundCoil& coil : ports.found()) {
    const auto tools = std::span(learnt_.tools).first(static_cast<std::size_t>(learnt_.tool_count));
    const bool known = std::any_of(tools.begin(), tools.end(),
                                   [&](const ToolIdentity& tool) { return tool.port == coil.plug.port; });
    if (coil.serial_number != 0 && !known && learnt_.tool_count < kMaxTrackerCoils) {
      learnt_.tools[static_cast<std::size_t>(learnt_.tool_count++)] = {coil.plug.port, coil.serial_number,
                                                                       coil.part_number};
    }
  }
}

}  // namespace tubed::aurora
