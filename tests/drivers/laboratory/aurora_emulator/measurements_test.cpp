// The frame counter: what it goes on over, what resets it, and how it goes wrong on request.
#include "drivers/laboratory/aurora_emulator/measurements.hpp"

#include <gtest/gtest.h>

#include "drivers/aurora/frame_counter.hpp"
#include "drivers/laboratory/aurora_emulator/control.hpp"
#include "tests/drivers/laboratory/aurora_emulator/emulated_room.hpp"

namespace tubed::aurora::emulator {
namespace {

/// First handle of a reply now.
HandleReading measure(Host& host) {
  EXPECT_EQ(host.ask(bx_command(kTransforms)), "binary");
  return host.tracking.handles[0];
}

void control(Host& host, std::string_view command) {
  ASSERT_EQ(apply_control(command, host.device, host.now), "");
}

/// The frame number that is right now, if the counter began with 0 at `begin`.
double true_frame(MonotonicTime begin, MonotonicTime now) { return 320 * seconds_between(begin, now); }

TEST(Measurements, TheCounterGoesOnOverTstopAndTstart) {
  Host host;
  host.start_tracking();
  const std::uint32_t before = measure(host).frame;
  const MonotonicTime then = host.now;
  host.ask(tstop_command());
  host.now += seconds(5);
  host.ask(tstart_command());
  host.now += milliseconds(30);
  const std::uint32_t after = measure(host).frame;
  EXPECT_NEAR(after - before, true_frame(then, host.now), 8.01);
}

TEST(Measurements, Tstart80CountsFromZeroAndInitFromTheBeginning) {
  DeviceSettings settings;
  settings.first_frame = 80'000;
  Host host(settings);
  host.start_tracking();
  EXPECT_GE(measure(host).frame, 80'000U);
  host.ask(tstop_command());
  host.ask("TSTART", "80");
  host.now += milliseconds(60);
  EXPECT_LT(measure(host).frame, 80U);
  host.now += seconds(60);
  EXPECT_GT(measure(host).frame, 60 * 320U);
  host.ask(tstop_command());
  const MonotonicTime begun = host.now;
  host.start_tracking();
  EXPECT_NEAR(measure(host).frame - 80'000U, true_frame(begun, host.now), 40);
}

TEST(Measurements, AStandstillKeepsNumberAndPosesOverTstopAndTstart) {
  Host host;
  host.start_tracking();
  const HandleReading before = measure(host);
  const MonotonicTime then = host.now;
  control(host, "fault standstill next 1");
  control(host, "set standstill 30");
  const auto expect_the_same = [&] {
    const HandleReading now = measure(host);
    EXPECT_EQ(now.report, Report::kValid);
    EXPECT_LE(now.frame - before.frame, 16U);  // measured between reply and command
    EXPECT_LE((now.p_em_mm - before.p_em_mm).norm(), 0.03);
    return now.frame;
  };
  host.now += seconds(2);
  const std::uint32_t frame = expect_the_same();
  host.ask(tstop_command());
  host.now += seconds(1);
  host.ask(tstart_command());
  EXPECT_EQ(expect_the_same(), frame);  // also as the first reply after TSTART
  host.now += seconds(1);
  EXPECT_EQ(expect_the_same(), frame);
  host.now = then + seconds(31);
  const HandleReading after = measure(host);
  EXPECT_NEAR(after.frame - before.frame, true_frame(then, host.now), 16);
  EXPECT_GT((after.p_em_mm - before.p_em_mm).norm(), 5.0);  // 0.01 mm a measurement while tracking
}

TEST(Measurements, AStandstillOutlastsInitButNotABreakNorClear) {
  Host host;
  host.start_tracking();
  control(host, "fault standstill next 1");
  control(host, "set standstill 1000");
  host.now += seconds(1);
  const std::uint32_t frame = measure(host).frame;
  host.ask(tstop_command());
  host.start_tracking();
  EXPECT_EQ(measure(host).frame, frame);
  control(host, "clear");
  host.now += milliseconds(50);
  EXPECT_NE(measure(host).frame, frame);

  control(host, "fault standstill next 1");
  host.now += seconds(1);
  measure(host);
  host.device.receive_break(host.now);
  host.start_tracking();
  const std::uint32_t first = measure(host).frame;
  host.now += milliseconds(50);
  EXPECT_GE(measure(host).frame, first + 16);
}

TEST(Measurements, AStandstillLastsTwelveSecondsUnlessToldOtherwise) {
  Host host;
  host.start_tracking();
  measure(host);
  control(host, "fault standstill next 1");
  const MonotonicTime then = host.now;
  host.now += milliseconds(100);
  const std::uint32_t frame = measure(host).frame;
  host.now = then + milliseconds(11'500);
  EXPECT_EQ(measure(host).frame, frame);
  host.now = then + milliseconds(12'300);
  EXPECT_GT(measure(host).frame, frame + 12 * 320 - 40);
}

TEST(Measurements, TheCounterJumpsAndGoesOnFromThere) {
  Host host;
  host.start_tracking();
  for (const int sign : {1, -1}) {
    host.now += seconds(10);
    const std::uint32_t before = measure(host).frame;
    const MonotonicTime then = host.now;
    control(host, "set jump 100");
    control(host, sign > 0 ? "fault count-on next 1" : "fault count-back next 1");
    host.now += seconds(1);
    const auto moved = static_cast<std::int32_t>(measure(host).frame - before);
    EXPECT_NEAR(moved, true_frame(then, host.now) + sign * 100.0 * kCountsPerMeasurement, 8.01);
  }
}

}  // namespace
}  // namespace tubed::aurora::emulator
