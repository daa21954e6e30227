// A serial port of Linux as a ByteChannel.
#pragma once

#include <string>

#include "drivers/aurora/byte_channel.hpp"
#include "drivers/aurora_serial/port_surroundings.hpp"

namespace tubed {

/// Raw, 8N1, no handshake, exactly the rate that was asked for, for us alone, with low latency where the
/// driver of the port offers it. What a port does not know (a pseudo-terminal has no modem lines, no low
/// latency and no break) is done without. One thread. Nothing but the constructor allocates, and nothing
/// waits for a line that takes no bytes.
class SerialPort final : public aurora::ByteChannel {
 public:
  /// `path`: as /dev/serial/by-id/usb-NDI_Aurora..., followed anew each time it is opened.
  explicit SerialPort(std::string path, SystemPlaces places = {})
      : surroundings_(std::move(path), std::move(places)) {}
  ~SerialPort() override { close(); }

  /// 0, or errno; EBUSY: another program has it, and is not disturbed. Harmless when open.
  int open() noexcept;
  /// What has not been sent is thrown away.
  void close() noexcept;
  [[nodiscard]] bool is_open() const noexcept { return descriptor_ >= 0; }
  [[nodiscard]] const std::string& path() const noexcept { return surroundings_.path(); }
  /// Why the newest open() gave `error`, and what to do: a sentence with the path, and with the program that
  /// has the port, or the name under which the adapter is back. Looks for that program for `longest` at most,
  /// and once a second at most.
  [[nodiscard]] aurora::Problem explain(
      int error, std::chrono::nanoseconds longest = PortSurroundings::kMaxLook) noexcept {
    return surroundings_.explain(error, lock_owner_, longest);
  }
  /// Of the open port: what a person should know (see PortSurroundings::note), as of the newest look.
  [[nodiscard]] aurora::Problem note() const noexcept {
    return is_open() ? surroundings_.note() : aurora::Problem();
  }
  /// Looks for what note() says, for `longest` at most; a look that is not finished goes on at the next call.
  void look_around(std::chrono::nanoseconds longest) noexcept;
  /// As of the newest look at the open port; process 0: none was seen.
  [[nodiscard]] const PortHolder& other_program() const noexcept { return surroundings_.other_program(); }
  /// Milliseconds for which FTDI's chip holds bytes back, read back after 1 ms was asked for; nothing for
  /// other adapters.
  [[nodiscard]] std::optional<int> latency_timer_ms() const noexcept { return surroundings_.latency_timer(); }
  /// "ttyUSB0", whatever the path was, as of the newest successful open(); empty when the kernel does not
  /// say.
  [[nodiscard]] BoundedText<32> device_name() const noexcept { return surroundings_.name(); }
  /// The USB adapter, as of the newest successful open().
  [[nodiscard]] const std::optional<UsbIdentity>& adapter() const noexcept { return surroundings_.adapter(); }

  [[nodiscard]] MonotonicTime now() noexcept override;
  bool write(aurora::Bytes bytes) noexcept override;
  /// Sleeps until read() has something, until `deadline` at most. Precondition: is_open().
  void wait(MonotonicTime deadline) noexcept;
  Arrival read(std::span<std::uint8_t> room, MonotonicTime deadline) noexcept override;
  [[nodiscard]] bool knows_baud(int bits_per_second) noexcept override;
  bool set_baud(int bits_per_second) noexcept override;
  bool send_break() noexcept override;

 private:
  int take_for_us() noexcept;
  bool lock_records() noexcept;
  bool configure(int bits_per_second) noexcept;
  bool configure_by_name(int bits_per_second) noexcept;
  void ask_for_low_latency() noexcept;
  void shorten_closing() noexcept;
  bool discard_output() noexcept;

  PortSurroundings surroundings_;
  int descriptor_ = -1;
  int lock_owner_ = 0;  ///< process that kept the newest open() from locking; 0: not known
};

}  // namespace tubed
