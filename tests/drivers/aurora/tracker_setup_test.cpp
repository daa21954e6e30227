#include "drivers/aurora/tracker_setup.hpp"

#include <gtest/gtest.h>

#include "tests/drivers/aurora/scripted_channel.hpp"

namespace tubed::aurora {
namespace {

using Result = TrackerSetup::Result;
using Step = TrackerSetup::Step;

/// A setup whose replies are handed to it; what it sends is in the channel.
class TrackerSetupTest : public testing::Test {
 protected:
  TrackerSetupTest() : exchange(std::size_t{64} << 10U), setup(BaudRate::k115200, CoilMap{}, {}) {
    exchange.attach(channel);
  }
  Result answer(const std::string& payload) {
    Reply reply;
    reply.payload = as_bytes(payload);
    if (payload == "OKAY") {
      reply.kind = ReplyKind::kOkay;
    } else if (payload.starts_with("ERROR")) {
      reply.kind = ReplyKind::kError;
      reply.error_code = static_cast<std::uint8_t>(parse_hex(payload.substr(5)).value());
    }
    return after(&reply);
  }
  Result silence() { return after(nullptr); }

  ScriptedChannel channel;
  Exchange exchange;
  TrackerSetup setup;
  Complaints complaints;

 private:
  Result after(const Reply* reply) {
    setup.send(exchange);
    exchange.abandon();
    return setup.take(reply, exchange, complaints);
  }
};

TEST_F(TrackerSetupTest, SetsTheRateBeforeThePorts) {
  setup.begin();
  EXPECT_EQ(answer("OKAY"), Result::kGoOn);
  EXPECT_EQ(setup.step(), Step::kSetRate);
  EXPECT_EQ(answer("OKAY"), Result::kGoOn);
  EXPECT_EQ(channel.rates, std::vector<int>{115200});
  EXPECT_EQ(setup.step(), Step::kPorts);
  EXPECT_EQ(setup.port_setups(), 1U);
  EXPECT_GT(exchange.rests_until(), exchange.now());
}

TEST_F(TrackerSetupTest, ARateThatIsRefusedThreeTimesIsFollowedByTheNext) {
  setup.begin();
  answer("OKAY");
  for (int attempt = 0; attempt < 3; ++attempt) {
    EXPECT_EQ(answer("ERROR09"), Result::kGoOn);
  }
  EXPECT_EQ(answer("OKAY"), Result::kGoOn);
  EXPECT_EQ(channel.rates, std::vector<int>{57600});
}

TEST_F(TrackerSetupTest, SilenceAfterARateIsSearchedFor) {
  setup.begin();
  answer("OKAY");
  EXPECT_EQ(silence(), Result::kSilent);
}

TEST_F(TrackerSetupTest, AHaltThatIsNotAnsweredThreeTimesIsSilence) {
  setup.begin_with_halt(exchange, Step::kPorts);
  EXPECT_EQ(silence(), Result::kGoOn);
  EXPECT_EQ(silence(), Result::kGoOn);
  EXPECT_EQ(silence(), Result::kSilent);
  EXPECT_FALSE(complaints.take());
}

TEST_F(TrackerSetupTest, AnyAnswerToAHaltLeadsOn) {
  setup.begin_with_halt(exchange, Step::kInitialise);
  EXPECT_EQ(answer("ERROR0C"), Result::kGoOn);
  EXPECT_EQ(setup.step(), Step::kInitialise);
}

TEST_F(TrackerSetupTest, AFailedInitIsComplainedOfOnce) {
  setup.begin();
  EXPECT_EQ(answer("ERROR0D"), Result::kGoOn);
  EXPECT_EQ(answer("ERROR0D"), Result::kGoOn);
  EXPECT_EQ(answer("ERROR0D"), Result::kSilent);
  EXPECT_TRUE(complaints.take());
  EXPECT_FALSE(complaints.take());
  EXPECT_TRUE(complaints.last().text().starts_with("INIT failed with ERROR0D")) << complaints.last().text();
  EXPECT_EQ(complaints.lasting(), complaints.last());
  complaints.over();
  EXPECT_TRUE(complaints.lasting().empty());
}

}  // namespace
}  // namespace tubed::aurora
