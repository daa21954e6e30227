// What the emulated Aurora is: its tools, its speed, its firmware. Plain values.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace tubed::aurora::emulator {

/// What the memory chip in a plug holds.
enum class ToolMemory {
  kProgrammed,  ///< PINIT reads the tool's description from it
  kBlank,       ///< PINIT fails with ERROR13 until PVWR has written a description for the port
};

/// A tool and the port it belongs to. It may be one that no host has in its configuration.
struct Plug {
  int port = 1;  ///< counts from 1
  /// Sensor of channel 0 and, if the tool has two coils, of channel 1. Sensor 0 is a coil that nothing moves:
  /// it is always MISSING.
  std::vector<int> sensors;
  std::uint32_t serial_number = 0;  ///< one a tool, also with two coils
  std::string part_number = "610029";
  ToolMemory memory = ToolMemory::kProgrammed;
};

/// `sensors` coils, two a port from port 1 on; of an odd number the last is alone on its port.
/// Serial numbers are 3C4B0000 and the port.
[[nodiscard]] std::vector<Plug> two_coils_a_port(int sensors);

/// How long the tracker thinks between the end of a command and the beginning of its reply. Recorded where
/// not said otherwise.
struct Durations {
  using ns = std::chrono::nanoseconds;
  ns reset = std::chrono::milliseconds(1300);  ///< from a break to the word RESET
  ns init = std::chrono::milliseconds(50);
  ns pinit = std::chrono::milliseconds(140);  ///< 2500 when the tool's memory is read
  ns tstart = std::chrono::milliseconds(1400);
  ns tstop = std::chrono::milliseconds(340);
  ns pvwr = std::chrono::milliseconds(40);       ///< what remains of 190 besides the wire at 9600
  ns other = std::chrono::milliseconds(2);       ///< an assumption
  ns tracking = std::chrono::microseconds(500);  ///< TX and BX; an assumption
};

/// A version of the control unit's firmware. Which revision has which API, and what each refuses, is an
/// assumption: what is known is that such trackers are in use.
struct Firmware {
  std::string_view freeze_tag;    ///< of VER:0 and VER:4
  std::string_view api_revision;  ///< of APIREV
  bool takes_fast_rates = true;   ///< false: 230400, 921600 and 1228739 are ERROR06
  bool knows_getinfo = true;      ///< false: GETINFO is ERROR01
  bool knows_bx = true;           ///< false: BX is ERROR01, TX remains

  static const Firmware kCurrent;
  static const Firmware kPrevious;
  static const Firmware kOld;
  static const Firmware kOldest;
};
inline constexpr Firmware Firmware::kCurrent{"AURORA Rev 008", "D.001.007"};
inline constexpr Firmware Firmware::kPrevious{"AURORA Rev 008", "D.001.006", true, false};
inline constexpr Firmware Firmware::kOld{"AURORA Rev 006", "D.001.005", false, false};
inline constexpr Firmware Firmware::kOldest{"AURORA Rev 005", "D.001.004", false, false, false};
inline constexpr std::array kFirmwares = {Firmware::kOldest, Firmware::kOld, Firmware::kPrevious,
                                          Firmware::kCurrent};

/// Whether PHINF is answered while tracking. No recording has it either way.
enum class PhinfWhileTracking { kAnswered, kRefused };

struct DeviceSettings {
  std::vector<Plug> plugs = two_coils_a_port(5);
  Durations durations;
  Firmware firmware = Firmware::kCurrent;
  PhinfWhileTracking phinf_while_tracking = PhinfWhileTracking::kAnswered;  ///< kRefused: ERROR0C
  double rate_hz = 40;            ///< measurements a second by the host's clock
  std::uint32_t first_frame = 0;  ///< the counter at power-on and after INIT
  std::uint64_t seed = 1;         ///< of everything that happens by chance
};

}  // namespace tubed::aurora::emulator
