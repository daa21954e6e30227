// The driver of an Aurora at a serial port against the emulated one at a pseudo-terminal, both in real time:
// cable pulled, absent at the start, without power, a tool pulled and put in again. TUBED_REPETITIONS says
// how often each.
#include <gtest/gtest.h>
#include <stdlib.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <filesystem>
#include <mutex>
#include <thread>

#include "drivers/aurora_serial/aurora_serial_driver.hpp"
#include "drivers/interface/condition.hpp"
#include "drivers/interface/monotonic_clock.hpp"
#include "drivers/laboratory/aurora_emulator/control.hpp"
#include "drivers/laboratory/aurora_emulator/serial_front.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tubed {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;
using std::chrono::seconds;
namespace emulator = aurora::emulator;

constexpr int kCoils = 5;
/// What the driver may add to what the tracker itself needs.
constexpr double kAllowed_s = 1.0;

int repetitions() {
  const char* const wanted = std::getenv("TUBED_REPETITIONS");
  return wanted != nullptr ? std::atoi(wanted) : 1;
}

emulator::MeasuredCoils still_coils(std::uint64_t, MonotonicTime) {
  emulator::MeasuredCoils coils;
  for (std::size_t i = 0; i < kCoils; ++i) {
    coils[i].status = CoilStatus::kOk;
    coils[i].p_em_mm = {40.0 * static_cast<double>(i), 10, -120};
    coils[i].tangent_em = {0, 0, 1};
    coils[i].indicator = 0.1;
  }
  return coils;
}

/// The emulator in a thread of its own.
class RunningEmulator {
 public:
  explicit RunningEmulator(const std::filesystem::path& link)
      : device_(emulator::DeviceSettings{}, still_coils, monotonic_now()),
        front_(device_, link, ""),
        thread_([this] {
          while (!ending_) {
            {
              const std::lock_guard lock(mutex_);
              front_.step();
            }
            while (waiting_ && !ending_) {  // a mutex is not fair: it would be had again at once
              std::this_thread::sleep_for(std::chrono::microseconds(100));
            }
          }
        }) {}
  ~RunningEmulator() {
    ending_ = true;
    thread_.join();
  }
  RunningEmulator(const RunningEmulator&) = delete;
  RunningEmulator& operator=(const RunningEmulator&) = delete;

  /// Carries out a command; the instant at which it had.
  MonotonicTime tell(std::string_view command) {
    waiting_ = true;
    const std::lock_guard lock(mutex_);
    waiting_ = false;
    const MonotonicTime now = monotonic_now();
    EXPECT_EQ(emulator::apply_control(command, device_, now), "");
    return now;
  }

 private:
  std::mutex mutex_;
  std::atomic<bool> ending_ = false;
  std::atomic<bool> waiting_ = false;  ///< somebody, to tell it something
  emulator::Device device_;
  emulator::SerialFront front_;
  std::thread thread_;
};

RoomDescription room() {
  InstrumentDescription catheter;
  catheter.id = "cath-1";
  for (int sensor = 1; sensor <= kCoils; ++sensor) {
    catheter.coils.push_back({sensor, 80.0 * sensor, false, (sensor + 1) / 2, (sensor + 1) % 2});
  }
  RoomDescription room;
  room.instruments = {catheter};
  return room;
}

DriverSettings settings() {
  std::map<std::string, SettingValue> values;
  for (const KeyDescription& setting : aurora_serial_settings()) {
    values[setting.name] = setting.default_value;
  }
  return DriverSettings(std::move(values));
}

bool whole(const EmFrame& frame) {
  return std::all_of(frame.coils.begin(), frame.coils.begin() + kCoils,
                     [](const CoilSample& coil) { return coil.status == CoilStatus::kOk; });
}

class TrackerInterruptions : public testing::Test {
 protected:
  void SetUp() override { ASSERT_TRUE(source_->open().ok) << "it looks for its device by itself"; }

  /// As the pipeline reads: never closed, never opened again.
  ReadOutcome read(EmFrame& frame, MonotonicTime deadline) {
    source_->wait(deadline);
    const ReadOutcome outcome = source_->read(frame);
    EXPECT_NE(outcome, ReadOutcome::kLost);
    return outcome;
  }
  /// Seconds from `since` until the first measurement after it with all coils; 30 when there is none by then.
  double until_whole(MonotonicTime since) {
    EmFrame frame;
    while (monotonic_now() < since + seconds(30)) {
      if (read(frame, monotonic_now() + milliseconds(50)) == ReadOutcome::kFrame && whole(frame) &&
          frame.measured > since) {
        return seconds_between(since, monotonic_now());
      }
    }
    return 30;
  }
  /// Reads for so long.
  void read_for(nanoseconds time) {
    EmFrame frame;
    for (const MonotonicTime end = monotonic_now() + time; monotonic_now() < end;) {
      read(frame, std::min(end, monotonic_now() + milliseconds(50)));
    }
  }
  DeviceState state() { return dynamic_cast<HasCondition&>(*source_).condition().state; }
  void judge(const char* what, double took_s, double tracker_s) {
    std::printf("%-20s valid again after %.2f s, of which the tracker itself needs %.2f s\n", what, took_s,
                tracker_s);
    EXPECT_LE(took_s, tracker_s + kAllowed_s) << what;
  }

  const TemporaryFolder temporary_;
  const std::filesystem::path folder_ = temporary_.path();
  std::filesystem::path link_ = folder_ / "port";
  RoomDescription room_ = room();
  std::unique_ptr<EmSource> source_ = make_aurora_serial_em_source(room_, settings(), link_.string());
};

// Seconds that the emulated tracker takes for its own part, as recorded.
constexpr double kReset_s = 1.3;
constexpr double kStart_s = 0.05 + 3 * 0.14 + 1.4;  // INIT, three PINIT, TSTART
constexpr double kReplug_s = 0.34 + 0.14 + 1.4;     // TSTOP, PINIT, TSTART
// Behind a pulled cable the tracker goes on tracking.
constexpr double kGoesOn_s = 0;

TEST_F(TrackerInterruptions, AreOverSoonAfterTheTrackerIsReadyAgain) {
  read_for(milliseconds(300));  // nothing there yet
  EXPECT_EQ(state(), DeviceState::kStarting);
  RunningEmulator tracker(link_);
  judge("absent at the start", until_whole(monotonic_now()), kReset_s + kStart_s);
  for (int i = 0; i < repetitions(); ++i) {
    tracker.tell("disconnect");
    read_for(milliseconds(100 + 137 * i % 1400));
    judge("cable pulled", until_whole(tracker.tell("connect")), kGoesOn_s);

    const MonotonicTime off = tracker.tell("power-cycle 1");
    judge("power cycled", until_whole(off + seconds(1)), kReset_s + kStart_s);

    tracker.tell("unplug 2");
    read_for(milliseconds(500));
    judge("plugged in again", until_whole(tracker.tell("plug 2")), kReplug_s);
    EXPECT_EQ(state(), DeviceState::kRunning);
  }
}

}  // namespace
}  // namespace tubed
