// How long the doctor waits, and what it says meanwhile: conversations as recorded with real trackers (four
// plugs, 2.55 s a PINIT).
#include "clients/tubectl/check/tracker_startup.hpp"

#include <gtest/gtest.h>

#include <array>

#include "drivers/aurora/command.hpp"
#include "drivers/aurora/reply.hpp"

namespace tubed {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

class TrackerStartupRead : public testing::Test {
 protected:
  void ask(const aurora::CommandLine& command) { trace.sent(now, command.bytes()); }
  void answer(const std::string& payload) {
    std::array<std::uint8_t, 256> room{};
    const std::size_t size = aurora::encode_text_reply(payload, room);
    const auto reply = aurora::Bytes(room).first(size);
    trace.received(now, reply.first(3));  // a port hands over what has come so far
    trace.received(now, reply.subspan(3));
  }
  void list_four_plugs() {
    ask(aurora::phsr_command(aurora::HandleQuery::kToBeInitialised));
    answer("040A0010B0010C0010D001");
  }
  [[nodiscard]] std::string doing() const { return read_startup(trace).doing; }
  [[nodiscard]] auto timeout() const { return read_startup(trace).deadline(began) - began; }

  aurora::WireTrace trace{1U << 16U};
  const MonotonicTime began{seconds(1000)};
  MonotonicTime now = began + seconds(2);
};

TEST_F(TrackerStartupRead, ASilentTrackerIsGivenUpAfterTwelveSeconds) {
  ask(aurora::init_command());
  EXPECT_EQ(timeout(), seconds(12));
}

TEST_F(TrackerStartupRead, EachHandleIsGivenItsTime) {
  ask(aurora::init_command());
  answer("OKAY");
  const auto without_tools = timeout();
  list_four_plugs();
  // Four tools that read their memories need 4 * 2.55 s + 1.55 s from the first answer on.
  EXPECT_GE(timeout() - without_tools, 4 * milliseconds(2550));
  EXPECT_EQ(read_startup(trace).handles.size(), 4U);
}

TEST_F(TrackerStartupRead, HandlesThatAreListedAgainGetNoMoreTime) {
  list_four_plugs();
  const auto once = timeout();
  now += seconds(3);
  list_four_plugs();
  EXPECT_EQ(timeout(), once);
}

TEST_F(TrackerStartupRead, BlocksOfToolDefinitionsTakeTimeToo) {
  list_four_plugs();
  const auto before = timeout();
  ask(aurora::pvwr_command(0x0A, 0, {}));
  EXPECT_GT(timeout(), before);
}

TEST_F(TrackerStartupRead, ItIsSaidWhichToolIsBeingRead) {
  list_four_plugs();
  ask(aurora::pinit_command(0x0B));
  EXPECT_EQ(doing(), "PINIT of handle 0B, 2 of 4");
  answer("OKAY");
  ask(aurora::pinit_command(0x0D));
  EXPECT_EQ(doing(), "PINIT of handle 0D, 4 of 4");
}

TEST_F(TrackerStartupRead, ItIsSaidAtWhichRateTheTrackerIsLookedFor) {
  trace.baud_rate(now, 115200);
  ask(aurora::init_command());
  EXPECT_EQ(doing(), "INIT at 115200 baud");
  trace.serial_break(now);
  EXPECT_EQ(doing(), "a serial break, so that the tracker starts anew");
}

TEST_F(TrackerStartupRead, ErrorsAreCountedWithTheCommandThatTheyAnswer) {
  for (int i = 0; i < 2; ++i) {
    ask(aurora::pinit_command(0x0A));
    answer("ERROR13");
  }
  ask(aurora::bx_command(aurora::kTransforms));
  answer("ERROR01");
  EXPECT_EQ(read_startup(trace).error_text(), "ERROR01 to BX, ERROR13 to PINIT (2 times)");
}

TEST_F(TrackerStartupRead, DamagedAndBinaryAnswersAreNoErrors) {
  ask(aurora::bx_command(aurora::kTransforms));
  trace.received(now, aurora::as_bytes("ERROR01ABCD\r"));
  trace.received(now, aurora::as_bytes(std::string("\xC4\xA5\x04\x00\r", 5)));
  EXPECT_EQ(read_startup(trace).error_text(), "");
  EXPECT_FALSE(read_startup(trace).answered_at);
}

}  // namespace
}  // namespace tubed
