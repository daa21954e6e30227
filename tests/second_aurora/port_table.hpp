// Ports, what is plugged into them, and the handles the device allocated (README.md, Handles).
// Used by SecondAurora only, in its thread.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "tests/second_aurora/settings.hpp"

namespace tubed::second_aurora {

inline constexpr std::size_t kRomBytes = 1024;
inline constexpr std::size_t kRomBlockBytes = 64;

struct Handle {
  int number = 0;
  int port = 0;  // from 1; 0: requested with PHRQ for no port in particular
  int channel = 0;
  bool occupied = false, initialised = false, enabled = false;
  bool lost_while_tracking = false;  // DISABLED instead of UNOCCUPIED until tracking starts anew
  Tool tool;
  std::vector<std::uint8_t> written_rom = std::vector<std::uint8_t>(kRomBytes);  // by PVWR
  std::uint16_t written_blocks = 0;                                              // one bit each

  bool rom_is_written() const { return written_blocks == 0xFFFF; }
};

// What PHSR:00 to PHSR:04 ask for.
enum class HandleQuery { All, ToBeFreed, Uninitialised, Initialised, Enabled };

class PortTable {
 public:
  // The settings are kept by reference and outlive the table.
  explicit PortTable(const Settings& settings);

  // What is plugged in stays, all handles are forgotten.
  void forget_handles();
  // Allocates a handle for every occupied port that has none.
  void allocate_missing();
  void plug(int port, const Tool& tool);
  void unplug(int port, bool tracking);
  bool occupied(int port) const { return tools_.at(static_cast<std::size_t>(port - 1)).has_value(); }
  void tracking_starts();

  Handle* find(int number);
  // Handles in the order of their numbers.
  std::vector<const Handle*> list(HandleQuery query) const;
  // The status PHSR and PHINF report: 3 hexadecimal digits.
  int status_of(const Handle& handle) const;
  void free(int number);
  // PHRQ: the handle of an occupied port, otherwise a new one; port 0: any.
  int request(int port, int channel);
  // PINIT has read the plug: marks all coils of the plug initialised; the second coil's handle appears here.
  void initialise(const Handle& handle);

 private:
  Handle& allocate(int port, int channel);
  Handle* of_coil(int port, int channel);

  const Settings& settings_;
  std::vector<std::optional<Tool>> tools_;  // [0] is port 1
  std::vector<Handle> handles_;
  int highest_number_ = 0x09;
};

}  // namespace tubed::second_aurora
