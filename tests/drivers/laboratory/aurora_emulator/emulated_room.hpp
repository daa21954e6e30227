// A device and a plain host in virtual time: nobody sleeps.
#pragma once

#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "drivers/aurora/reply_reader.hpp"
#include "drivers/aurora/tx_reply.hpp"
#include "drivers/laboratory/aurora_emulator/device.hpp"

namespace tubed::aurora::emulator {

using std::chrono::milliseconds;
using std::chrono::seconds;

inline constexpr MonotonicTime kPowerOn = MonotonicTime(std::chrono::hours(1));

/// Coils on a line, 50 mm apart, which goes up by 0.01 mm a measurement and turns slowly: every measurement
/// is another.
inline MeasuredCoils moving_coils(std::uint64_t measurement, int count) {
  MeasuredCoils coils;
  for (int i = 0; i < count; ++i) {
    CoilSample& coil = coils[static_cast<std::size_t>(i)];
    const double angle = 0.3 * (i + 1) + 1e-3 * static_cast<double>(measurement % 1000);
    coil.status = CoilStatus::kOk;
    coil.p_em_mm = {50.0 * i, -20.0, 100 + 0.01 * static_cast<double>(measurement % 20000)};
    coil.tangent_em = {std::sin(angle), 0, std::cos(angle)};
    coil.indicator = 0.1;
  }
  return coils;
}

inline Motion moving(int count) {
  return [count](std::uint64_t measurement, MonotonicTime) { return moving_coils(measurement, count); };
}

/// Sends a command, waits for its reply.
class Host {
 public:
  explicit Host(const DeviceSettings& settings = {}, int coils = 5)
      : device(settings, moving(coils), kPowerOn), now(kPowerOn) {}

  /// What comes until nothing more will, or `timeout` is over.
  std::vector<std::uint8_t> listen(std::chrono::nanoseconds timeout = seconds(10)) {
    std::vector<std::uint8_t> bytes;
    const MonotonicTime deadline = now + timeout;
    while (device.next_event() <= deadline) {
      now = std::max(now, device.next_event());
      device.transmit(now, rate, bytes);
    }
    return bytes;
  }

  void send(Bytes bytes) { device.receive(bytes, rate, now); }

  /// The reply to `command`: its text, or "binary".
  std::string ask(const CommandLine& command) {
    send(command.bytes());
    ReplyReader reader;
    const std::vector<std::uint8_t> bytes = listen();
    reader.feed(bytes);
    const auto reply = reader.next();
    if (!reply) {
      return {};
    }
    if (reply->kind == ReplyKind::kBinary) {
      return decode_bx(reply->payload, tracking) ? "binary" : "not decoded";
    }
    if (!decode_tx(reply->text(), tracking)) {
      tracking.handle_count = 0;
    }
    return std::string(reply->text());
  }
  std::string ask(std::string_view name, std::string_view parameters) {
    return ask(with_crc(name, parameters));
  }

  /// RESET, INIT, all handles initialised and enabled, TSTART.
  void start_tracking() {
    prepare();
    ask(tstart_command());
    now += milliseconds(30);
  }
  /// The same without TSTART.
  void prepare() {
    listen();
    ask(init_command());
    for (const char* handle : {"0A", "0B", "0C"}) {
      ask("PINIT", handle);
    }
    for (const char* handle : {"0AD", "0BD", "0CD", "0DD", "0ED"}) {
      ask("PENA", handle);
    }
  }

  Device device;
  MonotonicTime now;
  int rate = 9600;
  TrackingReply tracking;
};

}  // namespace tubed::aurora::emulator
