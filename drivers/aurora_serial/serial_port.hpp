// A serial port of Linux as a ByteChannel.
#pragma once

#include <string>
#include <string_view>

#include "drivers/aurora/byte_channel.hpp"

namespace tubed {

/// Raw, 8N1, no handshake, exactly the rate that was asked for, for us alone, with low latency where the
/// driver of the port offers it. What a port does not know (a pseudo-terminal has no modem lines, no low
/// latency and no break) is done without. One thread. Nothing but the constructor allocates.
class SerialPort final : public aurora::ByteChannel {
 public:
  /// `path`: as /dev/serial/by-id/usb-NDI_Aurora..., followed anew each time it is opened.
  explicit SerialPort(std::string path) : path_(std::move(path)) {}
  ~SerialPort() override { close(); }

  /// 0, or errno. Harmless when open.
  int open() noexcept;
  void close() noexcept;
  [[nodiscard]] bool is_open() const noexcept { return descriptor_ >= 0; }
  [[nodiscard]] const std::string& path() const noexcept { return path_; }

  [[nodiscard]] MonotonicTime now() noexcept override;
  bool write(aurora::Bytes bytes) noexcept override;
  Arrival read(std::span<std::uint8_t> room, MonotonicTime deadline) noexcept override;
  [[nodiscard]] bool knows_baud(int bits_per_second) noexcept override;
  bool set_baud(int bits_per_second) noexcept override;
  bool send_break() noexcept override;

 private:
  int take_for_us() noexcept;
  bool configure(int bits_per_second) noexcept;
  bool configure_by_name(int bits_per_second) noexcept;
  void ask_for_low_latency() noexcept;

  std::string path_;
  int descriptor_ = -1;
};

/// What is wrong and what to do when open() gave `error`, in a few words without the path: "is used by
/// another program: close it". The text is constant.
[[nodiscard]] std::string_view describe_open_error(int error) noexcept;

}  // namespace tubed
