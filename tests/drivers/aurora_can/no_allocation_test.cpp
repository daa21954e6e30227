// Nothing allocates once a source is made: not while frames come, are lost, are damaged, while the bus is off
// or the interface away.
#include <gtest/gtest.h>

#include "drivers/aurora_can/aurora_can_driver.hpp"
#include "drivers/aurora_can/aurora_can_source.hpp"
#include "drivers/aurora_can/can_packer.hpp"
#include "drivers/interface/read_until.hpp"
#include "tests/drivers/aurora_can/paired_port.hpp"
#include "tests/support/counted_allocations.hpp"

namespace tubed {
namespace {

using std::chrono::milliseconds;

class CanSourceWithoutAllocation : public testing::TestWithParam<CanLayout> {
 protected:
  static constexpr int kCoils = 5;

  static AuroraCanSource make_source(Bus& bus) {
    std::map<std::string, SettingValue> values;
    for (const KeyDescription& setting : aurora_can_settings()) {
      values[setting.name] = setting.default_value;
    }
    RoomDescription room;
    room.instruments.resize(1);
    for (int sensor = 1; sensor <= kCoils; ++sensor) {
      room.instruments[0].coils.push_back({sensor, 10.0 * sensor, false});
    }
    return {room, DriverSettings(std::move(values)), std::make_unique<PairedPort>(bus)};
  }
  std::vector<aurora::CanFrame> next_measurement() {
    CanReport report;
    report.sync = {8 * ++number, can_time_us(monotonic_now() - milliseconds(5))};
    for (std::size_t coil = 0; coil < kCoils; ++coil) {
      report.coils[coil].report = aurora::Report::kValid;
      report.coils[coil].rotation = {1, 0, 0, 0};
      report.coils[coil].p_em_mm = {10.0, 0, -200};
      report.coils[coil].indicator = 0.01;
      report.coils[coil].port_status.bits = 0x3F;
    }
    const auto packed = packer.pack(report, monotonic_now());
    return {packed.begin(), packed.end()};
  }
  ReadOutcome read(std::chrono::nanoseconds longest = milliseconds(0)) {
    counting = true;
    const ReadOutcome outcome = read_until(source, frame, monotonic_now() + longest);
    condition = source.condition();
    counting = false;
    frames_read += outcome == ReadOutcome::kFrame ? 1 : 0;
    return outcome;
  }
  bool says(std::string_view word) const {
    return condition.words.text().find(word) != std::string_view::npos;
  }

  Bus bus;
  AuroraCanSource source = make_source(bus);
  CanPacker packer{GetParam(), kCoils};
  EmFrame frame;
  SourceCondition condition;  ///< behind the newest read
  std::uint32_t number = 0;
  int frames_read = 0;
};
INSTANTIATE_TEST_SUITE_P(Layouts, CanSourceWithoutAllocation,
                         testing::Values(CanLayout::kClassic, CanLayout::kFd));

TEST_P(CanSourceWithoutAllocation, AllocationsAreSeenByThisTest) {
  allocations = 0;
  counting = true;
  const std::vector<int> numbers(100);
  counting = false;
  EXPECT_GT(allocations, 0);
}

TEST_P(CanSourceWithoutAllocation, HoldsWhateverTheBusDoes) {
  counting = false;
  allocations = 0;
  counting = true;
  const bool is_open = source.open().ok;
  counting = false;
  ASSERT_TRUE(is_open);
  read();
  for (int n = 0; n < 200; ++n) {
    std::vector<aurora::CanFrame> sent = next_measurement();
    if (n % 10 == 3) {
      sent.erase(sent.begin() + 3);
    } else if (n % 10 == 6) {
      sent.back().bytes[0] ^= 1;
    }
    bus.send(sent);
    while (read() != ReadOutcome::kNothing) {
    }
  }
  EXPECT_GT(frames_read, 150);
  EXPECT_TRUE(says("loses frames"));
  bus.send(packer.pack_away(aurora::CanTrackerState::kNoTracker, monotonic_now()));
  read(milliseconds(1100));
  EXPECT_TRUE(says("hears no tracker"));
  bus.send_error(CAN_ERR_BUSOFF);
  read();
  EXPECT_TRUE(says("is bus-off"));
  bus.send_error(CAN_ERR_RESTARTED);
  read(milliseconds(1100));  // silence
  bus.refuses_with = ENODEV;
  bus.unplug();
  read();
  read(milliseconds(250));
  EXPECT_TRUE(says("is not there"));
  EXPECT_EQ(condition.state, DeviceState::kReconnecting);
  bus.refuses_with = 0;
  read(milliseconds(150));
  const int before = frames_read;
  for (int n = 0; n < 20; ++n) {
    bus.send(next_measurement());
    while (read() != ReadOutcome::kNothing) {
    }
  }
  EXPECT_GT(frames_read, before + 10);
  EXPECT_EQ(condition.state, DeviceState::kRunning);
  EXPECT_EQ(allocations, 0);
}

}  // namespace
}  // namespace tubed
