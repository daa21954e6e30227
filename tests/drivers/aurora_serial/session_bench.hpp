// A tracker, a line to it and a session, in virtual time.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
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

/// By how much the most stale of the poses was older than its time said.
inline double max_of(const std::vector<double>& values) {
  return values.empty() ? 0 : *std::max_element(values.begin(), values.end());
}

/// How a session is run.
enum class Pace {
  kInSlices,  ///< of 5 ms, and it waits itself
  kWhenDue    ///< it never waits: when bytes have come, or it says that something is due
};

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
      reported_[measurement.frame / 8 % kReported] = measurement;
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
  /// A line that has gone is attached again when it is back.
  void run_for(std::chrono::nanoseconds longest) {
    const MonotonicTime end = line.time + longest;
    while (line.time < end) {
      if (run_once(end) == Event::kGone) {
        line.time += milliseconds(10);
        line.rate = 9600;  // as every port that is opened
        if (device.connected(line.time)) {
          session.attach(line);
        }
      }
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
  std::uint64_t wrong = 0;  ///< coils that were not there when the frame was measured, or are not as reported
  std::uint64_t spoilt = 0;            ///< coils that were not OK
  bool poses_are_true = true;          ///< false: the tracker itself is stuck
  std::uint64_t max_gap_frames = 0;    ///< measurements not seen, in a row
  std::vector<double> time_errors_ms;  ///< measured - truth
  std::vector<double> ages_ms;         ///< received - truth
  /// Of `fault`: tracking replies from the one struck to the next one that was understood.
  std::uint64_t max_replies_to_resynchronise = 0;
  std::optional<emulator::Fault> watched;
  Pace pace = Pace::kInSlices;
  std::uint64_t runs = 0;

 private:
  Event run_session(MonotonicTime end) {
    ++runs;
    if (pace == Pace::kInSlices) {
      return session.run(std::min(end, line.time + milliseconds(5)), frame);
    }
    const Event event = session.run(line.time, frame);
    line.time += microseconds(10);  // a session that says "now" for ever does not stop the time
    if (event == Event::kQuiet) {
      line.wait(std::min(end, session.due()));
    }
    return event;
  }

  Event run_once(MonotonicTime end) {
    const Event event = run_session(end);
    watch();
    if (event == Event::kProblem) {
      problems.emplace_back(session.problem().text());
    }
    if (event == Event::kMeasurement) {
      compare();
    }
    return event;
  }

  void watch() {
    if (!watched) {
      return;
    }
    const std::uint64_t struck = device.faults().struck(*watched);
    const std::uint64_t replies = device.counts().tracking_replies;
    const std::uint64_t understood =
        session.poller().counts().measurements + session.poller().counts().duplicates;
    if (struck != struck_) {
      struck_ = struck;
      replies_when_struck_ = replies;
      resynchronising_ = true;
    } else if (resynchronising_ && understood != understood_) {
      max_replies_to_resynchronise = std::max(max_replies_to_resynchronise, replies - replies_when_struck_);
      resynchronising_ = false;
    }
    understood_ = understood;
  }

  void compare() {
    const emulator::Measurement& reported = reported_[frame.tracker_frame / 8 % kReported];
    wrong += reported.frame == frame.tracker_frame ? 0 : 1;
    const MonotonicTime truth = reported.time;
    if (measurements++ > 0) {
      const std::uint32_t step = (frame.tracker_frame - last_frame_) / 8;
      max_gap_frames = std::max<std::uint64_t>(max_gap_frames, step - 1);
    }
    last_frame_ = frame.tracker_frame;
    time_errors_ms.push_back(1e3 * seconds_between(truth, frame.measured));
    ages_ms.push_back(1e3 * seconds_between(truth, frame.received));
    for (int i = 0; i < frame.coil_count; ++i) {
      const CoilSample& coil = frame.coils[static_cast<std::size_t>(i)];
      spoilt += coil.status == CoilStatus::kOk ? 0 : 1;
      if (coil.p_em_mm.allFinite()) {
        const HandleReading& reading = reported.coils[static_cast<std::size_t>(i)];
        const CoilSample true_coil = circling_coil(i + 1, truth);
        const bool as_reported = reported.frame == frame.tracker_frame && reading.report == Report::kValid &&
                                 (coil.p_em_mm - reading.p_em_mm).norm() < 0.02;
        const bool is_true = (coil.p_em_mm - true_coil.p_em_mm).norm() < 0.02 &&
                             coil.tangent_em.dot(true_coil.tangent_em) > 0.99999;
        wrong += as_reported && (is_true || !poses_are_true) ? 0 : 1;
      }
    }
  }

  static constexpr std::size_t kReported = 256;  ///< of the newest measurements
  std::array<emulator::Measurement, kReported> reported_{};
  std::uint64_t struck_ = 0;
  std::uint64_t understood_ = 0;
  std::uint64_t replies_when_struck_ = 0;
  bool resynchronising_ = false;
  std::uint32_t last_frame_ = 0;
};

}  // namespace tubed::aurora
