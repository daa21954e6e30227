#include "drivers/aurora/resumption.hpp"

#include <algorithm>

namespace tubed::aurora {

namespace {

// In a row, more than late answers can be: the handles have moved.
constexpr int kMaxAboutOthers = 4;

bool is_as_it_was(const FoundCoil& was, const ToolReply& now) {
  return CoilPlug{now.location->port, now.location->channel} == was.plug &&
         now.tool->serial_number == was.serial_number && now.tool->status.enabled();
}

}  // namespace

void Resumption::remember(std::span<const FoundCoil> tracked) noexcept {
  count_ = std::min(tracked.size(), coils_.size());
  std::copy_n(tracked.begin(), count_, coils_.begin());
  begin();
}

std::size_t Resumption::asked() const noexcept {
  std::size_t first = 0;
  while (first + 1 < count_ && same_[first]) {
    ++first;
  }
  return first;
}

CommandLine Resumption::command() const noexcept {
  return phinf_command(coils_[asked()].handle, kToolField | kLocationField);
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
  std::size_t about = 0;
  while (about < count_ && !is_as_it_was(coils_[about], *tool)) {
    ++about;
  }
  about_others_ = about == asked() ? 0 : about_others_ + 1;
  if (about == count_ || about_others_ > kMaxAboutOthers) {
    return Answer::kOther;
  }
  same_.set(about);
  return same_.count() < count_ ? Answer::kGoOn : Answer::kSame;
}

}  // namespace tubed::aurora
