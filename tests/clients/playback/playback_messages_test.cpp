#include "clients/playback/playback_messages.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>

namespace tubed {
namespace {

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

TEST(PlaybackWish, IsOneOfFour) {
  EXPECT_EQ(parse_wish(R"({"play": false})")->play, false);
  EXPECT_EQ(parse_wish(R"({"seek": 12.5})")->seek_s, 12.5);
  EXPECT_EQ(parse_wish(R"({"step": -1})")->step, -1);
  EXPECT_EQ(parse_wish(R"({"faster": -2})")->faster, -2);
}

TEST(PlaybackWish, AnythingElseIsNone) {
  for (const char* words :
       {"", "{", "[]", "5", "{}", R"({"seek": "12"})", R"({"play": 1})", R"({"step": true})",
        R"({"step": 1e300})", R"({"faster": 1e300})", R"({"faster": null})", R"({"seek": 1, "play": true})",
        R"({"press": "off"})", R"({"seek": null})", "\xff\xfe"}) {
    EXPECT_EQ(parse_wish(words), std::nullopt) << words;
  }
}

TEST(PlaybackWish, IsFollowed) {
  RecordingPosition position({0, 1, 2, 3});
  position.set_ready(4);
  position.advance(10);
  follow(*parse_wish(R"({"play": false})"), 10, position);
  EXPECT_FALSE(position.is_playing());
  follow(*parse_wish(R"({"seek": 2.2})"), 10, position);
  EXPECT_EQ(position.t_s(), 2.2);
  follow(*parse_wish(R"({"step": -1})"), 10, position);
  EXPECT_EQ(position.t_s(), 1);
  // Two presses before the page has heard of the first are two.
  follow(*parse_wish(R"({"faster": 1})"), 10, position);
  follow(*parse_wish(R"({"faster": 1})"), 10, position);
  EXPECT_EQ(position.speed(), 4);
  follow(*parse_wish(R"({"faster": -3})"), 10, position);
  EXPECT_EQ(position.speed(), 0.5);
  follow(*parse_wish(R"({"play": true})"), 10, position);
  EXPECT_TRUE(position.is_playing());
}

TimeLine line() {
  return {.name = "run",
          .times_s = {5, 6, 7, 8, 9},
          .instants = {{Validity::kValid, 1, 2, kNone},
                       {Validity::kQuestionable, 3, 1, kNone},
                       {Validity::kInvalid, kNone, kNone, kNone},
                       {Validity::kValid, 0.25F, 4, kNone}},
          .trouble = ""};
}

TEST(TimeLine, APieceShowsItsLeastValidInstantAndItsLargestValues) {
  const nlohmann::json json = timeline_json(line(), 2);
  EXPECT_EQ(json["validity"], "QI");  // 5, 6 | 7, 8; 9 is not ready
  ASSERT_EQ(json["rows"].size(), 2U);
  EXPECT_EQ(json["rows"][0]["name"], "largest residual of a coil");
  EXPECT_EQ(json["rows"][0]["values"], (nlohmann::json{3.0, 0.25}));
  EXPECT_EQ(json["rows"][1]["values"], (nlohmann::json{2.0, 4.0}));
}

TEST(TimeLine, SaysWhereItBeginsAndEndsAndHowFarItIs) {
  nlohmann::json json = timeline_json(line(), 4);
  EXPECT_EQ(json["begin"], 5);
  EXPECT_EQ(json["end"], 9);
  EXPECT_EQ(json["ready"], 8);
  EXPECT_EQ(json["done"], false);
  TimeLine done = line();
  done.instants.push_back({Validity::kValid, 1, 1, 0.5F});
  json = timeline_json(done, 4);
  EXPECT_EQ(json["done"], true);
  EXPECT_EQ(json["rows"][0]["name"], "error in view, RMS");
  EXPECT_EQ(json["rows"][0]["values"], (nlohmann::json{nullptr, nullptr, nullptr, 0.5}));
}

TEST(TimeLine, APieceWithoutAnInstantIsEmpty) {
  const nlohmann::json json = timeline_json(line(), 8);
  EXPECT_EQ(json["validity"], "V Q I V ");
  EXPECT_TRUE(json["rows"][0]["values"][1].is_null());
}

TEST(TimeLine, ARecordingOfOneInstantOrWithoutAnyYetHasOne) {
  const TimeLine one{.name = "run", .times_s = {2}, .instants = {{Validity::kValid, 1, 1, 1}}, .trouble = ""};
  EXPECT_EQ(timeline_json(one, 3)["validity"], "V  ");
  const TimeLine none{.name = "run", .times_s = {2, 3}, .instants = {}, .trouble = "gone"};
  const nlohmann::json json = timeline_json(none, 3);
  EXPECT_EQ(json["validity"], "   ");
  EXPECT_EQ(json["ready"], 2);
  EXPECT_EQ(json["trouble"], "gone");
  EXPECT_TRUE(json["rows"].empty());
}

TEST(PositionMessage, SaysWhichInstant) {
  RecordingPosition position({0, 1});
  EXPECT_TRUE(position_json(position, 0)["instant"].is_null());
  position.set_ready(2);
  position.advance(10);
  position.advance(11.5);
  const nlohmann::json json = position_json(position, 42);
  EXPECT_EQ(json["instant"], 1);
  EXPECT_EQ(json["frame"], 42);
  EXPECT_EQ(json["at"], 1);
  EXPECT_EQ(json["playing"], false);
}

}  // namespace
}  // namespace tubed
