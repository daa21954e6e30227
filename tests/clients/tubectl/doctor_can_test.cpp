#include "clients/tubectl/check/doctor_can.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "drivers/aurora_can/can_packer.hpp"
#include "tests/drivers/aurora_can/paired_port.hpp"

namespace tubed {
namespace {

using std::chrono::milliseconds;

constexpr int kCoils = 3;

class DoctorAtABus : public testing::Test {
 protected:
  void SetUp() override { ASSERT_EQ(port.open(), 0); }

  static CanReport report(std::uint32_t number) {
    CanReport made;
    made.sync = {8 * number, can_time_us(monotonic_now())};
    for (std::size_t coil = 0; coil < kCoils; ++coil) {
      made.coils[coil].report = aurora::Report::kValid;
      made.coils[coil].rotation = {1, 0, 0, 0};
      made.coils[coil].p_em_mm = {10, 0, -200};
      made.coils[coil].indicator = 0.01;
      made.coils[coil].port_status.bits = 0x3F;
    }
    return made;
  }
  void send(const CanReport& of, CanPacker& with) { bus.send(with.pack(of, monotonic_now())); }
  void send(const CanReport& of) { send(of, fd); }

  /// The finding of that name; what was sent before is heard.
  Finding heard(const std::string& name, const std::vector<int>& sensors = {1, 2, 3}) {
    hearing = listen_to_bus(port, kCoils, milliseconds(60));
    for (const NamedFinding& one : findings_of(hearing, sensors)) {
      if (one.name == name) {
        return one.finding;
      }
    }
    return {Verdict::kNote, "not found", ""};
  }
  static bool says(const std::string& text, const char* word) { return text.find(word) != std::string::npos; }

  Bus bus;
  PairedPort port{bus};
  CanPacker fd{CanLayout::kFd, kCoils};
  CanPacker classic{CanLayout::kClassic, kCoils};
  CanHearing hearing;
};

TEST_F(DoctorAtABus, ASilentBusNeedsAGateway) {
  const Finding finding = heard("gateway");
  EXPECT_EQ(finding.verdict, Verdict::kWrong);
  EXPECT_TRUE(says(finding.found, "nothing of a gateway at can0"));
  EXPECT_TRUE(says(finding.found, "nor of anybody else"));
  EXPECT_TRUE(says(finding.advice, "bit rates"));
}

TEST_F(DoctorAtABus, FramesOfOthersShowThatTheBusWorks) {
  bus.send(aurora::CanFrame{0x123, 8, {}});
  bus.send(aurora::CanFrame{0x7E0, 8, {}});
  const Finding finding = heard("gateway");
  EXPECT_EQ(finding.verdict, Verdict::kWrong);
  EXPECT_TRUE(says(finding.found, "2 frames of others, identifiers 123 7E0"));
  EXPECT_TRUE(says(finding.advice, "the bus works: start `tubectl can-gateway`"));
}

TEST_F(DoctorAtABus, TheIdentifiersOfOthersAreNotListedWithoutEnd) {
  for (std::uint32_t id = 0x100; id < 0x120; ++id) {
    bus.send(aurora::CanFrame{id, 8, {}});
  }
  EXPECT_TRUE(
      says(heard("gateway").found, "32 frames of others, identifiers 100 101 102 103 104 105 106 107 ..."));
}

TEST_F(DoctorAtABus, AGatewayWithAnotherBaseIsNamedWithTheSettingThatHearsIt) {
  CanPacker elsewhere(CanLayout::kFd, kCoils, aurora::CanBase{0x680});
  send(report(10), elsewhere);
  const Finding finding = heard("gateway");
  EXPECT_EQ(finding.verdict, Verdict::kWrong);
  EXPECT_TRUE(says(finding.found, "sends from identifier 680 on, listened for is 300"));
  EXPECT_TRUE(says(finding.advice, "base_id = 0x680"));
  EXPECT_TRUE(says(finding.advice, "--base-id 0x300"));
}

TEST_F(DoctorAtABus, SoIsOneWithIdentifiersOf29BitsWhoseTrackerIsAway) {
  CanPacker elsewhere(CanLayout::kFd, kCoils, aurora::CanBase{0x18FF'5000 | aurora::kCanExtended});
  bus.send(elsewhere.pack_away(aurora::CanTrackerState::kNoTracker, monotonic_now()));
  const Finding finding = heard("gateway");
  EXPECT_TRUE(says(finding.found, "sends from identifier 18FF5000 on"));
  EXPECT_TRUE(says(finding.advice, "base_id = 0x18FF5000, extended_ids = true"));
}

// A socket has one receiver, so that silence there means that another one has it; frames mean that it has
// not.
TEST_F(DoctorAtABus, SoIsOneAtTheOtherEndOfASocket) {
  CanPacker elsewhere(CanLayout::kFd, kCoils, aurora::CanBase{0x680});
  send(report(10), elsewhere);
  hearing = listen_to_bus(port, kCoils, milliseconds(60));
  hearing.name = "/run/tubed/can.sock";
  EXPECT_TRUE(says(findings_of(hearing, {1, 2, 3}).back().finding.advice, "base_id = 0x680"));
}

TEST_F(DoctorAtABus, WhatOnlyStandsWhereAStatusWouldIsNoGateway) {
  bus.send(aurora::CanFrame{0x681, 8, {0x10, 3}});  // without the check sum
  EXPECT_TRUE(says(heard("gateway").found, "frames of others, identifiers 681"));
}

TEST_F(DoctorAtABus, AGatewayWithoutItsTrackerIsToldFromNoGateway) {
  bus.send(fd.pack_away(aurora::CanTrackerState::kNoPort, monotonic_now()));
  const Finding finding = heard("gateway");
  EXPECT_EQ(finding.verdict, Verdict::kWrong);
  EXPECT_TRUE(says(finding.found, "the gateway is there, and cannot open the tracker's serial port"));
}

TEST_F(DoctorAtABus, DamagedBitsPointAtTheBitRates) {
  bus.send_error(CAN_ERR_PROT);
  bus.send_error(CAN_ERR_CRTL, CAN_ERR_CRTL_RX_WARNING);
  const Finding finding = heard("bus");
  EXPECT_EQ(finding.verdict, Verdict::kAdvice);
  EXPECT_TRUE(says(finding.found, "2 error frames"));
  EXPECT_TRUE(says(finding.found, "bit rates of both ends"));
}

TEST_F(DoctorAtABus, ABusThatIsOffIsWrong) {
  bus.send_error(CAN_ERR_BUSOFF);
  EXPECT_EQ(heard("bus").verdict, Verdict::kWrong);
}

TEST_F(DoctorAtABus, AGatewayThatWorksIsDescribed) {
  for (std::uint32_t number = 10; number < 13; ++number) {
    send(report(number));
  }
  const Finding gateway = heard("gateway");
  EXPECT_EQ(gateway.verdict, Verdict::kGood);
  EXPECT_TRUE(says(gateway.found, "CAN FD, 3 coils"));
  EXPECT_EQ(hearing.counts.measurements, 3U);
  for (const NamedFinding& one : findings_of(hearing, {1, 2, 3})) {
    if (one.name != "tracker rate") {
      EXPECT_EQ(one.finding.verdict, Verdict::kGood) << one.name << ": " << one.finding.found;
    }
  }
}

TEST_F(DoctorAtABus, TheRateIsThatOfTheTime) {
  for (std::uint32_t number = 10; number < 13; ++number) {
    send(report(number));
  }
  EXPECT_TRUE(says(heard("tracker rate").found, "50.0 measurements a second"));  // 3 in 60 ms
}

TEST_F(DoctorAtABus, MeasurementsWithoutStatusAreTold) {
  auto frames = fd.pack(report(10), monotonic_now());
  bus.send(frames.first(2));
  bus.send(frames.subspan(3));
  const Finding finding = heard("gateway");
  EXPECT_EQ(finding.verdict, Verdict::kAdvice);
  EXPECT_TRUE(says(finding.found, "no STATUS"));
}

TEST_F(DoctorAtABus, MeasurementsWithoutCoilsPointAtTheLayout) {
  bus.send(fd.pack(report(10), monotonic_now()).first(3));
  const Finding finding = heard("gateway");
  EXPECT_EQ(finding.verdict, Verdict::kWrong);
  EXPECT_TRUE(says(finding.advice, "--layout classic"));
}

TEST_F(DoctorAtABus, TwoLayoutsAreTwoGateways) {
  send(report(10), classic);
  send(report(20), fd);
  EXPECT_TRUE(says(heard("gateway").advice, "two gateways"));
}

TEST_F(DoctorAtABus, CoilsThatTheGatewayLacksAreNamed) {
  CanReport without_second = report(10);
  without_second.coils[1].report = aurora::Report::kDisabled;
  send(without_second);
  const Finding finding = heard("coils");
  EXPECT_EQ(finding.verdict, Verdict::kWrong);
  EXPECT_TRUE(says(finding.found, "sensors 2"));
}

TEST_F(DoctorAtABus, SensorsBeyondThoseOfTheGatewayAreNamed) {
  CanPacker two(CanLayout::kClassic, 2);
  send(report(10), two);
  EXPECT_TRUE(says(heard("coils").found, "the gateway has no coil for sensors 3"));
}

TEST_F(DoctorAtABus, CoilsOutOfReachAreAdvice) {
  CanReport far_away = report(10);
  far_away.coils[2].report = aurora::Report::kMissing;
  send(far_away);
  const Finding finding = heard("coils");
  EXPECT_EQ(finding.verdict, Verdict::kAdvice);
  EXPECT_TRUE(says(finding.found, "no position of sensors 3"));
}

TEST_F(DoctorAtABus, TheTrackersOwnTroubleIsHandedOn) {
  CanReport hot = report(10);
  hot.system_status.bits = 1U << 9;
  send(hot);
  EXPECT_TRUE(says(heard("tracker").found, "temperature out of range"));
}

TEST_F(DoctorAtABus, AnInterfaceThatGoesAwayIsTold) {
  bus.unplug();
  EXPECT_EQ(heard("gateway").verdict, Verdict::kWrong);
}

/// A machine on which tubed is a service whose unit says `families`.
class DoctorOfTheSandbox : public testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::create_directories(machine.root / "lib/systemd/system");
    write("lib/systemd/system/tubed.service", "# not AF_CAN\nRestrictAddressFamilies=AF_INET AF_UNIX\n");
    configuration.em_source.driver = "aurora-can";
    configuration.em_source.device = "can0";
  }
  void TearDown() override { std::filesystem::remove_all(machine.root); }

  void write(const char* file, const char* text) const {
    std::filesystem::create_directories((machine.root / file).parent_path());
    std::ofstream(machine.root / file) << text;
  }
  [[nodiscard]] Verdict verdict() const {
    const auto findings = examine_can_sandbox(machine, configuration);
    return findings.empty() ? Verdict::kNote : findings.front().finding.verdict;
  }

  Machine machine{.root = std::filesystem::path(testing::TempDir()) / ("doctor-" + std::to_string(getpid())),
                  .configuration = ""};
  Configuration configuration;
};

TEST_F(DoctorOfTheSandbox, AServiceThatMayNotUseCanIsWrongAndComesWithTheFileThatHelps) {
  const auto findings = examine_can_sandbox(machine, configuration);
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_EQ(findings.front().finding.verdict, Verdict::kWrong);
  EXPECT_NE(findings.front().finding.advice.find("/usr/share/tubed/can.conf"), std::string::npos);
}

TEST_F(DoctorOfTheSandbox, ADropInLetsCanIn) {
  write("etc/systemd/system/tubed.service.d/can.conf", "[Service]\nRestrictAddressFamilies=AF_CAN\n");
  EXPECT_EQ(verdict(), Verdict::kGood);
}

TEST_F(DoctorOfTheSandbox, OnlyATrackerBehindCanIsAskedAbout) {
  configuration.em_source.device = "/run/tubed/gateway.sock";
  EXPECT_EQ(verdict(), Verdict::kNote);
  configuration.em_source.device = "can0";
  configuration.em_source.driver = "aurora-serial";
  EXPECT_EQ(verdict(), Verdict::kNote);
}

}  // namespace
}  // namespace tubed
