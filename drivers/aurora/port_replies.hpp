// Replies about ports, tools and the tracker itself: PHSR, PHINF, VER, APIREV, GET. Each takes the payload of
// a kText reply. Any thread; no state, no allocation.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "drivers/aurora/status.hpp"
#include "drivers/aurora/tracking_reply.hpp"

namespace tubed::aurora {

/// One handle of PHSR.
struct HandleStatus {
  std::uint8_t handle = 0;
  PortStatus status;  ///< its lower 12 bits
};

struct HandleList {
  int count = 0;
  std::array<HandleStatus, kMaxHandles> handles;

  [[nodiscard]] std::span<const HandleStatus> entries() const noexcept {
    return {handles.data(), static_cast<std::size_t>(count)};
  }
};

/// PHSR. Nothing unless every character is accounted for and there are no more than kMaxHandles.
[[nodiscard]] std::optional<HandleList> parse_handle_list(std::string_view payload) noexcept;

/// Text of a fixed width, kept here.
template <std::size_t N>
struct FixedText {
  std::array<char, N> characters{};

  /// Without the blanks at its end.
  [[nodiscard]] std::string_view text() const noexcept {
    const std::string_view all(characters.data(), N);
    const std::size_t last = all.find_last_not_of(std::string_view(" \0", 2));
    return all.substr(0, last == std::string_view::npos ? 0 : last + 1);
  }
};

enum class ToolKind : std::uint8_t {
  kReference = 0x01,
  kProbe = 0x02,
  kButtonBox = 0x03,
  kCArm = 0x0A,
  kCatheter = 0x0B,
};

/// PHINF field 0001.
struct ToolDescription {
  ToolKind kind{};  ///< as sent: other values than the named ones occur
  int switches = 0;
  int lights = 0;
  std::uint8_t subtype = 0;
  FixedText<12> manufacturer;
  FixedText<3> revision;
  std::uint32_t serial_number = 0;  ///< the same for both coils of a two-channel tool
  PortStatus status;                ///< its lower 8 bits
};

/// The manufacturer that the emulated tracker's tools name: what is measured with them is simulated.
inline constexpr std::string_view kSimulatedManufacturer = "TUBED SIM";

/// PHINF field 0020: where a tool is plugged in. Only port and channel tell coils apart: neither handles nor
/// serial numbers do.
struct PortLocation {
  FixedText<8> control_unit_serial;
  int system = 0;
  int tool = 0;
  int port = 0;     ///< counts from 1
  int channel = 0;  ///< 0 or 1
};

/// PHINF: the fields that were asked for.
struct ToolReply {
  bool unoccupied = false;  ///< the plug is gone: there are no fields
  std::optional<ToolDescription> tool;
  std::optional<FixedText<20>> part_number;  ///< field 0004
  std::optional<PortLocation> location;
};

/// PHINF that asked for `fields` (kToolField, kPartNumberField, kLocationField and no others). Nothing unless
/// every character is accounted for.
[[nodiscard]] std::optional<ToolReply> parse_tool(std::string_view payload, std::uint16_t fields) noexcept;

/// APIREV. Family D is the Aurora.
struct ApiRevision {
  char family = '?';
  int major = 0;
  int minor = 0;
};
[[nodiscard]] std::optional<ApiRevision> parse_api_revision(std::string_view payload) noexcept;

/// What follows "Freeze Tag: " on its line of VER:0 or VER:4, as "AURORA Rev 008"; nothing when there is no
/// such line.
[[nodiscard]] std::optional<std::string_view> find_firmware(std::string_view payload) noexcept;

/// What names a unit in the lines of VER:7 (field generator) and VER:8 (control unit, sensor interface
/// units): the rest of the first line that speaks of a serial number, behind its colon or as it stands;
/// nothing when no line does. The wording differs between firmwares, the digits at its end do not.
[[nodiscard]] std::optional<std::string_view> find_serial_number(std::string_view payload) noexcept;

/// Value of `name` in the reply to GET, one `name=value` a line. Looks into `payload`.
[[nodiscard]] std::optional<std::string_view> find_user_parameter(std::string_view payload,
                                                                  std::string_view name) noexcept;

}  // namespace tubed::aurora
