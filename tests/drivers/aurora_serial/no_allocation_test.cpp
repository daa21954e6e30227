// Nothing allocates once a session is made: not while it starts, measures, loses plugs, or finds the tracker
// anew.
#include <gtest/gtest.h>

#include <cerrno>

#include "drivers/aurora_serial/serial_port.hpp"
#include "drivers/laboratory/aurora_emulator/pseudo_terminal.hpp"
#include "tests/drivers/aurora_serial/other_program.hpp"
#include "tests/drivers/aurora_serial/session_bench.hpp"
#include "tests/support/counted_allocations.hpp"

namespace tubed::aurora {
namespace {

/// The emulated tracker allocates; the session does not.
class UncountedLine final : public ByteChannel {
  template <typename Call>
  auto uncounted(Call call) {
    const bool before = std::exchange(counting, false);
    const auto result = call();
    counting = before;
    return result;
  }

 public:
  explicit UncountedLine(EmulatedLine& line) : line_(line) {}
  MonotonicTime now() noexcept override { return line_.time; }
  bool write(Bytes bytes) noexcept override {
    return uncounted([&] { return line_.write(bytes); });
  }
  Arrival read(std::span<std::uint8_t> room, MonotonicTime deadline) noexcept override {
    return uncounted([&] { return line_.read(room, deadline); });
  }
  bool knows_baud(int bits_per_second) noexcept override { return line_.knows_baud(bits_per_second); }
  bool set_baud(int bits_per_second) noexcept override {
    return uncounted([&] { return line_.set_baud(bits_per_second); });
  }
  bool send_break() noexcept override {
    return uncounted([&] { return line_.send_break(); });
  }

 private:
  EmulatedLine& line_;
};

TEST(NoAllocation, IsSeenByThisTest) {
  counting = true;
  const long before = allocations;
  const std::vector<int> numbers(100);
  counting = false;
  EXPECT_GT(allocations, before);
}

TEST(NoAllocation, HappensInASessionWhateverHappens) {
  counting = false;
  SessionBench bench;
  UncountedLine line(bench.line);
  bench.session.attach(line);
  allocations = 0;
  std::uint64_t measurements = 0;
  const auto run_for = [&](std::chrono::nanoseconds longest) {
    const MonotonicTime end = bench.line.time + longest;
    while (bench.line.time < end) {
      counting = true;
      const Session::Event event = bench.session.run(end, bench.frame);
      counting = false;
      measurements += event == Session::Event::kMeasurement ? 1 : 0;
    }
  };
  run_for(seconds(10));
  bench.device.ports().pull_out(2);
  run_for(seconds(2));
  bench.device.ports().plug_in(2);
  run_for(seconds(10));
  bench.device.faults().set(emulator::Fault::kTruncate, {.probability = 0.1});
  run_for(seconds(10));
  bench.device.power_cycle(bench.line.time, seconds(5));
  run_for(seconds(20));
  EXPECT_EQ(allocations, 0);
  EXPECT_GT(measurements, 1000U);
  EXPECT_EQ(bench.session.counts().tracking_starts, 3U);
}

TEST(NoAllocation, HappensWhileAPortIsLookedForOpenedAndClosed) {
  counting = false;
  emulator::PseudoTerminal terminal("");
  SerialPort port(terminal.path());
  SerialPort absent("/dev/ttyUSB-that-is-not-there");
  OtherProgram other("screen", terminal.path(), OtherProgram::Lock::kWholeFile);
  allocations = 0;
  counting = true;
  const int in_use = port.open();
  const Problem used = port.explain(in_use);
  const Problem not_there = absent.explain(absent.open());
  counting = false;
  EXPECT_EQ(in_use, EBUSY);
  EXPECT_FALSE(used.empty() || not_there.empty());
  other.end();
  counting = true;
  const int opened = port.open();
  port.look_around(milliseconds(20));
  const Problem note = port.note();
  port.close();
  counting = false;
  EXPECT_EQ(opened, 0);
  EXPECT_TRUE(note.empty());
  EXPECT_EQ(allocations, 0);
}

}  // namespace
}  // namespace tubed::aurora
