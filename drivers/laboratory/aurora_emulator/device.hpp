// An Aurora without its box: bytes in, bytes out, time as a value. No port, clock, file or thread.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "drivers/laboratory/aurora_emulator/device_settings.hpp"
#include "drivers/laboratory/aurora_emulator/faults.hpp"
#include "drivers/laboratory/aurora_emulator/measurements.hpp"
#include "drivers/laboratory/aurora_emulator/tracker.hpp"
#include "drivers/laboratory/aurora_emulator/wire.hpp"

namespace tubed::aurora::emulator {

/// One thread; times must not go back. A reply leaves when command, thinking and the wire have taken their
/// time, as a real one does. Commands that come meanwhile wait, and are carried out in order.
///
///     device.receive(init_command().bytes(), 9600, now);
///     while (device.next_event() != MonotonicTime::max()) {
///       now = device.next_event();
///       device.transmit(now, 9600, reply);   // RESETBE6F, then OKAYA896
///     }
class Device {
 public:
  /// Switched on at `power_on`: RESET is sent as after a break.
  Device(const DeviceSettings& settings, Motion motion, MonotonicTime power_on);
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;
  ~Device() = default;

  /// Bytes that a host at that rate begins to send at `now`.
  void receive(Bytes bytes, int host_bits_per_second, MonotonicTime now);
  /// A serial break: everything is forgotten, RESET comes after a while, 9600 baud.
  void receive_break(MonotonicTime now);
  /// Appends to `out` what has come out of the line until `now`, as a host at that rate hears it.
  void transmit(MonotonicTime now, int host_bits_per_second, std::vector<std::uint8_t>& out);
  /// When transmit() has something to do next; MonotonicTime::max() when only the host can cause something.
  [[nodiscard]] MonotonicTime next_event() const;

  /// Whether the port exists: not while hung up. What is said meanwhile, either way, is lost.
  [[nodiscard]] bool connected(MonotonicTime now) const { return now >= hung_up_until_; }
  void hang_up(MonotonicTime now, std::chrono::nanoseconds duration);
  void connect() { hung_up_until_ = {}; }
  /// Without power from `now` on for so long; then RESET, as at the beginning.
  void power_cycle(MonotonicTime now, std::chrono::nanoseconds off);

  Faults& faults() noexcept { return faults_; }
  PortHandles& ports() noexcept { return tracker_.ports(); }
  Measurements& measurements() noexcept { return measurements_; }

  [[nodiscard]] bool tracking() const { return measurements_.tracking(); }
  [[nodiscard]] const LinkParameters& link() const noexcept { return wire_.link; }
  /// When the word RESET has been or will be sent: from then on commands are heard.
  [[nodiscard]] MonotonicTime ready() const noexcept { return deaf_until_; }

  struct Counts {
    std::uint64_t commands = 0;
    std::uint64_t replies = 0;           ///< of these, those that a reply was meant for
    std::uint64_t tracking_replies = 0;  ///< of these, with measurements
  };
  [[nodiscard]] const Counts& counts() const noexcept { return counts_; }

 private:
  struct Line {
    MonotonicTime complete;
    std::string text;
  };
  void restart(MonotonicTime now);
  void work_until(MonotonicTime now);
  /// COMM's rate holds from the end of its reply on, both ways.
  void switch_link(MonotonicTime now);
  void execute(const Line& line, MonotonicTime now);
  /// What a fault does to the tracker itself; true when there is no reply then.
  bool strike_tracker(Fault fault, MonotonicTime now);
  void send(const Answer& answer, MonotonicTime start);

  DeviceSettings settings_;
  Faults faults_;
  Measurements measurements_;
  Tracker tracker_;
  Wire wire_;
  std::string typed_;                        ///< of the command that is being received
  MonotonicTime heard_until_{};              ///< when the host's last byte is over
  std::deque<Line> waiting_;                 ///< commands not yet carried out
  MonotonicTime busy_until_{};               ///< the last reply is over
  std::optional<LinkParameters> next_link_;  ///< from then on
  MonotonicTime deaf_until_{};
  MonotonicTime hung_up_until_{};
  std::vector<std::uint8_t> last_tracking_;  ///< reply
  Counts counts_;
};

}  // namespace tubed::aurora::emulator
