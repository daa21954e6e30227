#include "drivers/aurora/identity_questions.hpp"

#include <gtest/gtest.h>

#include <string>

namespace tubed::aurora {
namespace {

bool take(IdentityQuestions& questions, const std::string& payload) {
  Reply reply;
  reply.payload = as_bytes(payload);
  return questions.take(&reply);
}

TEST(IdentityQuestions, AskForRevisionFirmwareGeneratorAndUnit) {
  IdentityQuestions questions;
  questions.begin();
  EXPECT_EQ(questions.command().text(), apirev_command().text());
  EXPECT_FALSE(take(questions, "D.001.007"));
  EXPECT_EQ(questions.command().text(), ver_command(4).text());
  EXPECT_FALSE(take(questions, "Aurora\nFreeze Tag: AURORA Rev 008\n"));
  EXPECT_EQ(questions.command().text(), ver_command(7).text());
  EXPECT_FALSE(take(questions, "Serial Number: FG-11\n"));
  EXPECT_EQ(questions.command().text(), ver_command(8).text());
  EXPECT_FALSE(questions.asked());
  EXPECT_TRUE(take(questions, "SCU Serial Number: SC-22\n"));
  EXPECT_TRUE(questions.asked());
  EXPECT_EQ(questions.api_revision()->minor, 7);
  EXPECT_EQ(questions.learnt().api_revision.text(), "D.001.007");
  EXPECT_EQ(questions.learnt().firmware.text(), "AURORA Rev 008");
  EXPECT_EQ(questions.learnt().field_generator.text(), "FG-11");
  EXPECT_EQ(questions.learnt().control_unit_serial.text(), "SC-22");
}

TEST(IdentityQuestions, GoOnPastATrackerThatDoesNotSay) {
  IdentityQuestions questions;
  questions.begin();
  const std::string unknown = "ERROR01";
  Reply error;
  error.kind = ReplyKind::kError;
  error.payload = as_bytes(unknown);
  EXPECT_FALSE(questions.take(nullptr));
  EXPECT_FALSE(questions.take(&error));
  EXPECT_FALSE(questions.take(nullptr));
  EXPECT_TRUE(questions.take(&error));
  EXPECT_TRUE(questions.asked());
  EXPECT_FALSE(questions.api_revision());
  EXPECT_EQ(questions.learnt(), TrackerIdentity{});
}

}  // namespace
}  // namespace tubed::aurora
