#include "idl/command_line/command_line.hpp"

#include <gtest/gtest.h>

namespace tubed {
namespace {

/// What a program with the verbs echo and calibrate (coils, camera) makes of some words.
struct Answer {
  std::optional<int> code;
  std::string words;  ///< on standard error
  bool echoed = false;
};

Answer answer_to(std::vector<const char*> words) {
  Answer answer;
  Program program("A program.", "tubectl");
  CommandLine app = program.command_line();
  app.require_subcommand();
  CommandLine echo = app.add_subcommand("echo", "Print");
  bool as_json = false;
  int count = 0;
  echo.add_flag("--json", as_json, "JSON");
  echo.add_option("--count", count, "So many");
  echo.callback([&answer] { answer.echoed = true; });
  CommandLine calibrate = app.add_subcommand("calibrate", "Calibrate");
  calibrate.require_subcommand();
  calibrate.add_subcommand("coils", "Coils");
  calibrate.add_subcommand("camera", "Camera");
  words.insert(words.begin(), "tubectl");
  testing::internal::CaptureStderr();
  testing::internal::CaptureStdout();
  answer.code = program.parse(static_cast<int>(words.size()), words.data());
  testing::internal::GetCapturedStdout();
  answer.words = testing::internal::GetCapturedStderr();
  return answer;
}

TEST(CommandLine, AMistypedVerbIsNamedAndTheNearOneOffered) {
  const Answer answer = answer_to({"ehco", "--json"});

  EXPECT_EQ(answer.code, Program::kExitOfUsage);
  EXPECT_EQ(answer.words,
            "tubectl: there is no 'ehco'; did you mean 'echo'? `tubectl --help` lists what there is.\n");
}

TEST(CommandLine, SoIsAMistypedVerbOfAVerb) {
  EXPECT_EQ(
      answer_to({"calibrate", "coisl"}).words,
      "tubectl calibrate: there is no 'coisl'; did you mean 'coils'? `tubectl calibrate --help` lists what "
      "there is.\n");
}

TEST(CommandLine, NothingIsOfferedForAWordThatIsNearNone) {
  EXPECT_EQ(answer_to({"frobnicate"}).words,
            "tubectl: there is no 'frobnicate'; `tubectl --help` lists what there is.\n");
}

TEST(CommandLine, AMistypedOptionIsOfferedTheNearOne) {
  const Answer answer = answer_to({"echo", "--jsno"});

  EXPECT_EQ(answer.code, Program::kExitOfUsage);
  EXPECT_NE(answer.words.find("Did you mean --json instead of --jsno?"), std::string::npos) << answer.words;
  EXPECT_NE(answer_to({"echo", "--cuont=3"}).words.find("Did you mean --count"), std::string::npos);
}

TEST(CommandLine, SoIsOneInPlaceOfAVerb) {
  const Answer answer = answer_to({"--hlep"});

  EXPECT_EQ(answer.code, Program::kExitOfUsage);
  EXPECT_NE(answer.words.find("Did you mean --help instead of --hlep?"), std::string::npos) << answer.words;
}

TEST(CommandLine, WhatIsRightRuns) {
  const Answer answer = answer_to({"echo", "--json", "--count", "3"});

  EXPECT_FALSE(answer.code.has_value());
  EXPECT_TRUE(answer.echoed);
  EXPECT_EQ(answer.words, "");
  EXPECT_EQ(answer_to({"--help"}).code, 0);
  EXPECT_EQ(answer_to({}).code, Program::kExitOfUsage);
  EXPECT_FALSE(answer_to({"calibrate", "coils"}).code.has_value());
}

}  // namespace
}  // namespace tubed
