#include "drivers/laboratory/aurora_emulator/control.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/drivers/laboratory/aurora_emulator/emulated_room.hpp"

namespace tubed::aurora::emulator {
namespace {

std::string command(Host& host, std::string_view text) { return apply_control(text, host.device, host.now); }

TEST(Control, StrikesTheNextRepliesForCertainAndThenNoMore) {
  Host host;
  host.start_tracking();
  EXPECT_EQ(command(host, "fault no-reply next 2"), "");
  EXPECT_EQ(host.ask(bx_command(kTransforms)), "");
  EXPECT_EQ(host.ask(bx_command(kTransforms)), "");
  EXPECT_EQ(host.ask(bx_command(kTransforms)), "binary");
  EXPECT_EQ(host.device.faults().struck(Fault::kNoReply), 2U);
}

TEST(Control, StrikesOtherThanTrackingRepliesOnlyWhenToldSo) {
  Host host;
  host.listen();
  EXPECT_EQ(command(host, "fault error 1"), "");
  EXPECT_EQ(host.ask(init_command()), "OKAY");
  EXPECT_EQ(command(host, "fault error 1 any"), "");
  EXPECT_EQ(command(host, "set error 1A"), "");
  EXPECT_EQ(host.ask(init_command()), "ERROR1A");
  EXPECT_EQ(command(host, "clear"), "");
  EXPECT_EQ(host.ask(init_command()), "OKAY");
}

TEST(Control, BreaksMovesAndRestoresACoil) {
  Host host;
  host.start_tracking();
  const auto sensor_2 = [&host] {
    host.now += milliseconds(50);
    host.ask(bx_command(kTransforms | kAlsoOutOfVolume));
    return host.tracking.handles[3];  // channel 1 of port 1
  };
  command(host, "break-coil 2");
  EXPECT_TRUE(sensor_2().port_status.coil_broken());
  EXPECT_EQ(sensor_2().report, Report::kMissing);
  command(host, "move-coil-out 2");
  EXPECT_TRUE(sensor_2().port_status.out_of_volume());
  EXPECT_EQ(sensor_2().report, Report::kValid);
  command(host, "lose-coil 2");
  EXPECT_EQ(sensor_2().report, Report::kMissing);
  command(host, "restore-coil 2");
  EXPECT_EQ(coil_sample(sensor_2()).status, CoilStatus::kOk);
}

TEST(Control, ACoilOutsideTheVolumeHasNoPoseUnlessAskedFor) {
  Host host;
  host.start_tracking();
  command(host, "move-coil-out 2");
  host.now += milliseconds(50);
  host.ask(bx_command(kTransforms));
  EXPECT_EQ(host.tracking.handles[3].report, Report::kMissing);
  EXPECT_TRUE(host.tracking.handles[3].port_status.out_of_volume());
}

TEST(Control, AStuckTrackerCountsOnWithOldPoses) {
  Host host;
  host.start_tracking();
  host.ask(bx_command(kTransforms));
  const HandleReading before = host.tracking.handles[0];
  command(host, "fault stuck 1");
  host.now += seconds(1);
  host.ask(bx_command(kTransforms));
  const HandleReading stuck = host.tracking.handles[0];
  EXPECT_GT(stuck.frame, before.frame);
  EXPECT_NEAR(stuck.p_em_mm.z(), before.p_em_mm.z(), 0.03);  // at most two measurements between, 0.01 mm each
  command(host, "fault stuck off");
  host.now += milliseconds(50);
  host.ask(bx_command(kTransforms));
  EXPECT_GT(host.tracking.handles[0].p_em_mm.z(), before.p_em_mm.z() + 0.35);
}

TEST(Control, RaisesAndEndsWhatTheSystemStatusSays) {
  Host host;
  host.start_tracking();
  const auto status = [&host] {
    host.ask(bx_command(kTransforms));
    return host.tracking.system_status;
  };
  EXPECT_EQ(status().bits, 0);
  EXPECT_EQ(command(host, "status temperature on"), "");
  EXPECT_TRUE(status().temperature_out_of_range());
  EXPECT_EQ(command(host, "status diagnostic on"), "");
  EXPECT_EQ(command(host, "status synchronisation on"), "");
  EXPECT_EQ(command(host, "status hardware-changed on"), "");
  EXPECT_EQ(status().bits, 0x0701);
  EXPECT_EQ(command(host, "status temperature off"), "");
  EXPECT_EQ(status().bits, 0x0501);
  EXPECT_EQ(command(host, "clear"), "");
  EXPECT_EQ(status().bits, 0);
}

TEST(Control, WithoutFieldGeneratorEveryCoilIsMissing) {
  Host host;
  host.start_tracking();
  const auto missing = [&host] {
    host.now += milliseconds(50);
    host.ask(bx_command(kTransforms | kAlsoOutOfVolume));
    const auto readings = host.tracking.readings();
    return std::count_if(readings.begin(), readings.end(),
                         [](const HandleReading& one) { return one.report == Report::kMissing; });
  };
  EXPECT_EQ(missing(), 0);
  EXPECT_EQ(command(host, "unplug-field-generator"), "");
  EXPECT_EQ(missing(), 5);
  EXPECT_TRUE(host.tracking.system_status.hardware_changed());
  host.ask(tstop_command());
  host.start_tracking();
  EXPECT_EQ(missing(), 5);
  EXPECT_TRUE(host.tracking.system_status.hardware_changed());  // INIT does not bring it back
  EXPECT_EQ(command(host, "plug-field-generator"), "");
  EXPECT_EQ(missing(), 0);
  EXPECT_TRUE(host.tracking.system_status.hardware_changed());
  host.ask(tstop_command());
  host.start_tracking();
  EXPECT_EQ(missing(), 0);
  EXPECT_FALSE(host.tracking.system_status.hardware_changed());
}

TEST(Control, PlugsInAStrangersTool) {
  Host host;
  host.start_tracking();
  EXPECT_EQ(command(host, "unplug 2"), "");
  EXPECT_EQ(command(host, "plug 2 BADC0FFE 610099"), "");
  EXPECT_EQ(command(host, "plug 12 77"), "");
  host.ask(tstop_command());
  EXPECT_EQ(host.ask(phsr_command(HandleQuery::kToBeInitialised)), "020F00110001");
  host.ask(pinit_command(0x0F));
  const std::string text = host.ask(phinf_command(0x0F, 0x0005));
  EXPECT_EQ(text.substr(23, 8), "BADC0FFE");
  EXPECT_EQ(text.substr(33), "610099              ");
}

TEST(Control, SaysWhatIsWrongAndChangesNothing) {
  Host host;
  host.start_tracking();
  for (const char* text : {"",
                           "dance",
                           "fault",
                           "fault crc",
                           "fault crc 1.5",
                           "fault crc nan",
                           "fault crc 0.1 some",
                           "fault crc next 0",
                           "fault crc 0.1 any more",
                           "fault cramp 0.1",
                           "set delay",
                           "set delay -1",
                           "set error XYZ",
                           "set error 100",
                           "set patience 1",
                           "lose-coil 0",
                           "lose-coil 17",
                           "lose-coil 1.5",
                           "unplug 9",
                           "plug 1",
                           "plug 1 77",
                           "plug 9",
                           "plug 9 SERIAL",
                           "plug 9 123456789",
                           "plug 9 77 123456789012345678901",
                           "plug 9 77 A B",
                           "plug 17 77",
                           "set jump 0",
                           "set standstill soon",
                           "status",
                           "status happy on",
                           "status temperature",
                           "status temperature high",
                           "status temperature on now",
                           "hang-up soon",
                           "clear now"}) {
    EXPECT_NE(command(host, text), "") << text;
  }
  EXPECT_EQ(host.ask(bx_command(kTransforms)), "binary");
  EXPECT_EQ(coil_sample(host.tracking.handles[0]).status, CoilStatus::kOk);
  EXPECT_EQ(host.tracking.handle_count, 5);
  EXPECT_EQ(host.tracking.system_status.bits, 0);
}

}  // namespace
}  // namespace tubed::aurora::emulator
