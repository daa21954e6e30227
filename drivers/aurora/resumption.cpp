#include "drivers/aurora/resumption.hpp"

#include <algorithm>

namespace tubed::aurora {

void Resumption::remember(std::span<const FoundCoil> tracked) noexcept {
  count_ = std::min(tracked.size(), coils_.size());
  std::copy_n(tracked.begin(), count_, coils_.begin());
  at_ = 0;
}

CommandLine Resumption::command() const noexcept {
  return phinf_command(coils_[at_].handle, kToolField | kLocationField);
}

// What was said at other rates may stand before the command, and be taken for a part of it; a BX from before
// the interruption may be answered late.
bool Resumption::is_no_answer(const Reply& reply) noexcept {
  constexpr std::uint8_t kInvalidCommand = 0x01;
  constexpr std::uint8_t kLastOfDamagedCommands = 0x05;
  return reply.kind == ReplyKind::kBinary ||
         (reply.kind == ReplyKind::kError && reply.error_code >= kInvalidCommand &&
          reply.error_code <= kLastOfDamagedCommands);
}

Resumption::Answer Resumption::take(const Reply& reply) noexcept {
  if (is_no_answer(reply)) {
    return Answer::kAgain;
  }
  const auto tool =
      reply.kind == ReplyKind::kText ? parse_tool(reply.text(), kToolField | kLocationField) : std::nullopt;
  if (!tool || !tool->tool || !tool->location) {
    return Answer::kOther;
  }
  const FoundCoil& was = coils_[at_];
  const bool same = CoilPlug{tool->location->port, tool->location->channel} == was.plug &&
                    tool->tool->serial_number == was.serial_number && tool->tool->status.enabled();
  if (!same) {
    return Answer::kOther;
  }
  return ++at_ < count_ ? Answer::kGoOn : Answer::kSame;
}

}  // namespace tubed::aurora
