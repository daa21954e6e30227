// A session with the emulated Aurora, in virtual time.
#include "drivers/aurora/session.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "tests/drivers/aurora_serial/emulated_line.hpp"

namespace tubed::aurora {
namespace {

using Event = Session::Event;

/// Sensors 1 to `sensors`, two a port.
CoilMap two_a_port(int sensors) {
  CoilMap map;
  for (int sensor = 1; sensor <= sensors; ++sensor) {
    map.place(sensor, {(sensor + 1) / 2, (sensor + 1) % 2});
  }
  return map;
}

/// A tracker, a line to it and a session, five coils unless said otherwise.
class Bench {
 public:
  explicit Bench(emulator::DeviceSettings device_settings = {}, SessionSettings settings = {},
                 CoilMap map = two_a_port(5), std::vector<ToolDefinition> tool_list = {})
      : tools(std::move(tool_list)),
        device(device_settings, circling(8), kPowerOn),
        line(device),
        session(settings, map, tools) {}

  /// Runs until `event` or for so long; false when it did not come.
  bool run_until(Event event, std::chrono::nanoseconds longest = seconds(60)) {
    const MonotonicTime end = line.time + longest;
    while (line.time < end) {
      const Event seen = session.run(std::min(end, line.time + milliseconds(50)), frame);
      note(seen);
      if (seen == event) {
        return true;
      }
    }
    return false;
  }
  /// Runs for so long and counts.
  void run_for(std::chrono::nanoseconds longest) {
    const MonotonicTime end = line.time + longest;
    while (line.time < end) {
      note(session.run(std::min(end, line.time + milliseconds(50)), frame));
    }
  }
  bool start() {
    session.attach(line);
    return run_until(Event::kMeasurement);
  }

  std::vector<ToolDefinition> tools;
  emulator::Device device;
  EmulatedLine line;
  Session session;
  EmFrame frame;
  std::vector<std::string> problems;
  std::uint64_t measurements = 0;
  std::uint64_t wrong = 0;  ///< coils that are not where they were when the frame was measured
  double worst_mm = 0;
  std::vector<double> time_errors_ms;
  std::vector<double> arrival_ms;
  std::uint32_t last_frame = 0;

 private:
  // The emulator's frame number says when it measured: 8 counts are 25 ms, from power-on or TSTART:80.
  void note(Event event) {
    if (event == Event::kProblem) {
      problems.emplace_back(session.problem().text());
    }
    if (event != Event::kMeasurement) {
      return;
    }
    ++measurements;
    const MonotonicTime truth = epoch + std::chrono::nanoseconds(frame.tracker_frame * 3'125'000LL);
    time_errors_ms.push_back(1e3 * seconds_between(truth, frame.measured));
    arrival_ms.push_back(1e3 * seconds_between(truth, frame.received));
    for (int i = 0; i < frame.coil_count; ++i) {
      const CoilSample& coil = frame.coils[static_cast<std::size_t>(i)];
      if (coil.status == CoilStatus::kOk) {
        const double error_mm = (coil.p_em_mm - circling_coil(i + 1, truth).p_em_mm).norm();
        worst_mm = std::max(worst_mm, error_mm);
        wrong += error_mm > 0.02 ? 1 : 0;
      }
    }
  }

 public:
  MonotonicTime epoch = kPowerOn;  ///< frame 0
};

double percentile_of_absolute(std::vector<double> values, double p) {
  std::transform(values.begin(), values.end(), values.begin(), [](double v) { return std::abs(v); });
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(p * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

TEST(Session, FindsAFreshTrackerAndMeasuresAllCoils) {
  Bench bench;
  ASSERT_TRUE(bench.start());
  EXPECT_EQ(bench.frame.coil_count, 5);
  for (int i = 0; i < 5; ++i) {
    EXPECT_EQ(bench.frame.coils[static_cast<std::size_t>(i)].status, CoilStatus::kOk) << i;
  }
  EXPECT_EQ(bench.wrong, 0U);
  EXPECT_EQ(bench.line.rate, 115200);
  EXPECT_TRUE(bench.problems.empty()) << bench.problems[0];
  EXPECT_EQ(bench.session.firmware(), "AURORA Rev 008");
}

TEST(Session, KeepsFortyHertzWithFiveCoilsAt115200) {
  Bench bench;
  ASSERT_TRUE(bench.start());
  const auto before = bench.measurements;
  bench.run_for(seconds(60));
  EXPECT_NEAR(static_cast<double>(bench.measurements - before), 2400, 2);
  EXPECT_EQ(bench.session.poller().counts().missed, 0U);
  EXPECT_EQ(bench.wrong, 0U);
  std::printf(
      "duplicates %lu of %lu polls; time error p95 %.3f ms, arrival p50 %.2f p95 %.2f ms, uncertainty %.3f "
      "ms period %.6f\n",
      bench.session.poller().counts().duplicates, bench.session.poller().counts().polls,
      percentile_of_absolute(bench.time_errors_ms, 0.95), percentile_of_absolute(bench.arrival_ms, 0.5),
      percentile_of_absolute(bench.arrival_ms, 0.95),
      static_cast<double>(bench.session.poller().clock().uncertainty().count()) / 1e6,
      bench.session.poller().clock().period_ns() / 1e6);
  EXPECT_LT(percentile_of_absolute(bench.time_errors_ms, 0.95), 1.0);
}

}  // namespace
}  // namespace tubed::aurora
