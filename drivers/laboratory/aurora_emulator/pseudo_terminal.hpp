// A serial port without a plug: the emulator's end of a pseudo-terminal.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "drivers/aurora/bytes.hpp"

namespace tubed::aurora::emulator {

/// The other end is opened by a driver like any serial port. It begins raw, at 9600 baud. A serial break does
/// not reach this end: Linux drops it on a pseudo-terminal. One thread.
class PseudoTerminal {
 public:
  /// Makes one, and a symbolic link to its other end at `link` unless that is empty; a link left there by an
  /// earlier run is replaced. Throws std::runtime_error with what to do.
  explicit PseudoTerminal(std::filesystem::path link);
  ~PseudoTerminal();
  PseudoTerminal(const PseudoTerminal&) = delete;
  PseudoTerminal& operator=(const PseudoTerminal&) = delete;

  /// What a driver opens: the link if there is one.
  [[nodiscard]] std::string path() const { return link_.empty() ? device_ : link_.string(); }
  [[nodiscard]] int descriptor() const noexcept { return master_; }
  /// Whether somebody has the other end open.
  [[nodiscard]] bool in_use() const;
  /// Rate that the other end has set.
  [[nodiscard]] int bits_per_second() const;

  /// Appends what has been sent from the other end.
  void read(std::vector<std::uint8_t>& bytes);
  /// Sends to the other end; what it is too slow to take is lost, as on a real line.
  void write(Bytes bytes);

 private:
  void close() noexcept;

  std::filesystem::path link_;
  std::string device_;
  int master_ = -1;
};

}  // namespace tubed::aurora::emulator
