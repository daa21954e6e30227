#include "drivers/aurora/exchange.hpp"

#include <gtest/gtest.h>

#include <string>

#include "tests/drivers/aurora/scripted_channel.hpp"

namespace tubed::aurora {
namespace {

using std::chrono::milliseconds;

constexpr MonotonicTime kStart = ScriptedChannel::kStart;

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
