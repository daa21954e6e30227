// The tracker's end of the serial line: bytes leave one after the other at the line's speed.
#pragma once

#include <cstdint>
#include <deque>
#include <random>
#include <vector>

#include "drivers/aurora/command.hpp"
#include "drivers/interface/timestamps.hpp"

namespace tubed::aurora::emulator {

/// Time that one byte takes: start bit, data bits, parity, stop bits.
[[nodiscard]] std::chrono::nanoseconds byte_time(const LinkParameters& link) noexcept;

/// One thread.
class Wire {
 public:
  explicit Wire(std::uint64_t seed) : random_(seed) {}

  LinkParameters link;  ///< what the tracker speaks now

  /// Sends `bytes` from `start` on, or from when the line is free. Returns when the last one is over.
  MonotonicTime send(std::vector<std::uint8_t> bytes, MonotonicTime start);
  /// Appends to `out` what has come over until `now`. A host that listens at another rate hears noise.
  void take(MonotonicTime now, int host_bits_per_second, std::vector<std::uint8_t>& out);
  /// When the next byte will be over; MonotonicTime::max() when none is on its way.
  [[nodiscard]] MonotonicTime next_byte() const noexcept;
  /// What is on its way is lost.
  void clear() noexcept {
    sending_.clear();
    free_ = {};
  }

  /// A byte as the tracker hears it from a host at that rate.
  [[nodiscard]] std::uint8_t hear(std::uint8_t byte, int host_bits_per_second);

 private:
  struct Sending {
    std::vector<std::uint8_t> bytes;
    MonotonicTime start;
    std::chrono::nanoseconds each;
    std::size_t sent = 0;
    std::uint8_t mask = 0xFF;  ///< of the data bits
    int bits_per_second = 0;

    [[nodiscard]] MonotonicTime over(std::size_t byte) const {
      return start + static_cast<std::int64_t>(byte + 1) * each;
    }
  };

  std::deque<Sending> sending_;
  MonotonicTime free_{};
  std::mt19937 random_;
};

}  // namespace tubed::aurora::emulator
