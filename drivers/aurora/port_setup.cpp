#include "drivers/aurora/port_setup.hpp"

#include <algorithm>
#include <utility>

#include "drivers/aurora/error_codes.hpp"

namespace tubed::aurora {

namespace {

using std::chrono::milliseconds;

constexpr int kAttempts = 3;
constexpr int kInitialiseAttempts = 2;
constexpr int kMaxPasses = 6;  ///< over a list that does not become empty
constexpr std::uint8_t kNotInThisMode = 0x0C;
constexpr std::uint8_t kNotInitialised = 0x10;
constexpr std::uint8_t kHandleGone = 0x08;

// PINIT reads the tool's memory for 2.5 s, also when it fails.
constexpr milliseconds kInitialiseTimeout{6000};
constexpr milliseconds kTimeout{1500};
/// Questions that some other means answers as well.
constexpr milliseconds kOptionalTimeout{500};

constexpr std::uint16_t kDescription = kToolField | kPartNumberField | kLocationField;
constexpr std::size_t kToolBlocks = ToolDefinition::kSize / kToolMemoryBlock;

/// What the file has of a block; nothing behind its end.
Bytes block_of(Bytes file, std::size_t block) noexcept {
  return file.subspan(std::min(file.size(), block * kToolMemoryBlock));
}

}  // namespace

void PortSetup::begin() noexcept {
  found_ = {};
  found_count_ = handle_count_ = at_ = 0;
  passes_ = attempts_ = 0;
  state_ = State::kBusy;
  step_ = Step::kListStale;
}

CommandLine PortSetup::command() const noexcept {
  switch (step_) {
    case Step::kListStale:
      return phsr_command(HandleQuery::kToBeFreed);
    case Step::kFree:
      return phf_command(handle());
    case Step::kListNew:
      return phsr_command(HandleQuery::kToBeInitialised);
    case Step::kLocate:
    case Step::kLocateFailed:
      return phinf_command(handle(), kLocationField);
    case Step::kWrite:
      return pvwr_command(handle(), static_cast<std::uint16_t>(block_ * kToolMemoryBlock),
                          block_of(definition()->bytes, block_));
    case Step::kInitialise:
      return pinit_command(handle());
    case Step::kListReady:
      return phsr_command(HandleQuery::kToBeEnabled);
    case Step::kListEnabled:
      return phsr_command(HandleQuery::kEnabled);
    case Step::kDescribe:
      return phinf_command(handle(), kDescription);
    case Step::kEnable:
      return pena_command(handle(), TrackingPriority::kDynamic);
    case Step::kDisable:
      break;
  }
  return pdis_command(handle());
}

std::chrono::nanoseconds PortSetup::timeout() const noexcept {
  switch (step_) {
    case Step::kInitialise:
      return kInitialiseTimeout;
    case Step::kListEnabled:
    case Step::kLocate:
    case Step::kLocateFailed:
      return kOptionalTimeout;
    default:
      return kTimeout;
  }
}

void PortSetup::take(const Reply* reply) noexcept {
  if (reply != nullptr && reply->kind == ReplyKind::kError) {
    if (out_of_order(*reply)) {
      return;
    }
    const bool again = describe_error(reply->error_code).remedy == Remedy::kRetry ||
                       describe_error(reply->error_code).remedy == Remedy::kCheckLink;
    if (again && retry()) {
      return;
    }
  }
  switch (step_) {
    case Step::kListStale:
    case Step::kListNew:
    case Step::kListReady:
    case Step::kListEnabled:
      take_list(reply);
      break;
    case Step::kDescribe:
    case Step::kLocate:
    case Step::kLocateFailed:
      describe(reply);
      break;
    case Step::kInitialise:
      if (reply == nullptr && !silent_before()) {
        state_ = State::kNoAnswer;
        return;
      }
      step_done(reply);
      break;
    default:
      if (reply == nullptr && retry()) {
        return;
      }
      step_done(reply);
  }
}

// PINIT is waited for the longest. A tracker that starts anew meanwhile does not hear the line any more: the
// link is looked for before seconds go by for every other tool. A tool for which the tracker falls silent
// twice is left out.
bool PortSetup::silent_before() noexcept { return std::exchange(silent_, handle()) == handle(); }

bool PortSetup::retry() noexcept {
  return ++attempts_ < (step_ == Step::kInitialise ? kInitialiseAttempts : kAttempts);
}

void PortSetup::enter(Step step) noexcept {
  step_ = step;
  attempts_ = 0;
}

bool PortSetup::out_of_order(const Reply& reply) noexcept {
  const bool list = step_ == Step::kListStale || step_ == Step::kListNew || step_ == Step::kListReady;
  if (!list || (reply.error_code != kNotInThisMode && reply.error_code != kNotInitialised)) {
    return false;
  }
  state_ = reply.error_code == kNotInThisMode ? State::kMustHalt : State::kMustInit;
  return true;
}

void PortSetup::take_list(const Reply* reply) noexcept {
  const auto list =
      reply != nullptr && reply->kind == ReplyKind::kText ? parse_handle_list(reply->text()) : std::nullopt;
  if (!list) {
    const bool optional = step_ == Step::kListEnabled;
    if (!optional && retry()) {
      return;
    }
    if (!optional) {
      state_ = State::kNoAnswer;
      return;
    }
  }
  if (step_ != Step::kListEnabled) {
    handle_count_ = 0;
  }
  if (list) {
    add_handles(*list);
  }
  start_pass();
}

// Of handles to be initialised, those that have failed are not tried again.
void PortSetup::add_handles(const HandleList& list) noexcept {
  for (const HandleStatus& entry : list.entries()) {
    const bool failed =
        step_ == Step::kListNew &&
        std::any_of(found().begin(), found().end(), [&](const auto& f) { return f.handle == entry.handle; });
    const auto end = handles_.begin() + static_cast<std::ptrdiff_t>(handle_count_);
    const bool known = std::find(handles_.begin(), end, entry.handle) != end;
    if (!failed && !known && handle_count_ < handles_.size()) {
      handles_[handle_count_++] = entry.handle;
    }
  }
}

void PortSetup::start_pass() noexcept {
  at_ = 0;
  const bool work = handle_count_ > 0 && ++passes_ <= kMaxPasses;
  switch (step_) {
    case Step::kListStale:
      passes_ = work ? passes_ : 0;
      enter(work ? Step::kFree : Step::kListNew);
      break;
    case Step::kListNew:
      if (work) {
        enter(first_step_of_initialising());
      } else {
        enter(Step::kListReady);
      }
      break;
    case Step::kListReady:
      enter(Step::kListEnabled);
      break;
    default:
      next_to_describe();
  }
}

PortSetup::Step PortSetup::first_step_of_initialising() const noexcept {
  return tools_.empty() ? Step::kInitialise : Step::kLocate;
}

void PortSetup::next_to_describe() noexcept {
  if (at_ < handle_count_) {
    enter(Step::kDescribe);
    return;
  }
  state_ = State::kDone;
}

// The pass over a list: the next handle's first step, or the list once more.
void PortSetup::next_handle() noexcept {
  ++at_;
  block_ = 0;
  const bool more = at_ < handle_count_;
  switch (step_) {
    case Step::kFree:
      enter(more ? Step::kFree : Step::kListStale);
      break;
    case Step::kLocate:
    case Step::kLocateFailed:
    case Step::kWrite:
    case Step::kInitialise:
      enter(more ? first_step_of_initialising() : Step::kListNew);
      break;
    default:
      next_to_describe();
  }
}

void PortSetup::step_done(const Reply* reply) noexcept {
  const std::uint8_t error = reply != nullptr && reply->kind == ReplyKind::kError ? reply->error_code : 0;
  switch (step_) {
    case Step::kWrite:
      if (carried_out(reply) && ++block_ < kToolBlocks) {
        enter(Step::kWrite);
      } else {
        enter(Step::kInitialise);  // when writing failed, PINIT says what that means
      }
      return;
    case Step::kInitialise:
      silent_ = carried_out(reply) ? 0 : silent_;
      if (!carried_out(reply) && error != kHandleGone) {
        FoundCoil& failed = coil(handle());
        failed.error_code = error;
        enter(Step::kLocateFailed);
        return;
      }
      break;
    case Step::kEnable: {
      FoundCoil& enabled = coil(handle());
      enabled.usable = carried_out(reply);
      enabled.error_code = error;
      break;
    }
    default:
      break;
  }
  next_handle();
}

void PortSetup::describe(const Reply* reply) noexcept {
  const std::uint16_t fields = step_ == Step::kDescribe ? kDescription : kLocationField;
  const auto tool =
      reply != nullptr && reply->kind == ReplyKind::kText ? parse_tool(reply->text(), fields) : std::nullopt;
  if (!tool && (reply == nullptr || reply->kind == ReplyKind::kText) && step_ == Step::kDescribe && retry()) {
    return;
  }
  const CoilPlug plug =
      tool && tool->location ? CoilPlug{tool->location->port, tool->location->channel} : CoilPlug{};
  if (step_ == Step::kLocate) {
    located_ = plug;
    block_ = 0;
    enter(definition() != nullptr && !definition()->bytes.empty() ? Step::kWrite : Step::kInitialise);
    return;
  }
  FoundCoil& described = coil(handle());
  if (!tool || tool->unoccupied) {
    described.unoccupied = tool.has_value();
    next_handle();
    return;
  }
  described.plug = plug;
  if (step_ == Step::kLocateFailed) {
    next_handle();
    return;
  }
  described.serial_number = tool->tool->serial_number;
  described.part_number = {};
  described.part_number.printable(tool->part_number->text());
  described.simulated = tool->tool->manufacturer.text() == kSimulatedManufacturer;
  control_unit_serial_ = tool->location->control_unit_serial;
  choose(described, tool->tool->status.enabled());
}

// Enables what the map has, disables what it does not.
void PortSetup::choose(FoundCoil& described, bool enabled) noexcept {
  const auto index = coils_.coil_at(described.plug);
  const bool twice = std::any_of(found().begin(), found().end(), [&](const FoundCoil& other) {
    return other.usable && other.plug == described.plug && other.handle != described.handle;
  });
  described.other_tool =
      index && !coils_.expected(*index).matches(described.serial_number, described.part_number.text());
  const bool wanted = index && !twice && !described.other_tool;
  described.usable = enabled == wanted && !twice && !described.other_tool;
  if (wanted != enabled) {
    enter(wanted ? Step::kEnable : Step::kDisable);
    return;
  }
  next_handle();
}

FoundCoil& PortSetup::coil(std::uint8_t handle) noexcept {
  for (std::size_t i = 0; i < found_count_; ++i) {
    if (found_[i].handle == handle) {
      return found_[i];
    }
  }
  found_count_ = std::min(found_count_ + 1, found_.size());
  found_[found_count_ - 1].handle = handle;
  return found_[found_count_ - 1];
}

BoundedText<63> PortSetup::progress() const noexcept {
  BoundedText<63> words;
  const CommandLine line = command();  // owns the text
  words << line.text().substr(0, line.text().find_first_of(": "));
  if (step_ == Step::kListStale || step_ == Step::kListNew || step_ == Step::kListReady ||
      step_ == Step::kListEnabled) {
    return words << ", looking for tools";
  }
  (words << " of handle ").hex(handle());
  return words << ", " << static_cast<int>(at_) + 1 << " of " << static_cast<int>(handle_count_);
}

const ToolDefinition* PortSetup::definition() const noexcept {
  const auto found = std::find_if(tools_.begin(), tools_.end(),
                                  [this](const ToolDefinition& tool) { return tool.port == located_.port; });
  return located_.port == 0 || found == tools_.end() ? nullptr : &*found;
}

}  // namespace tubed::aurora
