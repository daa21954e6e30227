// The rate a serial port is set to, as a number: termios names only some.
#pragma once

namespace tubed::aurora::emulator {

/// Bits per second of an open terminal, 0 when it has none.
[[nodiscard]] int line_speed(int descriptor) noexcept;

}  // namespace tubed::aurora::emulator
