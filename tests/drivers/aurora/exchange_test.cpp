#include "drivers/aurora/exchange.hpp"

#include <gtest/gtest.h>

#include <deque>
#include <string>

namespace tubed::aurora {
namespace {

using std::chrono::milliseconds;

constexpr MonotonicTime kStart = from_ns(5'000'000'000);

/// Hands over what the script has, when it has it.
class ScriptedChannel final : public ByteChannel {
 public:
  std::deque<std::pair<MonotonicTime, std::string>> script;
  MonotonicTime time = kStart;

  MonotonicTime now() noexcept override { return time; }
  bool write(Bytes /*bytes*/) noexcept override { return true; }
  Arrival read(std::span<std::uint8_t> room, MonotonicTime deadline) noexcept override {
    if (script.empty() || script.front().first > deadline) {
      time = std::max(time, deadline);
      return {};
    }
    time = std::max(time, script.front().first);
    const std::string bytes = script.front().second;
    script.pop_front();
    std::copy(bytes.begin(), bytes.end(), room.begin());
    return {bytes.size(), false};
  }
  bool knows_baud(int /*bits_per_second*/) noexcept override { return true; }
  bool set_baud(int /*bits_per_second*/) noexcept override { return true; }
  bool send_break() noexcept override { return true; }
};

class ExchangeTest : public testing::Test {
 protected:
  ExchangeTest() : exchange(std::size_t{64} << 10U) {
    exchange.attach(channel);
    exchange.set_baud(115200);
  }
  ScriptedChannel channel;
  Exchange exchange;
  Reply reply;
};

TEST_F(ExchangeTest, AReplyAnswersTheQuestionThatWasWrittenBeforeItBegan) {
  channel.script = {{kStart + milliseconds(10), "OKAYA896\r"}};
  exchange.send(init_command(), milliseconds(100));
  ASSERT_EQ(exchange.listen(kStart + milliseconds(200), reply), Exchange::Event::kReply);
  EXPECT_TRUE(exchange.answers());
  EXPECT_FALSE(exchange.pending());
}

TEST_F(ExchangeTest, AReplyThatBeganBeforeTheQuestionLeavesItWaitingForItsOwn) {
  channel.script = {{kStart + milliseconds(1), "OKA"},
                    {kStart + milliseconds(12), "YA896\r"},
                    {kStart + milliseconds(15), "OKAYA896\r"}};
  ASSERT_EQ(exchange.listen(kStart + milliseconds(2), reply), Exchange::Event::kQuiet);
  exchange.send(init_command(), milliseconds(100));
  ASSERT_EQ(exchange.listen(kStart + milliseconds(200), reply), Exchange::Event::kReply);
  EXPECT_FALSE(exchange.answers());
  EXPECT_TRUE(exchange.pending());
  ASSERT_EQ(exchange.listen(kStart + milliseconds(200), reply), Exchange::Event::kReply);
  EXPECT_TRUE(exchange.answers());
  EXPECT_FALSE(exchange.pending());
}

}  // namespace
}  // namespace tubed::aurora
