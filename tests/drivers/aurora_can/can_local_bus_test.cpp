#include "drivers/aurora_can/can_local_bus.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <fstream>

#include "drivers/interface/monotonic_clock.hpp"

namespace tubed {
namespace {

namespace fs = std::filesystem;
using std::chrono::milliseconds;

class LocalBusTest : public testing::Test {
 protected:
  void SetUp() override { fs::create_directory(folder_); }
  void TearDown() override { fs::remove_all(folder_); }

  static aurora::CanFrame frame_of(std::uint8_t size) {
    aurora::CanFrame frame{0x320, size, {}};
    frame.bytes[size - 1U] = size;
    return frame;
  }
  /// Each has opened its end.
  void connect() {
    ASSERT_EQ(sender.open(), ENOTCONN);
    ASSERT_EQ(receiver.open(), 0);
    ASSERT_EQ(sender.open(), 0);
  }

  fs::path folder_ = fs::temp_directory_path() / ("local-bus-" + std::to_string(::getpid()));
  std::string path = (folder_ / "can.sock").string();
  LocalBusReceiver receiver{path};
  LocalBusSender sender{path};
};

TEST_F(LocalBusTest, FramesOfBothKindsArriveAsTheyWereSent) {
  connect();
  for (const std::uint8_t size : {std::uint8_t{8}, std::uint8_t{48}}) {
    ASSERT_EQ(sender.write(frame_of(size), monotonic_now()), 0);
    const CanArrival arrival = receiver.read(monotonic_now() + milliseconds(100));
    ASSERT_EQ(arrival.kind, CanArrival::Kind::kFrame);
    EXPECT_EQ(arrival.frame.size, size);
    EXPECT_EQ(arrival.frame.bytes, frame_of(size).bytes);
  }
}

TEST_F(LocalBusTest, AFrameIsStampedWhenItCameNotWhenItWasRead) {
  connect();
  ASSERT_EQ(sender.write(frame_of(8), monotonic_now()), 0);
  const MonotonicTime sent = monotonic_now();
  sleep_until(sent + milliseconds(30), MonotonicTime::max());
  EXPECT_LT(receiver.read(monotonic_now()).received, sent + milliseconds(20));
}

TEST_F(LocalBusTest, AReceiverSaysThatThereIsNoGateway) {
  const int error = receiver.open();
  EXPECT_EQ(error, ENOENT);
  EXPECT_NE(receiver.describe(error).find("tubectl can-gateway"), std::string_view::npos);
}

TEST_F(LocalBusTest, AReceiverNoticesThatTheGatewayHasGone) {
  auto gateway = std::make_unique<LocalBusSender>(path);
  ASSERT_EQ(gateway->open(), ENOTCONN);
  ASSERT_EQ(receiver.open(), 0);
  ASSERT_EQ(gateway->open(), 0);
  gateway.reset();
  const CanArrival arrival = receiver.read(monotonic_now());
  ASSERT_EQ(arrival.kind, CanArrival::Kind::kGone);
  EXPECT_NE(receiver.describe(arrival.error).find("has gone"), std::string_view::npos);
  EXPECT_FALSE(fs::exists(path));
}

TEST_F(LocalBusTest, TheNextReceiverIsServedWhenOneHasGone) {
  connect();
  receiver.close();
  EXPECT_EQ(sender.write(frame_of(8), monotonic_now()), EPIPE);
  sender.close();
  connect();
  EXPECT_EQ(sender.write(frame_of(8), monotonic_now()), 0);
}

TEST_F(LocalBusTest, ASocketThatWasLeftBehindIsReplaced) {
  {
    LocalBusSender killed(path);
    ASSERT_EQ(killed.open(), ENOTCONN);
    fs::create_hard_link(path, path + ".kept");
  }
  fs::rename(path + ".kept", path);
  connect();
}

TEST_F(LocalBusTest, AGatewayThatRunsIsNotPushedAside) {
  ASSERT_EQ(sender.open(), ENOTCONN);
  LocalBusSender second(path);
  EXPECT_EQ(second.open(), EADDRINUSE);
  EXPECT_EQ(receiver.open(), 0);
}

TEST_F(LocalBusTest, AFileThatIsNoSocketStays) {
  std::ofstream(path) << "precious";
  const int error = sender.open();
  EXPECT_EQ(error, ENOTSOCK);
  EXPECT_NE(sender.describe(error).find("no socket"), std::string_view::npos);
  EXPECT_TRUE(fs::exists(path));
}

TEST_F(LocalBusTest, OnlyItsUserAndGroupMayListen) {
  ASSERT_EQ(sender.open(), ENOTCONN);
  struct stat found {};
  ASSERT_EQ(::stat(path.c_str(), &found), 0);
  EXPECT_EQ(found.st_mode & 0777U, 0660U);
}

TEST(CanPortByName, IsASocketWhenThereIsASlashInIt) {
  EXPECT_NE(dynamic_cast<CanInterface*>(make_can_port("can0", CanUse::kReceive).get()), nullptr);
  EXPECT_NE(dynamic_cast<LocalBusReceiver*>(make_can_port("./can0", CanUse::kReceive).get()), nullptr);
  EXPECT_NE(dynamic_cast<LocalBusSender*>(make_can_port("/tmp/can0", CanUse::kSendFd).get()), nullptr);
}

}  // namespace
}  // namespace tubed
