// A Device at a pseudo-terminal, in real time.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/laboratory/aurora_emulator/control_socket.hpp"
#include "drivers/laboratory/aurora_emulator/device.hpp"
#include "drivers/laboratory/aurora_emulator/pseudo_terminal.hpp"

namespace tubed::aurora::emulator {

/// One thread, which calls step() again and again. While the device is hung up there is no pseudo-terminal;
/// the one after that has another name, behind the same link.
class SerialFront {
 public:
  /// `link`: see PseudoTerminal. `control`: where commands come in; empty = nowhere. `device` has to outlive
  /// it. Throws std::runtime_error with what to do.
  SerialFront(Device& device, std::filesystem::path link, const std::filesystem::path& control);

  /// Sleeps until something happens, 50 ms at most, and does what is due. Returns the complaint about a
  /// command that was not understood, mostly nothing.
  std::string step();

  /// What a driver opens; empty while hung up.
  [[nodiscard]] std::string path() const { return terminal_ ? terminal_->path() : std::string(); }

 private:
  void wait(MonotonicTime now) const;
  void exchange_bytes(MonotonicTime now);

  Device& device_;
  std::filesystem::path link_;
  std::unique_ptr<ControlSocket> control_;
  std::unique_ptr<PseudoTerminal> terminal_;
  std::vector<std::uint8_t> incoming_;
  std::vector<std::uint8_t> outgoing_;
};

}  // namespace tubed::aurora::emulator
