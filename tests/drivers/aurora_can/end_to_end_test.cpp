// An emulated tracker, the session that reads it, the packer, a bus, the driver: the poses at the end are
// those at the beginning.
#include <gtest/gtest.h>

#include "drivers/aurora_can/aurora_can_driver.hpp"
#include "drivers/aurora_can/aurora_can_source.hpp"
#include "drivers/aurora_can/can_packer.hpp"
#include "tests/drivers/aurora_can/paired_port.hpp"
#include "tests/drivers/aurora_serial/session_bench.hpp"

namespace tubed {
namespace {

class Gateway : public testing::TestWithParam<CanLayout> {
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
  /// Opens the port, which the first read does.
  bool connect() { return can.open().ok && can.read(frame) == ReadOutcome::kNothing; }
  void forward() { bus.send(packer.pack(can_report(serial.session, serial.frame), serial.line.time)); }

  Bus bus;
  aurora::SessionBench serial;
  AuroraCanSource can = make_source(bus);
  CanPacker packer{GetParam(), kCoils};
  EmFrame frame;
};
INSTANTIATE_TEST_SUITE_P(Layouts, Gateway, testing::Values(CanLayout::kClassic, CanLayout::kFd));

TEST_P(Gateway, PosesAreTheSameWithinTheStepsOfTheEncoding) {
  ASSERT_TRUE(serial.start());
  ASSERT_TRUE(connect());
  for (int n = 0; n < 400; ++n) {
    ASSERT_TRUE(serial.run_until(aurora::Session::Event::kMeasurement));
    forward();
    ASSERT_EQ(can.read(frame), ReadOutcome::kFrame) << n;
    EXPECT_EQ(frame.tracker_frame, serial.frame.tracker_frame);
    EXPECT_EQ(frame.origin, Origin::kSimulated);
    ASSERT_EQ(frame.coil_count, serial.frame.coil_count);
    for (std::size_t i = 0; i < kCoils; ++i) {
      const CoilSample& sent = serial.frame.coils[i];
      const CoilSample& got = frame.coils[i];
      ASSERT_EQ(got.status, sent.status);
      // Half a step: 1 um; 1 / 32767 of each part of a unit vector or quaternion.
      EXPECT_LE((got.p_em_mm - sent.p_em_mm).cwiseAbs().maxCoeff(), 0.5e-3 + 1e-9);
      EXPECT_LE((got.tangent_em - sent.tangent_em).norm(), 2.0 / 32767);
      EXPECT_NEAR(got.indicator, sent.indicator, 0.5e-4 + 1e-9);
    }
  }
}

TEST_P(Gateway, APulledPlugIsDisabledAtTheOtherEnd) {
  ASSERT_TRUE(serial.start());
  ASSERT_TRUE(connect());
  serial.device.ports().pull_out(2);
  for (int n = 0; n < 40; ++n) {
    ASSERT_TRUE(serial.run_until(aurora::Session::Event::kMeasurement));
    forward();
    ASSERT_EQ(can.read(frame), ReadOutcome::kFrame);
  }
  EXPECT_EQ(frame.coils[0].status, CoilStatus::kOk);
  EXPECT_EQ(frame.coils[2].status, CoilStatus::kDisabled);
  EXPECT_EQ(frame.coils[3].status, CoilStatus::kDisabled);
  ASSERT_TRUE(can.status());
  EXPECT_TRUE(can.status()->system_status.port_became_unoccupied());
  EXPECT_EQ(can.status()->ports_present, 0b111);
}

}  // namespace
}  // namespace tubed
