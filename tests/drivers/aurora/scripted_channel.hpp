// A serial line whose far end is a list of what comes and when.
#pragma once

#include <algorithm>
#include <deque>
#include <string>
#include <utility>
#include <vector>

#include "drivers/aurora/byte_channel.hpp"

namespace tubed::aurora {

/// Hands over what the script has, when it has it.
class ScriptedChannel final : public ByteChannel {
 public:
  static constexpr MonotonicTime kStart = from_ns(5'000'000'000);

  std::deque<std::pair<MonotonicTime, std::string>> script;
  MonotonicTime time = kStart;
  std::vector<std::string> written;  ///< each command
  std::vector<int> rates;            ///< that were set, bits per second

  MonotonicTime now() noexcept override { return time; }
  bool write(Bytes bytes) noexcept override {
    written.emplace_back(as_text(bytes));
    return true;
  }
  Arrival read(std::span<std::uint8_t> room, MonotonicTime deadline) noexcept override {
    if (script.empty() || script.front().first > deadline) {
      time = std::max(time, deadline);
      return {};
    }
    time = std::max(time, script.front().first);
    const std::string bytes = script.front().second;
    script.pop_front();
    std::copy(bytes.begin(), bytes.end(), room.begin());
    return {bytes.size(), false};
  }
  bool knows_baud(int /*bits_per_second*/) noexcept override { return true; }
  bool set_baud(int bits_per_second) noexcept override {
    rates.push_back(bits_per_second);
    return true;
  }
  bool send_break() noexcept override { return true; }
};

}  // namespace tubed::aurora
