// A host in virtual time for the tests of the second Aurora: says one command, waits for one reply.
#pragma once

#include <algorithm>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "tests/second_aurora/replies.hpp"
#include "tests/second_aurora/second_aurora.hpp"
#include "tests/second_aurora/wire_crc.hpp"

namespace tubed::second_aurora {

// On port p, channel c at time t s: 10 p + c, 1, -200 - 10 t mm.
inline Pose moving_away(int port, int channel, std::int64_t time_ns) {
  return {1,  0, 0, 0, 10.0 * port + channel, 1, -200 - 10e-9 * static_cast<double>(time_ns % kSecond_ns),
          0.1};
}

inline Settings with_coils(const std::vector<int>& coils_per_port) {
  Settings settings;
  settings.ports.assign(4, std::nullopt);
  for (std::size_t i = 0; i < coils_per_port.size(); ++i) {
    Tool tool;
    tool.coils = coils_per_port[i];
    tool.serial = 0x3A000001 + static_cast<std::uint32_t>(i);
    settings.ports[i] = tool;
  }
  return settings;
}

class ScriptedHost {
 public:
  explicit ScriptedHost(const Settings& settings, Motion motion = moving_away)
      : device(settings, std::move(motion), 0) {
    device.on_measurement = [this](const Truth& truth) { truths[truth.frame] = truth; };
    listen(settings.timing.boot_ns + 100 * kMillisecond_ns);
    heard.clear();
  }

  void send(const std::string& text) {
    device.hear(std::span(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()), baud, now_ns);
  }
  // Everything that comes within the duration is appended to `heard`.
  void listen(std::int64_t duration_ns) {
    now_ns += duration_ns;
    device.speak(now_ns, baud, heard);
  }
  // The next reply without CR, as it came, within 8 s; what came when none is whole.
  std::string ask_raw(const std::string& line) {
    heard.clear();
    send(line + "\r");
    for (const std::int64_t until_ns = now_ns + 8 * kSecond_ns; now_ns < until_ns;) {
      now_ns = std::max(now_ns, std::min(device.next_event_ns(), until_ns));
      device.speak(now_ns, baud, heard);
      if (!heard.empty() && heard.back() == '\r') {
        return {heard.begin(), heard.end() - 1};
      }
    }
    return {heard.begin(), heard.end()};
  }
  // The payload of the reply to a command with CRC; `line` holds name, colon and parameters.
  std::string ask(const std::string& line) {
    const std::string reply = ask_raw(line + hex(crc16(line), 4));
    if (reply.size() < 4 ||
        hex(crc16(reply.substr(0, reply.size() - 4)), 4) != reply.substr(reply.size() - 4)) {
      return "damaged: " + reply;
    }
    return reply.substr(0, reply.size() - 4);
  }
  // A binary reply, whole, within 1 s; otherwise what came.
  Bytes ask_binary(const std::string& line) {
    heard.clear();
    send(line + hex(crc16(line), 4) + "\r");
    for (const std::int64_t until_ns = now_ns + kSecond_ns; now_ns < until_ns;) {
      now_ns = std::max(now_ns, std::min(device.next_event_ns(), until_ns));
      device.speak(now_ns, baud, heard);
      if (heard.size() > 6 && heard.size() == 8u + heard[2] + 256u * heard[3]) {
        break;
      }
    }
    return heard;
  }
  // INIT, initialises and enables what is plugged in, and starts tracking.
  void start_tracking() {
    ask("INIT:");
    for (std::string list = ask("PHSR:02"); list.substr(0, 2) != "00"; list = ask("PHSR:02")) {
      if (ask("PINIT:" + list.substr(2, 2)) != "OKAY") {
        break;
      }
    }
    for (std::string list = ask("PHSR:03"); list.substr(0, 2) != "00"; list = ask("PHSR:03")) {
      ask("PENA:" + list.substr(2, 2) + "D");
    }
    ask("TSTART:");
    ask("TX:0001");
    listen(100 * kMillisecond_ns);
  }

  SecondAurora device;
  std::int64_t now_ns = 0;
  int baud = 9600;
  Bytes heard;
  std::map<std::uint32_t, Truth> truths;  // by frame
};

}  // namespace tubed::second_aurora
