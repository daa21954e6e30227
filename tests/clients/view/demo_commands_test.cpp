#include "clients/view/demo_commands.hpp"

#include <gtest/gtest.h>

namespace tubed {
namespace {

const auto kCommands = demo_commands({"A", "B"});

TEST(DemoCommands, APressNamesOneOfThem) {
  const DemoCommand* const command = pressed_command(R"({"press": "off"})", kCommands);
  ASSERT_NE(command, nullptr);
  ASSERT_EQ(command->orders.size(), 2U);  // of both cameras
  EXPECT_EQ(command->orders[0].source, "image-A");
  EXPECT_EQ(command->orders[1].words, "off");
}

TEST(DemoCommands, WhateverElseAPageSaysIsNone) {
  for (const char* words :
       {"", "off", "{", "[]", "{}", "null", R"({"press": 1})", R"({"press": "stall 100000"})",
        R"({"press": ["off"]})", R"({"press": "off)", "{\"press\": \"\xff\"}"}) {
    EXPECT_EQ(pressed_command(words, kCommands), nullptr) << words;
  }
  EXPECT_EQ(pressed_command(R"({"press": "off"})", {}), nullptr);  // no demonstration
}

TEST(DemoCommands, ASourceThatIsNotThereTakesNothing) {
  EXPECT_FALSE(send_command(kCommands.front(), "/nonexistent"));
  EXPECT_FALSE(send_command(kCommands.front(), std::string(200, 'x')));
}

}  // namespace
}  // namespace tubed
