// The emulator at a pseudo-terminal, in real time: both ends in one thread.
#include "drivers/laboratory/aurora_emulator/serial_front.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <termios.h>
#include <unistd.h>

#include <filesystem>

#include "drivers/interface/monotonic_clock.hpp"
#include "tests/drivers/laboratory/aurora_emulator/emulated_room.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tubed::aurora::emulator {
namespace {

class SerialFrontTest : public testing::Test {
 protected:
  SerialFrontTest() : device_(quick(), moving(5), monotonic_now()), front_(device_, folder_ / "port", "") {}
  ~SerialFrontTest() override { close_port(); }

  static DeviceSettings quick() {
    DeviceSettings settings;
    settings.durations.reset = settings.durations.init = milliseconds(1);
    return settings;
  }

  void open_port() { port_ = ::open((folder_ / "port").c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC); }
  void close_port() {
    if (port_ >= 0) {
      ::close(port_);
    }
    port_ = -1;
  }
  void set_speed(speed_t speed) const {
    termios settings{};
    ASSERT_EQ(::tcgetattr(port_, &settings), 0);
    ::cfsetspeed(&settings, speed);
    ASSERT_EQ(::tcsetattr(port_, TCSANOW, &settings), 0);
  }
  /// What comes until `end` has come or two seconds are over.
  std::string ask(std::string_view text, char end = '\r') {
    EXPECT_EQ(::write(port_, text.data(), text.size()), static_cast<ssize_t>(text.size()));
    std::string got;
    const MonotonicTime deadline = monotonic_now() + seconds(2);
    while (monotonic_now() < deadline && (got.empty() || got.back() != end)) {
      front_.step();
      char byte = 0;
      while (::read(port_, &byte, 1) == 1) {
        got.push_back(byte);
      }
    }
    return got;
  }

  const TemporaryFolder temporary_;
  const std::filesystem::path folder_ = temporary_.path();
  Device device_;
  SerialFront front_;
  int port_ = -1;
};

TEST_F(SerialFrontTest, AnswersThroughThePortAtTheRateThatBothHave) {
  open_port();
  ASSERT_GE(port_, 0);
  EXPECT_EQ(ask(""), "RESETBE6F\r");
  EXPECT_EQ(ask("INIT:E3A5\r"), "OKAYA896\r");
  EXPECT_EQ(ask("COMM:50000004 8\r").substr(0, 7), "ERROR04");
  EXPECT_EQ(ask("COMM:500000048\r"), "OKAYA896\r");
  set_speed(B115200);
  EXPECT_EQ(ask("APIREV:443E\r").substr(0, 9), "D.001.007");
}

TEST_F(SerialFrontTest, AnswersCommandsSentWithoutWaitingInTheirOrder) {
  open_port();
  ASSERT_EQ(ask(""), "RESETBE6F\r");
  std::string replies = ask("INIT:E3A5\rAPIREV:443E\rPHSR:0120\r");
  while (replies.find("ERROR04") == std::string::npos) {
    const std::string more = ask("");
    ASSERT_NE(more, "") << replies;
    replies += more;
  }
  EXPECT_EQ(replies.substr(0, 18), "OKAYA896\rD.001.007");
}

TEST_F(SerialFrontTest, TakesTheTimeOfTheWire) {
  open_port();
  ASSERT_EQ(ask(""), "RESETBE6F\r");
  const MonotonicTime begin = monotonic_now();
  const std::string text = ask("VER:065EE\r");
  const double wire_s = static_cast<double>(10 + text.size()) * 10 / 9600;
  EXPECT_GT(text.size(), 100U);
  EXPECT_GE(seconds_between(begin, monotonic_now()), wire_s);
}

TEST_F(SerialFrontTest, APortThatHangsUpIsGoneWithItsLinkAndComesBackBehindIt) {
  open_port();
  ASSERT_EQ(ask(""), "RESETBE6F\r");
  device_.hang_up(monotonic_now(), milliseconds(200));
  front_.step();
  EXPECT_FALSE(std::filesystem::exists(folder_ / "port"));
  char byte = 0;
  EXPECT_LE(::read(port_, &byte, 1), 0);
  const MonotonicTime deadline = monotonic_now() + seconds(2);
  while (front_.path().empty() && monotonic_now() < deadline) {
    front_.step();
  }
  close_port();
  open_port();
  ASSERT_GE(port_, 0);
  EXPECT_EQ(ask("INIT:E3A5\r"), "OKAYA896\r");
}

}  // namespace
}  // namespace tubed::aurora::emulator
