// The tracker's ports and the handles it gives to what is plugged in.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "drivers/aurora/command.hpp"
#include "drivers/aurora/status.hpp"
#include "drivers/simulation/aurora_emulator/device_settings.hpp"

namespace tubed::aurora::emulator {

/// Codes of ERRORnn that the emulator answers with; kNone is OKAY.
enum class Error : std::uint8_t {
  kNone = 0x00,
  kUnknownCommand = 0x01,
  kTooLong = 0x02,
  kTooShort = 0x03,
  kCrc = 0x04,
  kLinkRefused = 0x06,
  kParameters = 0x07,
  kHandle = 0x08,
  kPriority = 0x09,
  kMode = 0x0C,
  kNoTool = 0x0D,
  kNotInitialised = 0x0E,
  kNotEnabled = 0x0F,
  kSystemNotInitialised = 0x10,
  kCannotInitialise = 0x13,
  kOutOfRange = 0x23,
  kNoSuchParameter = 0x34,
};

struct PortHandle {
  std::uint8_t number = 0;
  std::size_t plug = 0;  ///< index of the tool
  int channel = 0;       ///< 0 or 1
  bool stale = false;    ///< its tool has been pulled out
  bool initialised = false;
  bool enabled = false;

  /// Real units have the bits of switches and bit 17 set in every reply; so has this one.
  [[nodiscard]] PortStatus status() const noexcept;
};

/// One thread. A tool has one handle when it is plugged in and, if it has two coils, a second one from its
/// first PINIT on. Handles are numbered from 0A in the order in which they appear.
class PortHandles {
 public:
  explicit PortHandles(const std::vector<Plug>& plugs);

  /// Power-on, RESET or INIT: no tool is initialised, whatever is plugged in has a new handle.
  void start_anew();
  /// Also what PVWR has written is forgotten: RESET and power-on.
  void forget_descriptions();

  /// Puts a tool in, or pulls it out; false when there is none for that port or it is already so.
  bool plug_in(int port);
  bool pull_out(int port);

  [[nodiscard]] std::vector<PortHandle> list(HandleQuery query);
  [[nodiscard]] const std::vector<PortHandle>& all() const noexcept { return handles_; }
  /// nullptr when there is none of that number.
  [[nodiscard]] PortHandle* find(std::uint8_t number) noexcept;
  [[nodiscard]] const Plug& plug(const PortHandle& handle) const { return tools_[handle.plug].plug; }

  [[nodiscard]] Error initialise(std::uint8_t number);
  [[nodiscard]] Error enable(std::uint8_t number);
  [[nodiscard]] Error disable(std::uint8_t number);
  [[nodiscard]] Error free(std::uint8_t number);
  /// One block of a description; the tool is usable when all 16 have been written.
  [[nodiscard]] Error write(std::uint8_t number, std::uint32_t address);

  /// What has happened at the ports since the host last asked (PHSR).
  SystemStatus news;

 private:
  struct Tool {
    Plug plug;
    bool plugged_in = true;
    std::uint32_t written_blocks = 0;  ///< one bit each
  };
  static constexpr std::uint32_t kAllBlocks = 0xFFFF;

  void give_handles();
  void add_handle(std::size_t plug, int channel);
  [[nodiscard]] bool has_handle(std::size_t plug, int channel) const;
  [[nodiscard]] std::size_t find_tool(int port) const;
  [[nodiscard]] Error check(const PortHandle* handle) const noexcept;

  std::vector<Tool> tools_;
  std::vector<PortHandle> handles_;
};

}  // namespace tubed::aurora::emulator
