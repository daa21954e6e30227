// Makes the coils that are plugged in ready to be tracked: which commands, in which order, and what the
// replies mean. No channel, no time: a session sends what it is given.
#pragma once

#include <chrono>
#include <span>

#include "drivers/aurora/coil_map.hpp"
#include "drivers/aurora/command.hpp"
#include "drivers/aurora/port_replies.hpp"
#include "drivers/aurora/reply.hpp"
#include "drivers/interface/bounded_text.hpp"

namespace tubed::aurora {

/// What a tool's memory should have held, for tools whose memory was never written. A tool becomes usable
/// only when its whole memory was written: a definition file may be shorter, zeros follow it.
struct ToolDefinition {
  static constexpr std::size_t kSize = 1024;  ///< bytes of a tool's memory: 16 blocks of PVWR
  int port = 0;
  Bytes bytes;  ///< up to kSize; has to outlive the setup
};

/// What was found out about one handle.
struct FoundCoil {
  std::uint8_t handle = 0;
  CoilPlug plug;  ///< port 0: the tracker did not say
  std::uint32_t serial_number = 0;
  BoundedText<20> part_number = {};
  bool simulated = false;       ///< a tool of the emulated tracker
  bool usable = false;          ///< initialised, and enabled if the map has it
  bool other_tool = false;      ///< the map expects another tool in this plug
  bool unoccupied = false;      ///< allocated, but its tool is gone
  std::uint8_t error_code = 0;  ///< why it is not usable; 0: it is, or it did not answer
};

/// Frees stale handles; initialises what is plugged in until nothing is left (the second coil of a plug
/// appears only then), writing tool definitions where there are some; asks every handle for its port and
/// channel; enables the coils of the map and no others. A handle that fails is left out; the others go on.
/// One thread; no allocation.
class PortSetup {
 public:
  enum class State {
    kBusy,      ///< send command(), then take() the reply
    kDone,      ///< see found()
    kMustHalt,  ///< the tracker is tracking: TSTOP first
    kMustInit,  ///< the tracker is not initialised: INIT first
    kNoAnswer   ///< the link does not work
  };

  /// `tools` has to outlive the setup.
  PortSetup(const CoilMap& coils, std::span<const ToolDefinition> tools) noexcept
      : coils_(coils), tools_(tools) {}

  void begin() noexcept;
  [[nodiscard]] State state() const noexcept { return state_; }
  [[nodiscard]] CommandLine command() const noexcept;
  [[nodiscard]] std::chrono::nanoseconds timeout() const noexcept;
  /// The reply to command(); nullptr: there was none.
  void take(const Reply* reply) noexcept;

  /// Every handle that was met, also those that failed and those whose tool is gone.
  [[nodiscard]] std::span<const FoundCoil> found() const noexcept { return {found_.data(), found_count_}; }
  [[nodiscard]] const CoilMap& coils() const noexcept { return coils_; }
  /// Of the tracker, as the tools' descriptions have it.
  [[nodiscard]] std::string_view control_unit_serial() const noexcept { return control_unit_serial_.text(); }
  /// What is being done, as "PINIT of handle 0B, 2 of 4".
  [[nodiscard]] BoundedText<63> progress() const noexcept;

 private:
  enum class Step {
    kListStale,
    kFree,
    kListNew,
    kLocate,  ///< before a tool definition is written
    kWrite,
    kInitialise,
    kLocateFailed,  ///< only to say which plug it is
    kListReady,
    kListEnabled,  ///< left enabled by somebody else
    kDescribe,
    kEnable,
    kDisable
  };

  void take_list(const Reply* reply) noexcept;
  void add_handles(const HandleList& list) noexcept;
  void start_pass() noexcept;
  [[nodiscard]] Step first_step_of_initialising() const noexcept;
  void next_to_describe() noexcept;
  void next_handle() noexcept;
  void step_done(const Reply* reply) noexcept;
  void describe(const Reply* reply) noexcept;
  void choose(FoundCoil& described, bool enabled) noexcept;
  void enter(Step step) noexcept;
  bool retry() noexcept;
  bool silent_before() noexcept;
  bool out_of_order(const Reply& reply) noexcept;
  [[nodiscard]] std::uint8_t handle() const noexcept { return handles_[at_]; }
  [[nodiscard]] FoundCoil& coil(std::uint8_t handle) noexcept;
  [[nodiscard]] const ToolDefinition* definition() const noexcept;

  CoilMap coils_;
  std::span<const ToolDefinition> tools_;
  State state_ = State::kDone;
  Step step_ = Step::kListStale;
  std::array<std::uint8_t, kMaxHandles> handles_{};  ///< of the list being worked on
  std::size_t handle_count_ = 0;
  std::size_t at_ = 0;
  std::size_t block_ = 0;  ///< of the tool definition
  int passes_ = 0;
  int attempts_ = 0;
  CoilPlug located_;         ///< of the handle being initialised
  std::uint8_t silent_ = 0;  ///< handle whose PINIT was not answered, also by an earlier setup; 0: none
  FixedText<8> control_unit_serial_;
  std::array<FoundCoil, kMaxHandles> found_{};
  std::size_t found_count_ = 0;
};

}  // namespace tubed::aurora
