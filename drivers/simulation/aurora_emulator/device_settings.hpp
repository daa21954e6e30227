// What the emulated Aurora is: its tools, its speed, its firmware. Plain values.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

namespace tubed::aurora::emulator {

/// What the memory chip in a plug holds.
enum class ToolMemory {
  kProgrammed,  ///< PINIT reads the tool's description from it
  kBlank,       ///< PINIT fails with ERROR13 until PVWR has written a description for the port
};

/// A tool and the port it belongs to.
struct Plug {
  int port = 1;                     ///< counts from 1
  std::vector<int> sensors;         ///< sensor of channel 0 and, if the tool has two coils, of channel 1
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

enum class Firmware {
  kCurrent,  ///< takes every rate of COMM
  kOld,      ///< refuses 230400, 921600 and 1228739 with ERROR06
};

struct DeviceSettings {
  std::vector<Plug> plugs = two_coils_a_port(5);
  Durations durations;
  Firmware firmware = Firmware::kCurrent;
  double rate_hz = 40;            ///< measurements a second by the host's clock
  std::uint32_t first_frame = 0;  ///< the counter at power-on
  std::uint64_t seed = 1;         ///< of everything that happens by chance
};

}  // namespace tubed::aurora::emulator
