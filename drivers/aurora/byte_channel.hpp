// What a session needs of a serial line, and the time. Behind it is a serial port, or a script in a test.
#pragma once

#include <cstdint>
#include <span>

#include "drivers/aurora/bytes.hpp"
#include "drivers/interface/timestamps.hpp"

namespace tubed::aurora {

/// One thread. Nothing here allocates or throws. Once the line is gone it stays so.
class ByteChannel {
 public:
  ByteChannel() = default;
  virtual ~ByteChannel() = default;
  ByteChannel(const ByteChannel&) = delete;
  ByteChannel& operator=(const ByteChannel&) = delete;

  /// How a read() ended.
  struct Arrival {
    std::size_t size = 0;  ///< bytes put into the room; 0: nothing until the deadline, or gone
    bool gone = false;     ///< the line is not there any more
  };

  /// CLOCK_MONOTONIC, or the script's.
  [[nodiscard]] virtual MonotonicTime now() noexcept = 0;
  /// Hands all bytes to the line and does not wait until they are out. False: the line is gone.
  virtual bool write(Bytes bytes) noexcept = 0;
  /// Waits until there is something to read, at most until `deadline`, and takes what there is. A deadline in
  /// the past waits for nothing.
  virtual Arrival read(std::span<std::uint8_t> room, MonotonicTime deadline) noexcept = 0;
  /// Whether set_baud() would work: asked before the tracker is told to change.
  [[nodiscard]] virtual bool knows_baud(int bits_per_second) noexcept = 0;
  /// From now on this rate, 8 data bits, no parity, one stop bit. What was received before is thrown away.
  virtual bool set_baud(int bits_per_second) noexcept = 0;
  /// A serial break of about a quarter of a second, and waits for its end.
  virtual bool send_break() noexcept = 0;
};

}  // namespace tubed::aurora
