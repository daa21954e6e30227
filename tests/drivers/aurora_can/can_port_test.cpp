#include "drivers/aurora_can/can_port.hpp"

#include <gtest/gtest.h>

#include <string>

#include "tests/drivers/aurora_can/paired_port.hpp"

namespace tubed {
namespace {

class CanPortTest : public testing::Test {
 protected:
  void SetUp() override { ASSERT_EQ(port.open(), 0); }
  Bus bus;
  PairedPort port{bus};
};

aurora::CanFrame frame_of(std::uint32_t id, std::uint8_t size) {
  aurora::CanFrame frame{id, size, {}};
  for (std::size_t i = 0; i < size; ++i) {
    frame.bytes[i] = static_cast<std::uint8_t>(i + 1);
  }
  return frame;
}

TEST_F(CanPortTest, ReadsClassicAndFdFramesAsTheyWereSent) {
  for (const std::uint8_t size : {std::uint8_t{8}, std::uint8_t{48}}) {
    bus.send(frame_of(0x320, size));
    const CanArrival arrival = port.read(at_once());
    ASSERT_EQ(arrival.kind, CanArrival::Kind::kFrame);
    EXPECT_EQ(arrival.frame.id, 0x320U);
    EXPECT_EQ(arrival.frame.size, size);
    EXPECT_EQ(arrival.frame.bytes, frame_of(0x320, size).bytes);
  }
}

TEST_F(CanPortTest, TellsIdentifiersOf29BitsFromThoseOf11) {
  for (const std::uint32_t id :
       {0x300U, 0x300U | aurora::kCanExtended, 0x18FF'5001U | aurora::kCanExtended}) {
    bus.send(frame_of(id, 8));
    const CanArrival arrival = port.read(at_once());
    ASSERT_EQ(arrival.kind, CanArrival::Kind::kFrame);
    EXPECT_EQ(arrival.frame.id, id);
  }
}

TEST_F(CanPortTest, WritesIdentifiersOf29Bits) {
  ASSERT_EQ(port.write(frame_of(0x18FF'5001U | aurora::kCanExtended, 8), at_once()), 0);
  can_frame raw{};
  ASSERT_EQ(::recv(bus.far_end, &raw, sizeof raw, MSG_DONTWAIT), static_cast<ssize_t>(CAN_MTU));
  EXPECT_EQ(raw.can_id, 0x18FF'5001U | CAN_EFF_FLAG);
}

TEST_F(CanPortTest, SaysWhenNothingCame) { EXPECT_EQ(port.read(at_once()).kind, CanArrival::Kind::kNothing); }

TEST_F(CanPortTest, StampsFramesBetweenSendingAndReading) {
  const MonotonicTime before = monotonic_now();
  bus.send(frame_of(0x300, 8));
  const CanArrival arrival = port.read(at_once());
  EXPECT_GE(arrival.received, before);
  EXPECT_LE(arrival.received, monotonic_now());
}

TEST_F(CanPortTest, DoesNotTakeWhatIsNoDataFrame) {
  can_frame remote{};
  remote.can_id = 0x300 | CAN_RTR_FLAG;
  can_frame remote_extended{};
  remote_extended.can_id = 0x300 | CAN_EFF_FLAG | CAN_RTR_FLAG;
  can_frame too_long{};
  too_long.can_id = 0x300;
  too_long.can_dlc = 9;
  for (const can_frame& raw : {remote, remote_extended, too_long}) {
    bus.send_raw(&raw, CAN_MTU);
    EXPECT_EQ(port.read(at_once()).kind, CanArrival::Kind::kUnreadable);
  }
  canfd_frame overlong{};
  overlong.len = 65;
  bus.send_raw(&overlong, CANFD_MTU);
  EXPECT_EQ(port.read(at_once()).kind, CanArrival::Kind::kUnreadable);
  const std::array<char, 200> noise{};
  for (const std::size_t size : {std::size_t{1}, std::size_t{15}, std::size_t{40}, std::size_t{200}}) {
    bus.send_raw(noise.data(), size);
    EXPECT_EQ(port.read(at_once()).kind, CanArrival::Kind::kUnreadable) << size;
  }
}

TEST_F(CanPortTest, TellsErrorFramesFromFrames) {
  bus.send_error(CAN_ERR_BUSOFF);
  const CanArrival arrival = port.read(at_once());
  ASSERT_EQ(arrival.kind, CanArrival::Kind::kErrorFrame);
  EXPECT_TRUE(arrival.trouble.bus_off);
}

TEST_F(CanPortTest, IsGoneWhenTheOtherEndIs) {
  bus.unplug();
  EXPECT_EQ(port.read(at_once()).kind, CanArrival::Kind::kGone);
}

TEST_F(CanPortTest, WritesWhatAnInterfaceTakes) {
  ASSERT_EQ(port.write(frame_of(0x321, 48), at_once()), 0);
  ASSERT_EQ(port.write(frame_of(0x300, 8), at_once()), 0);
  canfd_frame raw{};
  ASSERT_EQ(::recv(bus.far_end, &raw, sizeof raw, MSG_DONTWAIT), static_cast<ssize_t>(CANFD_MTU));
  EXPECT_EQ(raw.can_id, 0x321U);
  EXPECT_EQ(raw.len, 48);
  EXPECT_EQ(raw.flags, CANFD_BRS);
  EXPECT_EQ(raw.data[47], 48);
  ASSERT_EQ(::recv(bus.far_end, &raw, sizeof raw, MSG_DONTWAIT), static_cast<ssize_t>(CAN_MTU));
  EXPECT_EQ(raw.len, 8);
}

TEST_F(CanPortTest, GivesUpAFullQueueAtTheDeadline) {
  int error = 0;
  int sent = 0;
  while (error == 0 && sent < 1'000'000) {
    error = port.write(frame_of(0x300, 8), at_once());
    ++sent;
  }
  EXPECT_EQ(error, ENOBUFS);
}

TEST(CanInterfaceTest, SaysInWordsWhyThereIsNone) {
  CanInterface none("nosuchcan", CanUse::kReceive);
  const int error = none.open();
  EXPECT_TRUE(error == ENODEV || error == EAFNOSUPPORT || error == EPERM) << error;
  EXPECT_NE(describe_can_error(error), describe_can_error(0));
  EXPECT_FALSE(none.is_open());
}

TEST(CanInterfaceTest, HasWordsForEveryUsualReason) {
  const auto says = [](int error, const char* word) {
    return std::string(describe_can_error(error)).find(word) != std::string::npos;
  };
  EXPECT_TRUE(says(EAFNOSUPPORT, "modprobe can_raw"));
  EXPECT_TRUE(says(EAFNOSUPPORT, "/usr/share/tubed/can.conf"));
  EXPECT_TRUE(says(EPERM, "raw CAN sockets"));
  EXPECT_TRUE(says(ENODEV, "is not there"));
  EXPECT_TRUE(says(ENETDOWN, "is down"));
  EXPECT_TRUE(says(EMSGSIZE, "classic frames only"));
  EXPECT_TRUE(says(ENOBUFS, "txqueuelen"));
}

}  // namespace
}  // namespace tubed
