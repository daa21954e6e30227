// The tracker's ports and the handles it gives to what is plugged in.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "drivers/aurora/bytes.hpp"
#include "drivers/aurora/command.hpp"
#include "drivers/aurora/status.hpp"
#include "drivers/aurora/tracking_reply.hpp"
#include "drivers/laboratory/aurora_emulator/device_settings.hpp"

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
  kNoHandleLeft = 0x2D,
  kPortDescription = 0x2F,
  kPortAssigned = 0x30,
  kNoSuchParameter = 0x34,
};

struct PortHandle {
  std::uint8_t number = 0;
  std::size_t plug = 0;                    ///< index of the tool
  int channel = 0;                         ///< 0 or 1
  bool stale = false;                      ///< its tool has been pulled out
  bool empty_when_tracking_began = false;  ///< stale since before the last TSTART
  bool initialised = false;
  bool enabled = false;

  /// As TX and BX have it: without data DISABLED or, for a port that was empty when tracking began,
  /// UNOCCUPIED.
  [[nodiscard]] Report report_without_data() const noexcept;
  /// Real units have the bits of switches and bit 17 set once a tool is initialised; so has this one.
  [[nodiscard]] PortStatus status() const noexcept;
};

/// What PVWR has written for a tool.
struct ToolImage {
  static constexpr std::size_t kSize = 1024;
  std::array<std::uint8_t, kSize> bytes{};
  std::uint32_t blocks = 0;  ///< one bit for each block of kToolMemoryBlock that has come

  /// All blocks have come, and they are not zeros alone.
  [[nodiscard]] bool complete() const noexcept;
};

/// What PHRQ asks for; nothing where it has asterisks.
struct PortRequest {
  std::optional<int> port;
  std::optional<int> channel;
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

  /// Puts the tool of that port in, or pulls out what is in it; false when there is none or it is already so.
  bool plug_in(int port);
  bool pull_out(int port);
  /// Puts another tool into `port`: it has the coils of the tool of that port, or one that nothing moves when
  /// there is none. False when the port is occupied.
  bool plug_in_stranger(int port, std::uint32_t serial_number, std::string_view part_number);

  /// TSTART: handles whose tool is gone by now are UNOCCUPIED from here on.
  void begin_tracking();

  [[nodiscard]] std::vector<PortHandle> list(HandleQuery query);
  [[nodiscard]] const std::vector<PortHandle>& all() const noexcept { return handles_; }
  /// nullptr when there is none of that number.
  [[nodiscard]] PortHandle* find(std::uint8_t number) noexcept;
  [[nodiscard]] const Plug& plug(const PortHandle& handle) const { return tools_[handle.plug].plug; }

  [[nodiscard]] Error initialise(std::uint8_t number);
  [[nodiscard]] Error enable(std::uint8_t number);
  [[nodiscard]] Error disable(std::uint8_t number);
  [[nodiscard]] Error free(std::uint8_t number);
  /// One block of a description, kToolMemoryBlock bytes; the tool is usable when all 16 have been written.
  [[nodiscard]] Error write(std::uint8_t number, std::uint32_t address, Bytes block);
  /// What has been written for the tool in `port`; nullptr when there is no tool.
  [[nodiscard]] const ToolImage* written(int port) const;
  /// A handle for the first tool that meets `request` and has none: its number goes to `number`.
  [[nodiscard]] Error request(const PortRequest& request, std::uint8_t& number);

  /// What has happened at the ports since the host last asked (PHSR).
  SystemStatus news;

 private:
  struct Tool {
    Plug plug;
    bool plugged_in = true;
    ToolImage image;
  };

  bool plug_in_tool(std::size_t tool);
  void give_handles();
  /// nullptr when there are no more to give until others are freed.
  PortHandle* add_handle(std::size_t plug, int channel);
  [[nodiscard]] bool has_handle(std::size_t plug, int channel) const;
  /// The tool that belongs to `port`, the one that is in it; tools_.size() when there is none.
  [[nodiscard]] std::size_t tool_of(int port) const;
  [[nodiscard]] std::size_t tool_in(int port) const;
  [[nodiscard]] Error check(const PortHandle* handle) const noexcept;

  std::vector<Tool> tools_;
  std::vector<PortHandle> handles_;
};

}  // namespace tubed::aurora::emulator
