// CanInterface and AuroraCanSource at a real CAN interface of Linux. Runs in the guest of guest.py, where
// vcan0 is up and nobody else uses it.
#include <gtest/gtest.h>
#include <linux/can.h>
#include <linux/can/error.h>
#include <net/if.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "drivers/aurora_can/aurora_can_driver.hpp"
#include "drivers/aurora_can/aurora_can_source.hpp"
#include "drivers/aurora_can/can_packer.hpp"
#include "drivers/aurora_can/can_port.hpp"
#include "drivers/interface/monotonic_clock.hpp"
#include "drivers/interface/read_until.hpp"
#include "tests/drivers/aurora_serial/session_bench.hpp"

namespace tubed {
namespace {

using std::chrono::milliseconds;

void ip_link(const std::string& words) { ASSERT_EQ(std::system(("ip link " + words).c_str()), 0) << words; }

aurora::CanFrame frame_of(std::uint32_t id, std::uint8_t size, std::uint8_t last_byte = 7) {
  aurora::CanFrame frame{id, size, {}};
  frame.bytes[size - 1U] = last_byte;
  return frame;
}

MonotonicTime soon() { return monotonic_now() + milliseconds(200); }

/// vcan0 as it was found: up, with CAN FD.
class CanInterfaceInTheKernel : public testing::Test {
 protected:
  void TearDown() override {
    if (::if_nametoindex("vcan0") == 0) {
      ip_link("add vcan0 type vcan");
    }
    ip_link("set vcan0 down");
    ip_link("set vcan0 mtu 72 up");
  }
  /// Something that no gateway sends.
  static void send_raw(std::uint32_t id) {
    const int descriptor = ::socket(PF_CAN, SOCK_RAW, CAN_RAW);
    sockaddr_can address{};
    address.can_family = AF_CAN;
    address.can_ifindex = static_cast<int>(::if_nametoindex("vcan0"));
    ASSERT_EQ(::bind(descriptor, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    can_frame raw{};
    raw.can_id = id;
    raw.can_dlc = 8;
    ASSERT_EQ(::write(descriptor, &raw, sizeof raw), static_cast<ssize_t>(sizeof raw));
    ::close(descriptor);
  }

  CanInterface receiver{"vcan0", CanUse::kReceive};
  CanInterface sender{"vcan0", CanUse::kSendFd};
};

TEST_F(CanInterfaceInTheKernel, FramesOfBothKindsArriveAsTheyWereSent) {
  ASSERT_EQ(receiver.open(), 0);
  ASSERT_EQ(sender.open(), 0);
  for (const std::uint8_t size : {std::uint8_t{8}, std::uint8_t{48}}) {
    ASSERT_EQ(sender.write(frame_of(0x321, size), soon()), 0);
    const CanArrival arrival = receiver.read(soon());
    ASSERT_EQ(arrival.kind, CanArrival::Kind::kFrame);
    EXPECT_EQ(arrival.frame.id, 0x321U);
    EXPECT_EQ(arrival.frame.size, size);
    EXPECT_EQ(arrival.frame.bytes, frame_of(0x321, size).bytes);
  }
}

TEST_F(CanInterfaceInTheKernel, TheKernelSaysWhenAFrameCame) {
  ASSERT_EQ(receiver.open(), 0);
  ASSERT_EQ(sender.open(), 0);
  const MonotonicTime before = monotonic_now();
  ASSERT_EQ(sender.write(frame_of(0x300, 8), soon()), 0);
  const MonotonicTime sent = monotonic_now();
  sleep_until(sent + milliseconds(300), MonotonicTime::max());
  const CanArrival arrival = receiver.read(soon());
  ASSERT_EQ(arrival.kind, CanArrival::Kind::kFrame);
  EXPECT_GE(arrival.received, before - milliseconds(1));
  EXPECT_LE(arrival.received, sent + milliseconds(100)) << "that is when it was read";
}

TEST_F(CanInterfaceInTheKernel, WhatNoGatewaySendsIsNotReceived) {
  ASSERT_EQ(receiver.open(), 0);
  for (const std::uint32_t id :
       {0x2FFU, 0x380U, 0x7FFU, 0x300U | CAN_RTR_FLAG, 0x300U | CAN_EFF_FLAG, 0x12345U | CAN_EFF_FLAG}) {
    send_raw(id);
  }
  EXPECT_EQ(receiver.read(soon()).kind, CanArrival::Kind::kNothing);
}

TEST_F(CanInterfaceInTheKernel, OfABaseOf29BitsOnlyItsOwnBlockIsReceived) {
  const aurora::CanBase base{0x18FF'5000 | aurora::kCanExtended};
  CanInterface extended("vcan0", CanUse::kReceive, 0, base);
  ASSERT_EQ(extended.open(), 0);
  for (const std::uint32_t id : {0x300U, 0x500U, 0x18FF'4FFFU | CAN_EFF_FLAG, 0x18FF'5080U | CAN_EFF_FLAG,
                                 0x08FF'5000U | CAN_EFF_FLAG, 0x18FF'5000U | CAN_EFF_FLAG | CAN_RTR_FLAG}) {
    send_raw(id);
  }
  ASSERT_EQ(sender.open(), 0);
  ASSERT_EQ(sender.write(frame_of(base.fd_coil(15), 48), soon()), 0);
  const CanArrival arrival = extended.read(soon());
  ASSERT_EQ(arrival.kind, CanArrival::Kind::kFrame);
  EXPECT_EQ(arrival.frame.id, base.fd_coil(15));
  EXPECT_EQ(arrival.frame.size, 48);
  EXPECT_EQ(extended.read(monotonic_now()).kind, CanArrival::Kind::kNothing);
}

TEST_F(CanInterfaceInTheKernel, ErrorFramesAreReceived) {
  ASSERT_EQ(receiver.open(), 0);
  send_raw(CAN_ERR_FLAG | CAN_ERR_BUSOFF);
  const CanArrival arrival = receiver.read(soon());
  ASSERT_EQ(arrival.kind, CanArrival::Kind::kErrorFrame);
  EXPECT_TRUE(arrival.trouble.bus_off);
}

TEST_F(CanInterfaceInTheKernel, FramesThatNobodyReadInTimeAreCounted) {
  constexpr int kSent = 1000;
  CanInterface small("vcan0", CanUse::kReceive, 4096);
  ASSERT_EQ(small.open(), 0);
  ASSERT_EQ(sender.open(), 0);
  for (int i = 0; i < kSent; ++i) {
    ASSERT_EQ(sender.write(frame_of(0x300, 8), soon()), 0);
  }
  int read = 0;
  while (small.read(monotonic_now()).kind == CanArrival::Kind::kFrame) {
    ++read;
  }
  ASSERT_LT(read, kSent);
  // The count comes with the next frame that is kept.
  ASSERT_EQ(sender.write(frame_of(0x300, 8), soon()), 0);
  ASSERT_EQ(small.read(soon()).kind, CanArrival::Kind::kFrame);
  EXPECT_EQ(small.overflowed(), static_cast<std::uint64_t>(kSent - read));
}

TEST_F(CanInterfaceInTheKernel, AnInterfaceWithoutCanFdIsRefusedForFdFramesOnly) {
  ip_link("set vcan0 down");
  ip_link("set vcan0 mtu 16 up");
  EXPECT_EQ(sender.open(), EMSGSIZE);
  CanInterface classic("vcan0", CanUse::kSendClassic);
  ASSERT_EQ(classic.open(), 0);
  ASSERT_EQ(receiver.open(), 0);
  EXPECT_EQ(classic.write(frame_of(0x300, 8), soon()), 0);
  EXPECT_EQ(receiver.read(soon()).kind, CanArrival::Kind::kFrame);
}

TEST_F(CanInterfaceInTheKernel, AnInterfaceThatGoesDownIsGoneAndCanBeOpenedWhenItIsUp) {
  ASSERT_EQ(receiver.open(), 0);
  ip_link("set vcan0 down");
  const CanArrival arrival = receiver.read(soon());
  ASSERT_EQ(arrival.kind, CanArrival::Kind::kGone);
  EXPECT_EQ(arrival.error, ENETDOWN);
  receiver.close();
  EXPECT_EQ(receiver.open(), ENETDOWN);
  ip_link("set vcan0 up");
  EXPECT_EQ(receiver.open(), 0);
}

TEST_F(CanInterfaceInTheKernel, AnInterfaceThatIsTakenAwayIsGone) {
  ASSERT_EQ(receiver.open(), 0);
  ip_link("del vcan0");
  CanArrival arrival = receiver.read(soon());
  EXPECT_EQ(arrival.kind, CanArrival::Kind::kGone);
  receiver.close();
  EXPECT_EQ(receiver.open(), ENODEV);
}

TEST_F(CanInterfaceInTheKernel, WhatIsNoCanInterfaceIsRefused) {
  CanInterface loopback("lo", CanUse::kReceive);
  EXPECT_EQ(loopback.open(), ENOTSOCK);
}

/// Whether `asking` of an interface that is not there makes this kernel start its module loader.
template <typename Asking>
bool starts_module_loader(Asking asking) {
  const std::filesystem::path folder = std::filesystem::temp_directory_path();
  const std::filesystem::path mark = folder / "module_loader_was_here";
  const std::filesystem::path loader = folder / "module_loader";
  std::ofstream(loader) << "#!/bin/sh\ntouch " << mark.string() << '\n';
  std::filesystem::permissions(loader, std::filesystem::perms::all);
  std::ofstream("/proc/sys/kernel/modprobe") << loader.string();
  asking();  // the kernel waits for its loader
  std::ofstream("/proc/sys/kernel/modprobe") << "/sbin/modprobe";
  return std::filesystem::remove(mark);
}

TEST(CanInterface, ThatIsNotThereIsNoReasonToLoadAModule) {
  EXPECT_FALSE(starts_module_loader([] {
    CanInterface absent("nosuchcan", CanUse::kReceive);
    EXPECT_EQ(absent.open(), ENODEV);
  }));
  EXPECT_TRUE(starts_module_loader([] { EXPECT_EQ(::if_nametoindex("nosuchcan"), 0U); }))
      << "this kernel starts no loader at all: nothing was tested";
}

/// An emulated tracker in virtual time, the gateway's packer, vcan0, the driver.
class AuroraOverVcan : public testing::TestWithParam<CanLayout> {
 protected:
  static constexpr int kCoils = 5;
  static AuroraCanSource make_source() {
    std::map<std::string, SettingValue> values;
    for (const KeyDescription& setting : aurora_can_settings()) {
      values[setting.name] = setting.default_value;
    }
    RoomDescription room;
    room.instruments.resize(1);
    for (int sensor = 1; sensor <= kCoils; ++sensor) {
      room.instruments[0].coils.push_back({sensor, 10.0 * sensor, false});
    }
    return {room, DriverSettings(std::move(values)),
            std::make_unique<CanInterface>("vcan0", CanUse::kReceive, 256 * 1024)};
  }
};
INSTANTIATE_TEST_SUITE_P(Layouts, AuroraOverVcan, testing::Values(CanLayout::kClassic, CanLayout::kFd));

TEST_P(AuroraOverVcan, PosesAreTheSameWithinTheStepsOfTheEncoding) {
  aurora::SessionBench serial;
  CanPacker packer(GetParam(), kCoils);
  CanInterface gateway("vcan0", GetParam() == CanLayout::kFd ? CanUse::kSendFd : CanUse::kSendClassic);
  AuroraCanSource can = make_source();
  ASSERT_EQ(gateway.open(), 0);
  EmFrame frame;
  ASSERT_TRUE(can.open().ok);
  ASSERT_EQ(can.read(frame), ReadOutcome::kNothing);  // which opens the port
  ASSERT_TRUE(serial.start());
  constexpr int kMeasurements = 1000;
  std::uint64_t missing = 0;
  std::uint64_t absent = 0;
  for (int n = 0; n < kMeasurements; ++n) {
    ASSERT_TRUE(serial.run_until(aurora::Session::Event::kMeasurement));
    for (const aurora::CanFrame& sent :
         packer.pack(can_report(serial.session, serial.frame), serial.line.time)) {
      ASSERT_EQ(gateway.write(sent, soon()), 0);
    }
    if (read_until(can, frame, soon()) != ReadOutcome::kFrame) {
      ++absent;  // behind its SYNC already
      continue;
    }
    ASSERT_EQ(frame.tracker_frame, serial.frame.tracker_frame);
    for (std::size_t i = 0; i < kCoils; ++i) {
      const CoilSample& sent = serial.frame.coils[i];
      const CoilSample& got = frame.coils[i];
      if (got.status == CoilStatus::kMissing && sent.status == CoilStatus::kOk) {
        ++missing;  // the guest stood still for 20 ms between its frames
        continue;
      }
      ASSERT_EQ(got.status, sent.status);
      // Half a step: 1 um; 1 / 32767 of each part of a unit vector or quaternion.
      ASSERT_LE((got.p_em_mm - sent.p_em_mm).cwiseAbs().maxCoeff(), 0.5e-3 + 1e-9);
      ASSERT_LE((got.tangent_em - sent.tangent_em).norm(), 2.0 / 32767);
    }
  }
  EXPECT_EQ(can.counts().overflowed, 0U);
  EXPECT_EQ(can.assembler_counts().empty, absent);
  EXPECT_EQ(can.assembler_counts().lost_coils, missing + kCoils * absent);
  EXPECT_EQ(can.assembler_counts().bad_frames, 0U);
  EXPECT_LT(absent, static_cast<std::uint64_t>(kMeasurements / 20));
  EXPECT_LT(missing, static_cast<std::uint64_t>(kCoils * kMeasurements / 20));
}

}  // namespace
}  // namespace tubed
