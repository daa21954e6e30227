// The second emulated Aurora (tests/second_aurora), which shares no line with the driver, behind the same
// session in virtual time.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "drivers/aurora/session.hpp"
#include "tests/drivers/aurora_serial/session_bench.hpp"
#include "tests/second_aurora/second_aurora.hpp"

namespace tubed::aurora {

/// One thread. Bytes come when the device's adapter hands them over.
class SecondLine final : public ByteChannel {
 public:
  explicit SecondLine(second_aurora::SecondAurora& device) : device_(device) {}

  MonotonicTime time = kPowerOn;
  int rate = 9600;

  MonotonicTime now() noexcept override { return time; }
  bool write(Bytes bytes) noexcept override {
    device_.hear(bytes, rate, to_ns(time));
    return device_.connected(to_ns(time));
  }
  Arrival read(std::span<std::uint8_t> room, MonotonicTime deadline) noexcept override {
    for (;;) {
      device_.speak(to_ns(time), rate, waiting_);
      if (!device_.connected(to_ns(time))) {
        return {0, true};
      }
      if (!waiting_.empty()) {
        const std::size_t size = std::min(room.size(), waiting_.size());
        std::copy_n(waiting_.begin(), size, room.begin());
        waiting_.erase(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(size));
        return {size, false};
      }
      if (time >= deadline) {
        return {};
      }
      const MonotonicTime next = from_ns(std::min(device_.next_event_ns(), to_ns(deadline)));
      time = std::max(time + microseconds(1), std::min(next, time + milliseconds(50)));
    }
  }
  bool knows_baud(int bits_per_second) noexcept override { return bits_per_second <= 921600; }
  bool set_baud(int bits_per_second) noexcept override {
    std::vector<std::uint8_t> old;
    device_.speak(to_ns(time), rate, old);
    waiting_.clear();
    rate = bits_per_second;
    return true;
  }
  bool send_break() noexcept override {
    device_.serial_break(to_ns(time));
    time += milliseconds(280);
    return true;
  }

 private:
  second_aurora::SecondAurora& device_;
  std::vector<std::uint8_t> waiting_;
};

/// Two coils at each of ports 1 and 2, one at port 3; port 4 is empty.
inline second_aurora::Settings second_settings() {
  second_aurora::Settings settings;
  settings.firmware.refused_rates = "";
  for (std::uint32_t port = 1; port <= 3; ++port) {
    second_aurora::Tool tool;
    tool.serial = 0x3A1B2C00 + port;
    tool.coils = port < 3 ? 2 : 1;
    settings.ports[port - 1] = tool;
  }
  return settings;
}

inline second_aurora::Pose second_pose(int port, int channel, std::int64_t time_ns) {
  const CoilSample coil = circling_coil(2 * port - 1 + channel, from_ns(time_ns));
  // The shortest rotation that takes +z to the coil's axis.
  const Eigen::Quaterniond q = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), coil.tangent_em);
  return {q.w(), q.x(), q.y(), q.z(), coil.p_em_mm.x(), coil.p_em_mm.y(), coil.p_em_mm.z(), 0.1};
}

/// Everything that the session says is compared with what the device says is true.
class SecondBench {
 public:
  using Event = Session::Event;

  explicit SecondBench(const second_aurora::Settings& settings = second_settings(),
                       CoilMap map = two_a_port(5), std::vector<ToolDefinition> tool_list = {},
                       BaudRate rate = BaudRate::k115200)
      : tools(std::move(tool_list)),
        device(settings, second_pose, to_ns(kPowerOn)),
        line(device),
        session(session_settings(settings, rate), map, tools) {
    device.on_measurement = [this](const second_aurora::Truth& truth) {
      truths_[truth.frame / 8 % kKept] = truth;
    };
  }

  void run_for(std::chrono::nanoseconds longest) {
    const MonotonicTime end = line.time + longest;
    while (line.time < end) {
      run_once(end);
    }
  }
  bool start(std::chrono::nanoseconds longest = seconds(60)) {
    session.attach(line);
    const MonotonicTime end = line.time + longest;
    const std::uint64_t before = measurements;
    while (line.time < end && measurements == before) {
      run_once(end);
    }
    return measurements > before;
  }
  [[nodiscard]] int coils_seen() const {
    return static_cast<int>(
        std::count_if(frame.coils.begin(), frame.coils.begin() + frame.coil_count,
                      [](const CoilSample& coil) { return coil.status == CoilStatus::kOk; }));
  }
  [[nodiscard]] std::int64_t now_ns() const { return to_ns(line.time); }

  std::vector<ToolDefinition> tools;
  second_aurora::SecondAurora device;
  SecondLine line;
  Session session;
  EmFrame frame;
  std::vector<std::string> problems;
  std::uint64_t measurements = 0;
  std::uint64_t wrong = 0;   ///< coils that are not as the device reported them under that number
  double oldest_ms = -1e9;   ///< by how much the most stale pose was older than its time says
  double earliest_ms = 1e9;  ///< by how much the freshest one was younger, negative
  MonotonicTime last_measurement{};
  std::chrono::nanoseconds max_gap{0};

 private:
  static SessionSettings session_settings(const second_aurora::Settings& settings, BaudRate rate) {
    SessionSettings session;
    session.baud = rate;
    session.poller.latency = std::chrono::nanoseconds(settings.timing.report_delay_ns);
    return session;
  }

  void run_once(MonotonicTime end) {
    switch (session.run(std::min(end, line.time + milliseconds(5)), frame)) {
      case Event::kProblem:
        problems.emplace_back(session.problem().text());
        break;
      case Event::kMeasurement:
        compare();
        break;
      case Event::kGone:
        line.time += milliseconds(10);
        line.rate = 9600;  // as every port that is opened
        if (device.connected(now_ns())) {
          session.attach(line);
        }
        break;
      case Event::kQuiet:
      case Event::kRefused:
        break;
    }
  }

  void compare() {
    const second_aurora::Truth& truth = truths_[frame.tracker_frame / 8 % kKept];
    max_gap = measurements++ > 0 ? std::max(max_gap, frame.received - last_measurement) : max_gap;
    last_measurement = frame.received;
    if (truth.frame != frame.tracker_frame) {
      ++wrong;
      return;
    }
    const double late_ms = 1e3 * seconds_between(from_ns(truth.time_ns), frame.measured);
    oldest_ms = std::max(oldest_ms, late_ms);
    earliest_ms = std::min(earliest_ms, late_ms);
    for (int i = 0; i < frame.coil_count; ++i) {
      const CoilSample& coil = frame.coils[static_cast<std::size_t>(i)];
      const auto plug = session.coils().plug(i);
      wrong += coil.p_em_mm.allFinite() && (!plug || !is_as_reported(coil, *plug, truth)) ? 1 : 0;
    }
  }

  static bool is_as_reported(const CoilSample& coil, CoilPlug plug, const second_aurora::Truth& truth) {
    return std::any_of(truth.coils.begin(), truth.coils.end(), [&](const second_aurora::CoilTruth& one) {
      const auto& pose = one.pose;
      return one.port == plug.port && one.channel == plug.channel &&
             (one.state == second_aurora::CoilState::Valid ||
              one.state == second_aurora::CoilState::OutOfVolume) &&
             (coil.p_em_mm - Eigen::Vector3d(pose.x_mm, pose.y_mm, pose.z_mm)).norm() < 0.02 &&
             coil.tangent_em.dot(coil_axis({pose.q0, pose.qx, pose.qy, pose.qz})) > 0.99999;
    });
  }

  static constexpr std::size_t kKept = 4096;
  std::vector<second_aurora::Truth> truths_{kKept};
};

}  // namespace tubed::aurora
