// Plays every wire log of this folder through a pseudo-terminal, byte by byte, to the reader of replies, and
// compares what that makes of it with what a person has looked at: the .expected beside it.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <stdlib.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <random>
#include <set>
#include <sstream>

#include "drivers/aurora/bx_reply.hpp"
#include "drivers/aurora/reply_reader.hpp"
#include "drivers/aurora/tx_reply.hpp"
#include "drivers/aurora/wire_log.hpp"

namespace tubed::aurora {
namespace {

namespace fs = std::filesystem;

const fs::path kFolder = TUBED_LOGS_FOLDER;

std::string contents(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::stringstream text;
  text << in.rdbuf();
  return text.str();
}

/// A raw pseudo-terminal: what is written at one end is read at the other.
class Line {
 public:
  Line() {
    master_ = ::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
    std::array<char, 128> name{};
    if (master_ < 0 || ::grantpt(master_) != 0 || ::unlockpt(master_) != 0 ||
        ::ptsname_r(master_, name.data(), name.size()) != 0) {
      throw std::runtime_error("no pseudo-terminal");
    }
    slave_ = ::open(name.data(), O_RDWR | O_NOCTTY | O_CLOEXEC);
    termios settings{};
    ::tcgetattr(slave_, &settings);
    ::cfmakeraw(&settings);
    ::tcsetattr(slave_, TCSANOW, &settings);
  }
  ~Line() {
    ::close(slave_);
    ::close(master_);
  }
  Line(const Line&) = delete;
  Line& operator=(const Line&) = delete;

  std::uint8_t carry(std::uint8_t byte) const {
    pollfd readable{slave_, POLLIN, 0};
    std::uint8_t arrived = 0;
    if (::write(master_, &byte, 1) != 1 || ::poll(&readable, 1, 1000) != 1 ||
        ::read(slave_, &arrived, 1) != 1) {
      throw std::runtime_error("the pseudo-terminal lost a byte");
    }
    return arrived;
  }

 private:
  int master_ = -1;
  int slave_ = -1;
};

std::string printed(const HandleReading& reading) {
  std::array<char, 200> text{};
  const char* const report = std::array{"valid", "missing", "disabled", "unoccupied",
                                        "implausible"}[static_cast<std::size_t>(reading.report)];
  int size = std::snprintf(text.data(), text.size(), "  %02X %s", reading.handle, report);
  std::string line(text.data(), static_cast<std::size_t>(size));
  if (reading.report == Report::kValid) {
    const Quaternion& q = reading.rotation;
    size = std::snprintf(text.data(), text.size(), " q %.4f %.4f %.4f %.4f p %.2f %.2f %.2f indicator %.4f",
                         q.q0, q.qx, q.qy, q.qz, reading.p_em_mm.x(), reading.p_em_mm.y(),
                         reading.p_em_mm.z(), reading.indicator);
    line += std::string(text.data(), static_cast<std::size_t>(size));
  }
  if (reading.report != Report::kDisabled && reading.report != Report::kUnoccupied) {
    size = std::snprintf(text.data(), text.size(), " port %08X frame %u", reading.port_status.bits,
                         reading.frame);
    line += std::string(text.data(), static_cast<std::size_t>(size));
  }
  return line + "\n";
}

std::string printed(const TrackingReply& tracking, bool binary) {
  std::array<char, 40> head{};
  std::snprintf(head.data(), head.size(), "%s system %04X\n", binary ? "BX" : "TX",
                tracking.system_status.bits);
  std::string text(head.data());
  for (const HandleReading& reading : tracking.readings()) {
    text += printed(reading);
  }
  return text;
}

/// One reply as it stands in .expected; a reply to TX is seen by that it reads as one and is longer than
/// PHSR.
std::string printed(const Reply& reply) {
  TrackingReply tracking;
  if (reply.kind == ReplyKind::kBinary) {
    return decode_bx(reply.payload, tracking) ? printed(tracking, true) : "binary, not understood\n";
  }
  const bool may_be_tx = reply.kind == ReplyKind::kText && reply.text().find('\n') != std::string_view::npos;
  if (may_be_tx && decode_tx(reply.text(), tracking)) {
    return printed(tracking, false);
  }
  std::string text(reply.text());
  std::replace(text.begin(), text.end(), '\n', '|');
  return text + "\n";
}

/// What the tracker said between two commands, and is to be read before the second is sent.
using Turn = std::vector<std::uint8_t>;

std::vector<Turn> turns_of(const fs::path& file) {
  auto parsed = parse_wire_log(contents(file));
  if (const auto* fault = std::get_if<WireLogFault>(&parsed)) {
    throw std::runtime_error(file.string() + ":" + std::to_string(fault->line) + ": " + fault->why);
  }
  std::vector<Turn> turns(1);
  for (const WireLogEntry& entry : std::get<WireLog>(parsed).entries) {
    if (entry.event == WireEvent::kReceived) {
      turns.back().insert(turns.back().end(), entry.bytes.begin(), entry.bytes.end());
    } else if (entry.event != WireEvent::kNote) {
      turns.emplace_back();
    }
  }
  return turns;
}

/// Replies found in one turn, which ends with the deadline of its command.
std::vector<std::string> replies_of(const Turn& turn, const Line& line) {
  ReplyReader reader;
  std::vector<std::string> replies;
  const auto take = [&] {
    while (const auto reply = reader.next()) {
      replies.push_back(printed(*reply));
    }
  };
  for (const std::uint8_t byte : turn) {
    const std::uint8_t arrived = line.carry(byte);
    reader.feed({&arrived, 1});
    take();
  }
  while (reader.waiting() > 0) {
    reader.give_up_waiting();
    take();
  }
  return replies;
}

class WireLogs : public testing::TestWithParam<fs::path> {};

std::vector<fs::path> logs() {
  std::vector<fs::path> found;
  for (const auto& entry : fs::directory_iterator(kFolder)) {
    if (entry.path().extension() == ".log") {
      found.push_back(entry.path());
    }
  }
  std::sort(found.begin(), found.end());
  return found;
}

INSTANTIATE_TEST_SUITE_P(Folder, WireLogs, testing::ValuesIn(logs()),
                         [](const auto& log) { return log.param.stem().string(); });

TEST_P(WireLogs, AreReadByteByByteAsExpected) {
  const Line line;
  std::string read;
  for (const Turn& turn : turns_of(GetParam())) {
    for (const std::string& reply : replies_of(turn, line)) {
      read += reply;
    }
  }
  fs::path expected = GetParam();
  expected.replace_extension(".expected");
  if (std::getenv("TUBED_WRITE_EXPECTED") != nullptr) {
    std::ofstream(expected, std::ios::binary) << read;
  }
  EXPECT_FALSE(read.empty());
  EXPECT_EQ(read, contents(expected));
}

/// One byte changed is damage that a check sum of 16 bits sees without fail, in binary replies; in text it
/// may turn a line into two, of which neither is right but with the chance of its check sum.
TEST_P(WireLogs, WithOneByteOfEveryThirdTurnChangedGiveNothingThatWasNotSent) {
  const Line line;
  std::mt19937 random(1);
  std::size_t number = 0;
  for (Turn turn : turns_of(GetParam())) {
    const std::vector<std::string> sent = replies_of(turn, line);
    const std::set<std::string> good(sent.begin(), sent.end());
    if (turn.empty() || ++number % 3 != 0) {
      continue;
    }
    turn[random() % turn.size()] ^= static_cast<std::uint8_t>(1U << random() % 8);
    for (const std::string& reply : replies_of(turn, line)) {
      EXPECT_EQ(good.count(reply), 1U) << reply;
    }
  }
}

}  // namespace
}  // namespace tubed::aurora
