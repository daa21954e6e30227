// What a person should know of a serial port beside what is said over it.
#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "drivers/aurora_serial/port_holder.hpp"
#include "drivers/aurora_serial/usb_adapter.hpp"

namespace tubed {

/// Which other process uses a port, and which adapter the port belongs to. One thread; allocates only when it
/// is made.
class PortSurroundings {
 public:
  PortSurroundings(std::string path, SystemPlaces places)
      : path_(std::move(path)), places_(std::move(places)), others_(places_) {}

  [[nodiscard]] const std::string& path() const noexcept { return path_; }

  /// The port has been opened; its device is `device` (st_rdev). Looks around, for 20 ms at most.
  void opened(dev_t device) noexcept;
  /// Looks around anew, for `longest` at most, and goes on from there at the next call.
  void look_around(std::chrono::nanoseconds longest) noexcept;
  /// What note() has to say about an open port: another program that has it open as well, and FTDI's latency
  /// timer. Empty mostly.
  [[nodiscard]] aurora::Problem note() const noexcept;
  [[nodiscard]] std::optional<int> latency_timer() const noexcept { return latency_timer_ms_; }
  /// Of the device in /dev, as of the newest opened().
  [[nodiscard]] BoundedText<32> name() const noexcept { return device_name(places_, device_); }
  /// The adapter as of the newest opened().
  [[nodiscard]] const std::optional<UsbIdentity>& adapter() const noexcept { return adapter_; }

  /// Another program that has the open port open as well; process 0: none was seen.
  [[nodiscard]] const PortHolder& other_program() const noexcept { return others_.found(); }

  /// Why the port could not be opened, and what to do: a sentence with its path. `error`: errno;
  /// `lock_owner`: the process that has it locked, 0: not known. May be asked ten times a second: looks for
  /// the holder once a second, for `longest` at most.
  aurora::Problem explain(int error, int lock_owner, std::chrono::nanoseconds longest = kMaxLook) noexcept;

  /// How long looking for other programs may keep a thread that reads nothing yet.
  static constexpr std::chrono::milliseconds kMaxLook{20};

 private:
  aurora::Problem explain_use(int lock_owner, std::chrono::nanoseconds longest) noexcept;
  [[nodiscard]] aurora::Problem explain_absence(int error) const noexcept;

  std::string path_;
  SystemPlaces places_;
  PortHolderSearch others_;
  dev_t device_{};
  std::optional<UsbIdentity> adapter_;
  std::optional<int> latency_timer_ms_;
  MonotonicTime next_look_{};
};

/// What is wrong and what to do when a port could not be opened because of `error` (errno), in a few words
/// without the path: "is used by another program: close it". The text is constant.
[[nodiscard]] std::string_view describe_open_error(int error) noexcept;

/// What it costs when FTDI's latency timer is `milliseconds` and what to do; empty when it is as it should
/// be.
[[nodiscard]] aurora::Problem describe_latency_timer(int milliseconds, std::string_view device_name) noexcept;

}  // namespace tubed
