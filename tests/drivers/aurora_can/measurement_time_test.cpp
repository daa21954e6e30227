// When a measurement was made, as the driver at the end of the bus says, against the emulated tracker's
// truth; beside it when it arrived.
#include <gtest/gtest.h>

#include <cstdio>
#include <map>
#include <random>

#include "drivers/aurora_can/can_packer.hpp"
#include "drivers/aurora_can/gateway_clock.hpp"
#include "tests/drivers/aurora_serial/session_bench.hpp"

namespace tubed {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::seconds;

/// A gateway whose crystal runs at another rate than the host's, and started at another time.
struct GatewayCrystal {
  double rate = 1;
  std::chrono::nanoseconds offset{};

  [[nodiscard]] MonotonicTime of(MonotonicTime host) const {
    return from_ns(static_cast<std::int64_t>(
               static_cast<double>(to_ns(host - aurora::kPowerOn.time_since_epoch())) * rate)) +
           aurora::kPowerOn.time_since_epoch() + offset;
  }
};

/// Frames wait for others with higher priority, and a task for the processor: 0.2 ms at least, 1 ms on
/// average beyond, now and then 10 ms.
class BusDelay {
 public:
  std::chrono::nanoseconds next() {
    const bool held_up = std::uniform_int_distribution<int>(0, 49)(random_) == 0;
    const double us = 200 + std::exponential_distribution<double>(1e-3)(random_) + (held_up ? 10'000 : 0);
    return microseconds(static_cast<std::int64_t>(us));
  }

 private:
  std::mt19937 random_{7};
};

class TimeOfMeasurement : public testing::TestWithParam<double> {};

TEST_P(TimeOfMeasurement, IsWithinAMillisecondOfTheTruth) {
  const GatewayCrystal crystal{1 + GetParam() * 1e-6, seconds(4000)};
  std::map<std::uint32_t, MonotonicTime> truth;
  aurora::SessionBench serial;
  const auto watch = serial.device.measurements().on_measurement;
  serial.device.measurements().on_measurement = [&](const aurora::emulator::Measurement& measurement) {
    truth[measurement.frame] = measurement.time;
    watch(measurement);
  };
  ASSERT_TRUE(serial.start());
  serial.run_for(seconds(5));  // the serial driver's own fit

  GatewayClock clock;
  BusDelay delay;
  std::vector<double> of_measurement_ms;
  std::vector<double> of_arrival_ms;
  for (int n = 0; n < 40 * 300; ++n) {
    ASSERT_TRUE(serial.run_until(aurora::Session::Event::kMeasurement));
    const MonotonicTime sent = serial.line.time;
    const MonotonicTime received = sent + delay.next();
    clock.observe(can_time_us(crystal.of(sent)), received);
    const MonotonicTime measured = clock.at(can_time_us(crystal.of(serial.frame.measured)), received);
    const MonotonicTime true_time = truth.at(serial.frame.tracker_frame);
    of_measurement_ms.push_back(1e3 * seconds_between(true_time, measured));
    of_arrival_ms.push_back(1e3 * seconds_between(true_time, received));
  }
  const double p95_ms = aurora::percentile_of_absolute(of_measurement_ms, 0.95);
  const double arrival_p95_ms = aurora::percentile_of_absolute(of_arrival_ms, 0.95);
  std::printf("crystal %+.0f ppm: time of measurement p95 %.2f ms, of arrival p50 %.2f ms, p95 %.2f ms\n",
              GetParam(), p95_ms, aurora::percentile_of_absolute(of_arrival_ms, 0.5), arrival_p95_ms);
  EXPECT_LE(p95_ms, 1.0);
  EXPECT_GT(arrival_p95_ms, 10.0);
  EXPECT_EQ(clock.disbelieved(), 0U);
}

INSTANTIATE_TEST_SUITE_P(Crystals, TimeOfMeasurement, testing::Values(-100.0, 0.0, 100.0));

}  // namespace
}  // namespace tubed
