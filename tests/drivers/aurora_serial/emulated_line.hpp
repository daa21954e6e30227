// The emulated Aurora as a ByteChannel in virtual time: a session is run for hours in seconds.
#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "drivers/aurora/byte_channel.hpp"
#include "drivers/laboratory/aurora_emulator/device.hpp"

namespace tubed::aurora {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::seconds;

inline constexpr MonotonicTime kPowerOn = from_ns(1'000'000'000'000);

/// Five coils that go round on circles of 10 mm, each at its own place. Sensor i at time t.
inline CoilSample circling_coil(int sensor, MonotonicTime time) {
  const double angle = 2 * seconds_between(kPowerOn, time) + sensor;
  CoilSample coil;
  coil.status = CoilStatus::kOk;
  coil.p_em_mm = {40.0 * sensor + 10 * std::cos(angle), 10 * std::sin(angle), -200 - 3.0 * sensor};
  coil.tangent_em = Eigen::Vector3d(std::cos(angle), std::sin(angle), 1).normalized();
  coil.indicator = 0.1;
  return coil;
}

inline emulator::Motion circling(int sensors) {
  return [sensors](std::uint64_t /*measurement*/, MonotonicTime time) {
    emulator::MeasuredCoils coils;
    for (int sensor = 1; sensor <= sensors; ++sensor) {
      coils[static_cast<std::size_t>(sensor - 1)] = circling_coil(sensor, time);
    }
    return coils;
  };
}

/// One thread. Bytes come in portions of a millisecond, as from an adapter set to low latency.
class EmulatedLine final : public ByteChannel {
 public:
  explicit EmulatedLine(emulator::Device& device) : device_(device) {}

  MonotonicTime time = kPowerOn;
  int rate = 9600;
  bool carries_breaks = true;  ///< a pseudo-terminal does not
  int fastest = 921600;        ///< of the host's port
  milliseconds portion{1};
  int breaks = 0;
  /// Commands that begin with the first come to the tracker with the second instead, or not at all when that
  /// is empty.
  std::pair<std::string, std::string> replace;

  MonotonicTime now() noexcept override { return time; }
  bool write(Bytes bytes) noexcept override {
    std::string text(as_text(bytes));
    if (!replace.first.empty() && text.starts_with(replace.first)) {
      text = replace.second.empty()
                 ? ""
                 : replace.second + text.substr(replace.first.size(), text.size() - replace.first.size() - 5);
      const std::size_t colon = text.find(':');
      text = text.empty() ? "" : std::string(with_crc(text.substr(0, colon), text.substr(colon + 1)).text());
    }
    device_.receive(as_bytes(text), rate, time);
    return device_.connected(time);
  }
  /// Until read() has something, or the tracker is gone; at most until `deadline`.
  void wait(MonotonicTime deadline) noexcept {
    for (;;) {
      device_.transmit(time, rate, waiting_);
      if (!device_.connected(time) || !waiting_.empty() || time >= deadline) {
        return;
      }
      const MonotonicTime next = std::max(device_.next_event(), time + portion);
      time = std::max(time + microseconds(1), std::min({next, deadline, time + milliseconds(50)}));
    }
  }
  Arrival read(std::span<std::uint8_t> room, MonotonicTime deadline) noexcept override {
    wait(deadline);
    if (!device_.connected(time)) {
      return {0, true};
    }
    const std::size_t size = std::min(room.size(), waiting_.size());
    std::copy_n(waiting_.begin(), size, room.begin());
    waiting_.erase(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(size));
    return {size, false};
  }
  bool knows_baud(int bits_per_second) noexcept override { return bits_per_second <= fastest; }
  bool set_baud(int bits_per_second) noexcept override {
    std::vector<std::uint8_t> old;
    device_.transmit(time, rate, old);
    waiting_.clear();
    rate = bits_per_second;
    return knows_baud(bits_per_second);
  }
  bool send_break() noexcept override {
    ++breaks;
    if (carries_breaks) {
      device_.receive_break(time);
    }
    time += milliseconds(250);
    return true;
  }

 private:
  emulator::Device& device_;
  std::vector<std::uint8_t> waiting_;
};

}  // namespace tubed::aurora
