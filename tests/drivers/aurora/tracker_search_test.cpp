#include "drivers/aurora/tracker_search.hpp"

#include <gtest/gtest.h>

#include "tests/drivers/aurora/scripted_channel.hpp"

namespace tubed::aurora {
namespace {

using Result = TrackerSearch::Result;

class TrackerSearchTest : public testing::Test {
 protected:
  TrackerSearchTest() : exchange(std::size_t{64} << 10U) { exchange.attach(channel); }

  /// Asks, and hears `reply` at once, or nothing until the exchange gives up.
  Result ask(const std::string& reply) {
    search.send(exchange);
    if (!reply.empty()) {
      channel.script.emplace_back(channel.time, reply);
    }
    Reply heard;
    const auto event = exchange.listen(channel.time + std::chrono::seconds(5), heard);
    return search.take(event == Exchange::Event::kReply ? &heard : nullptr, exchange.now());
  }
  static std::string line(const std::string& payload) {
    std::array<std::uint8_t, 128> bytes{};
    return std::string(as_text(Bytes(bytes).first(encode_text_reply(payload, bytes))));
  }

  ScriptedChannel channel;
  Exchange exchange;
  TrackerSearch search;
};

TEST_F(TrackerSearchTest, FindsWhatCarriesOutInit) {
  search.begin(BaudRate::k115200);
  EXPECT_EQ(ask(line("OKAY")), Result::kFound);
  EXPECT_EQ(channel.rates, std::vector<int>{9600});
  EXPECT_EQ(channel.written.at(0), std::string(as_text(init_command().bytes())));
}

TEST_F(TrackerSearchTest, AnAnswerOfAnyKindSaysThatTheRateIsRight) {
  search.begin(BaudRate::k115200);
  EXPECT_EQ(ask(line("ERROR0C")), Result::kOtherState);
}

TEST_F(TrackerSearchTest, SaysThatEveryRateWasTriedAndGoesOn) {
  search.begin(BaudRate::k115200);
  Result result = Result::kGoOn;
  for (int asked = 0; asked < 100 && result == Result::kGoOn; ++asked) {
    result = ask("");
  }
  EXPECT_EQ(result, Result::kNowhere);
  for (const BaudRate rate : kRates) {
    EXPECT_EQ(std::count(channel.rates.begin(), channel.rates.end(), bits_per_second(rate)) > 0, true)
        << bits_per_second(rate);
  }
  EXPECT_EQ(ask(line("OKAY")), Result::kFound);
}

TEST_F(TrackerSearchTest, AsksATrackerThatTrackedWhetherItStillDoes) {
  const std::array<FoundCoil, 1> coils = {FoundCoil{0x0A, {1, 0}, 0x3C4B0001}};
  search.remember(coils, BaudRate::k230400);
  search.begin(BaudRate::k115200);
  EXPECT_EQ(ask(line("0B000000NDI         0003C4B00013F3C4B0000000100")), Result::kUnchanged);
  EXPECT_EQ(channel.rates, std::vector<int>{230400});

  search.begin(BaudRate::k115200);
  EXPECT_EQ(ask(line("0B000000NDI         0003C4B00023F3C4B0000000100")), Result::kOtherState);
}

TEST_F(TrackerSearchTest, DoesNotAskAfterItWasToldSomethingElse) {
  const std::array<FoundCoil, 1> coils = {FoundCoil{0x0A, {1, 0}, 0x3C4B0001}};
  search.remember(coils, BaudRate::k230400);
  search.forget();
  search.begin(BaudRate::k115200);
  EXPECT_EQ(ask(line("OKAY")), Result::kFound);
  EXPECT_EQ(channel.rates, std::vector<int>{9600});
}

}  // namespace
}  // namespace tubed::aurora
