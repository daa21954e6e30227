#include "drivers/aurora/resumption.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

namespace tubed::aurora {
namespace {

using Answer = Resumption::Answer;

/// PHINF 0021 of an enabled coil.
std::string tool(const std::string& serial, const std::string& port, const std::string& channel,
                 const std::string& status = "3F") {
  return "0B000000NDI         000" + serial + status + "3C4B000000" + port + channel;
}

Answer take(Resumption& resumption, const std::string& payload) {
  Reply reply;
  reply.payload = as_bytes(payload);
  reply.kind = ReplyKind::kText;
  if (payload.starts_with("ERROR")) {
    reply.kind = ReplyKind::kError;
    reply.error_code = static_cast<std::uint8_t>(parse_hex(payload.substr(5)).value());
  }
  return resumption.take(reply);
}

/// Two coils of one plug were tracked.
Resumption of_two() {
  Resumption resumption;
  const std::array<FoundCoil, 2> tracked = {FoundCoil{0x0A, {1, 0}, 0x3C4B0001},
                                            FoundCoil{0x0D, {1, 1}, 0x3C4B0001}};
  resumption.remember(tracked);
  return resumption;
}

TEST(Resumption, IsPossibleOnlyWhenSomethingWasTracked) {
  Resumption resumption;
  EXPECT_FALSE(resumption.possible());
  resumption = of_two();
  EXPECT_TRUE(resumption.possible());
  resumption.forget();
  EXPECT_FALSE(resumption.possible());
}

TEST(Resumption, AsksEveryHandleForToolAndPlug) {
  Resumption resumption = of_two();
  EXPECT_EQ(resumption.command().text(), phinf_command(0x0A, 0x0021).text());
  EXPECT_EQ(take(resumption, tool("3C4B0001", "01", "00")), Answer::kGoOn);
  EXPECT_EQ(resumption.command().text(), phinf_command(0x0D, 0x0021).text());
  EXPECT_EQ(take(resumption, tool("3C4B0001", "01", "01")), Answer::kSame);
}

TEST(Resumption, IsRefusedForAnotherPlugChannelOrTool) {
  for (const std::string& other :
       {tool("3C4B0001", "02", "00"), tool("3C4B0001", "01", "02"), tool("3C4B0002", "01", "00")}) {
    Resumption resumption = of_two();
    EXPECT_EQ(take(resumption, other), Answer::kOther) << other;
  }
}

TEST(Resumption, IsRefusedForAHandleThatIsNotEnabledGoneOrUnknown) {
  for (const std::string& other :
       {tool("3C4B0001", "01", "00", "1F"), std::string("UNOCCUPIED"), std::string("ERROR08"),
        std::string("ERROR0C"), std::string("OKAY"), std::string("0B00")}) {
    Resumption resumption = of_two();
    EXPECT_EQ(take(resumption, other), Answer::kOther) << other;
  }
}

TEST(Resumption, AsksAgainWhenTheCommandWasDamagedOrSomethingElseAnswered) {
  Resumption resumption = of_two();
  EXPECT_EQ(take(resumption, "ERROR04"), Answer::kAgain);
  EXPECT_EQ(take(resumption, "ERROR01"), Answer::kAgain);
  Reply late;
  late.kind = ReplyKind::kBinary;
  EXPECT_EQ(resumption.take(late), Answer::kAgain);
  EXPECT_EQ(resumption.command().text(), phinf_command(0x0A, 0x0021).text());
}

// The first question was asked twice, as its answer was late: from then on every answer comes one question
// late.
TEST(Resumption, AnAnswerThatIsLateCountsForTheCoilItIsAbout) {
  Resumption resumption = of_two();
  EXPECT_EQ(take(resumption, tool("3C4B0001", "01", "00")), Answer::kGoOn);
  EXPECT_EQ(take(resumption, tool("3C4B0001", "01", "00")), Answer::kGoOn);
  EXPECT_EQ(resumption.command().text(), phinf_command(0x0D, 0x0021).text());
  EXPECT_EQ(take(resumption, tool("3C4B0001", "01", "01")), Answer::kSame);
}

// Every question is answered, so many questions late.
TEST(Resumption, AnswersMayAllBeLateByUpToThreeQuestions) {
  for (const std::size_t late : {1U, 2U, 3U}) {
    std::array<FoundCoil, 8> tracked{};
    for (std::uint8_t i = 0; i < tracked.size(); ++i) {
      tracked[i] = {static_cast<std::uint8_t>(0x0A + i), {1 + i / 2, i % 2}, 0x3C4B0001U};
    }
    Resumption resumption;
    resumption.remember(tracked);
    std::vector<std::string> asked(late, std::string(resumption.command().text()));
    Answer answer = Answer::kGoOn;
    for (std::size_t next = 0; next < 100 && answer == Answer::kGoOn; ++next) {
      asked.emplace_back(resumption.command().text());
      const auto about = std::find_if(tracked.begin(), tracked.end(), [&](const FoundCoil& coil) {
        return asked[next] == phinf_command(coil.handle, 0x0021).text();
      });
      ASSERT_NE(about, tracked.end());
      answer = take(resumption, tool("3C4B0001", "0" + std::to_string(about->plug.port),
                                     "0" + std::to_string(about->plug.channel)));
    }
    EXPECT_EQ(answer, Answer::kSame) << late << " late";
  }
}

TEST(Resumption, AnAnswerAboutALaterCoilIsNotAskedForAgain) {
  Resumption resumption = of_two();
  EXPECT_EQ(take(resumption, tool("3C4B0001", "01", "01")), Answer::kGoOn);
  EXPECT_EQ(resumption.command().text(), phinf_command(0x0A, 0x0021).text());
  EXPECT_EQ(take(resumption, tool("3C4B0001", "01", "00")), Answer::kSame);
}

TEST(Resumption, IsRefusedWhenHandlesHaveChangedPlaces) {
  Resumption resumption = of_two();
  Answer answer = Answer::kGoOn;
  for (int i = 0; i < 10 && answer == Answer::kGoOn; ++i) {
    const bool first = resumption.command().text() == phinf_command(0x0A, 0x0021).text();
    answer = take(resumption, tool("3C4B0001", "01", first ? "01" : "00"));
  }
  EXPECT_EQ(answer, Answer::kOther);
}

TEST(Resumption, BeginsWithTheFirstHandleAgain) {
  Resumption resumption = of_two();
  EXPECT_EQ(take(resumption, tool("3C4B0001", "01", "00")), Answer::kGoOn);
  resumption.begin();
  EXPECT_EQ(take(resumption, tool("3C4B0001", "01", "00")), Answer::kGoOn);
  EXPECT_EQ(take(resumption, tool("3C4B0001", "01", "01")), Answer::kSame);
}

}  // namespace
}  // namespace tubed::aurora
