#include "clients/tubectl/check/wire_conversation.hpp"

#include <gtest/gtest.h>

#include <random>

#include "clients/tubectl/check/aurora_assumptions.hpp"
#include "tests/clients/tubectl/hand_written_log.hpp"

namespace tubed {
namespace {

using std::chrono::milliseconds;

TEST(WireConversation, PutsTheEndOfACommandAndTheBeginningOfAReplyWhereTheLineHadThem) {
  // 9600 baud: 1.042 ms a byte; INIT:E3A5 and its end are 10 bytes, OKAYA896 and its end 9.
  const WireConversation heard =
      HandWrittenLog().send("INIT:E3A5\r").wait(milliseconds(70)).receive("OKAYA896\r").conversation();
  ASSERT_EQ(heard.turns.size(), 1U);
  EXPECT_NEAR(static_cast<double>(heard.turns[0].sent_whole.count()), 10.417e6, 1e3);
  EXPECT_NEAR(static_cast<double>(heard.turns[0].reply->first_byte.count()), 70e6 - 9.375e6, 1e3);
  EXPECT_EQ(heard.turns[0].reply->last_byte, milliseconds(70));
}

TEST(WireConversation, JoinsAReplyThatCameInPieces) {
  const WireConversation heard = HandWrittenLog()
                                     .send("PHSR:01E03E\r")
                                     .receive("020A01F")
                                     .wait(milliseconds(3))
                                     .receive("0B01F3465\r")
                                     .conversation();
  ASSERT_TRUE(heard.turns[0].reply.has_value());
  EXPECT_EQ(heard.turns[0].reply->payload, "020A01F0B01F");
  EXPECT_NEAR(static_cast<double>(heard.turns[0].reply->first_byte.count()), -7 * 1.0417e6, 1e3);
}

TEST(WireConversation, KeepsRepliesThatNobodyWaitedFor) {
  const WireConversation heard = HandWrittenLog().answer("OKAY").answer("RESET").conversation();
  EXPECT_TRUE(heard.turns.empty());
  ASSERT_EQ(heard.strays.size(), 2U);
  EXPECT_EQ(heard.strays[0].payload, "OKAY");
  EXPECT_TRUE(heard.strays[1].is_reset);
}

TEST(WireConversation, DoesNotTakeALateMeasurementForTheAnswerToAnotherCommand) {
  const WireConversation heard =
      HandWrittenLog().ask("APIREV").measure({pose_of(0x0A, 8)}).answer("D.001.007").conversation();
  ASSERT_TRUE(heard.turns[0].reply.has_value());
  EXPECT_EQ(heard.turns[0].reply->payload, "D.001.007");
  EXPECT_EQ(heard.strays.size(), 1U);
}

TEST(WireConversation, FollowsWhetherTheTrackerTracks) {
  const WireConversation heard = HandWrittenLog()
                                     .ask("TSTART")
                                     .answer("OKAY")
                                     .ask("VER", "4")
                                     .answer("013")
                                     .ask("TSTOP")
                                     .answer("OKAY")
                                     .ask("VER", "4")
                                     .answer("013")
                                     .conversation();
  EXPECT_FALSE(heard.turns[0].while_tracking);
  EXPECT_TRUE(heard.turns[1].while_tracking);
  EXPECT_FALSE(heard.turns[3].while_tracking);
}

TEST(WireConversation, EndsWhateverTheLogHolds) {
  std::mt19937 random(1);
  for (int log_number = 0; log_number < 200; ++log_number) {
    HandWrittenLog log;
    for (int entry = 0; entry < 30; ++entry) {
      std::string bytes(random() % 200, '\0');
      for (char& byte : bytes) {
        byte = static_cast<char>(random() % 256);
      }
      switch (random() % 5) {
        case 0:
          log.send(bytes);
          break;
        case 1:
          log.receive(bytes);
          break;
        case 2:
          log.answer(std::to_string(random()));
          break;
        case 3:
          log.ask("PHINF", bytes.substr(0, random() % 7));
          break;
        default:
          log.baud(static_cast<int>(random() % 3)).serial_break();
      }
    }
    EXPECT_EQ(judge_assumptions(log.conversation()).size(), aurora_assumptions().size());
  }
  const WireConversation endless = HandWrittenLog().receive(std::string(100'000, 'A')).conversation();
  EXPECT_EQ(endless.replies, 0U);
  EXPECT_GT(endless.damaged, 0U);
}

}  // namespace
}  // namespace tubed
