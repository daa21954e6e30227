// A tracker, a line to it and a session, in virtual time.
#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "drivers/aurora/session.hpp"
#include "tests/drivers/aurora_serial/emulated_line.hpp"

namespace tubed::aurora {

/// Sensors 1 to `sensors`, two a port.
inline CoilMap two_a_port(int sensors) {
  CoilMap map;
  for (int sensor = 1; sensor <= sensors; ++sensor) {
    map.place(sensor, {(sensor + 1) / 2, (sensor + 1) % 2});
  }
  return map;
}

inline double percentile_of_absolute(std::vector<double> values, double p) {
  std::transform(values.begin(), values.end(), values.begin(), [](double v) { return std::abs(v); });
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(p * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// Five coils unless said otherwise. Everything that the session says is compared with what is true.
class SessionBench {
 public:
  using Event = Session::Event;

  explicit SessionBench(emulator::DeviceSettings device_settings = {}, SessionSettings settings = {},
                        CoilMap map = two_a_port(5), std::vector<ToolDefinition> tool_list = {})
      : tools(std::move(tool_list)),
        device(device_settings, circling(8), kPowerOn),
        line(device),
        session(settings, map, tools) {
    device.measurements().on_measurement = [this](const emulator::Measurement& measurement) {
      newest_frame_ = measurement.frame;
      newest_time_ = measurement.time;
    };
  }

  /// Runs until `event`, at most for so long; false when it did not come.
  bool run_until(Event event, std::chrono::nanoseconds longest = seconds(60)) {
    const MonotonicTime end = line.time + longest;
    while (line.time < end) {
      if (run_once(end) == event) {
        return true;
      }
    }
    return false;
  }
  void run_for(std::chrono::nanoseconds longest) {
    const MonotonicTime end = line.time + longest;
    while (line.time < end && run_once(end) != Event::kGone) {
    }
  }
  bool start() {
    session.attach(line);
    return run_until(Event::kMeasurement);
  }
  [[nodiscard]] CoilStatus status(int sensor) const {
    return frame.coils[static_cast<std::size_t>(sensor - 1)].status;
  }
  [[nodiscard]] int coils_seen() const {
    return static_cast<int>(
        std::count_if(frame.coils.begin(), frame.coils.begin() + frame.coil_count,
                      [](const CoilSample& coil) { return coil.status == CoilStatus::kOk; }));
  }

  std::vector<ToolDefinition> tools;
  emulator::Device device;
  EmulatedLine line;
  Session session;
  EmFrame frame;
  std::vector<std::string> problems;
  std::uint64_t measurements = 0;
  std::uint64_t wrong = 0;               ///< coils that were not there when the frame was measured
  std::uint64_t longest_gap_frames = 0;  ///< measurements not seen, in a row
  std::vector<double> time_errors_ms;    ///< measured - truth
  std::vector<double> ages_ms;           ///< received - truth

 private:
  Event run_once(MonotonicTime end) {
    const Event event = session.run(std::min(end, line.time + milliseconds(50)), frame);
    if (event == Event::kProblem) {
      problems.emplace_back(session.problem().text());
    }
    if (event == Event::kMeasurement) {
      compare();
    }
    return event;
  }

  void compare() {
    const auto behind = static_cast<std::int32_t>(newest_frame_ - frame.tracker_frame);
    const MonotonicTime truth = newest_time_ - std::chrono::nanoseconds(behind * 3'125'000LL);
    if (measurements++ > 0) {
      const std::uint32_t step = (frame.tracker_frame - last_frame_) / 8;
      longest_gap_frames = std::max<std::uint64_t>(longest_gap_frames, step - 1);
    }
    last_frame_ = frame.tracker_frame;
    time_errors_ms.push_back(1e3 * seconds_between(truth, frame.measured));
    ages_ms.push_back(1e3 * seconds_between(truth, frame.received));
    for (int i = 0; i < frame.coil_count; ++i) {
      const CoilSample& coil = frame.coils[static_cast<std::size_t>(i)];
      if (coil.p_em_mm.allFinite()) {
        const CoilSample true_coil = circling_coil(i + 1, truth);
        const bool right = (coil.p_em_mm - true_coil.p_em_mm).norm() < 0.02 &&
                           coil.tangent_em.dot(true_coil.tangent_em) > 0.99999;
        wrong += right ? 0 : 1;
      }
    }
  }

  std::uint32_t newest_frame_ = 0;
  MonotonicTime newest_time_{};
  std::uint32_t last_frame_ = 0;
};

}  // namespace tubed::aurora
