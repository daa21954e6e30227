#include <gtest/gtest.h>

#include <CLI/Error.hpp>
#include <cmath>
#include <nlohmann/json.hpp>

#include "clients/tubectl/verbs.hpp"
#include "tests/clients/tubectl/straight_sequence.hpp"

namespace tubed {
namespace {

const std::vector<int> kAllSix{0, 1, 2, 3, 4, 5};

nlohmann::json evaluated(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), "evaluate");
  arguments.insert(arguments.end(), {"--json", "-"});
  testing::internal::CaptureStdout();
  EXPECT_EQ(run_verb(add_evaluate, arguments), kExitOk);
  return nlohmann::json::parse(testing::internal::GetCapturedStdout());
}

/// The message the verb fails with.
std::string refusal(const std::vector<std::string>& arguments) {
  try {
    run_verb(add_evaluate, arguments);
  } catch (const std::exception& error) {
    return error.what();
  }
  return "not refused";
}

TEST(Evaluate, GivesAShiftBackAsTheErrorOfEveryMetric) {
  const StraightSequence sequence(6);
  // World x is the camera's depth, world y its x: 3-4-5.
  const auto em = sequence.write_estimates("em.csv.est", kAllSix, {3, 4, 0});

  const auto mm = evaluated({sequence.path(), "--em", em})["em"]["mm"];

  EXPECT_NEAR(mm["Hausdorff"]["median"], 5, 1e-9);
  EXPECT_NEAR(mm["RMS"]["median"], 5, 1e-9);
  EXPECT_NEAR(mm["x RMS"]["median"], 4, 1e-9);
  EXPECT_NEAR(mm["y RMS"]["median"], 0, 1e-9);
  EXPECT_NEAR(mm["z RMS"]["median"], 3, 1e-9);
}

TEST(Evaluate, ComparesTwoMethodsAsTable1Does) {
  const StraightSequence sequence(6);
  const auto em = sequence.write_estimates("em.est", kAllSix, {3, 4, 0});
  const auto fused = sequence.write_estimates("fused.est", kAllSix, {3, 1, 0});

  const auto comparison = evaluated({sequence.path(), "--em", em, "--fused", fused})["comparison"];

  EXPECT_EQ(comparison["pairs"], 6);
  const auto x = comparison["metrics"]["x RMS"];
  EXPECT_NEAR(x["improvement_percent"]["median"], 75, 1e-9);
  EXPECT_NEAR(x["effect_size"], 1, 1e-12);
  EXPECT_NEAR(x["p"], 2.0 / 64, 1e-12);  // six improvements out of six
  EXPECT_NEAR(x["p_corrected"], 5 * 2.0 / 64, 1e-12);
  const auto z = comparison["metrics"]["z RMS"];
  EXPECT_NEAR(z["effect_size"], 0, 1e-12);
  EXPECT_NEAR(z["p_corrected"], 1, 1e-12);
}

TEST(Evaluate, SlidingAlongTheCatheterCountsOnlyAtEqualArcLength) {
  const StraightSequence sequence(1);
  const auto em = sequence.write_estimates("em.est", {0}, {0, 0, 10});

  const auto nearest = evaluated({sequence.path(), "--em", em})["em"]["mm"];
  const auto arc = evaluated({sequence.path(), "--em", em, "--match", "arc"})["em"]["mm"];

  // Only the first ten true points, s = 0 .. 9, lack a partner abreast; they are 10, 9, .. 1 mm from the tip.
  EXPECT_NEAR(nearest["RMS"]["median"], std::sqrt(385.0 / 371), 1e-9);
  EXPECT_NEAR(arc["RMS"]["median"], 10, 1e-9);
  EXPECT_NEAR(nearest["Hausdorff"]["median"], 10, 1e-9);
}

TEST(Evaluate, CountsMissingFramesInsteadOfLeavingThemOut) {
  const StraightSequence sequence(6);
  const auto em = sequence.write_estimates("em.est", {0, 2, 3, 5}, {1, 0, 0});

  const auto report = evaluated({sequence.path(), "--em", em});

  EXPECT_EQ(report["due"], 6);
  EXPECT_EQ(report["em"]["judged"], 4);
  EXPECT_EQ(report["em"]["missing_frames"], nlohmann::json({1, 4}));
}

TEST(Evaluate, AnEstimateWithoutShapeIsCountedUnderItsValidity) {
  const StraightSequence sequence(2);
  const auto good = sequence.write_estimates("em.est", {0}, {1, 0, 0});
  std::ofstream(good, std::ios::app) << "1,,,,,,,,NOT_AVAILABLE\n";

  const auto em = evaluated({sequence.path(), "--em", good})["em"];

  EXPECT_EQ(em["shapeless_frames"], nlohmann::json::array({1}));
  EXPECT_EQ(em["validity"], (nlohmann::json{{"NOT_AVAILABLE", 1}, {"VALID", 1}}));
}

TEST(Evaluate, TellsHowOftenSigmaKeepsItsWord) {
  const StraightSequence sequence(1);
  // Sigma is 2 mm: the error is 1.5 sigma along world x, 0.5 along y and none along z.
  const auto em = sequence.write_estimates("em.est", {0}, {3, 1, 0});

  const auto within = evaluated({sequence.path(), "--em", em})["em"]["within_sigma"];

  EXPECT_NEAR(within[0], 2.0 / 3, 1e-12);
  EXPECT_NEAR(within[1], 1, 1e-12);
}

TEST(Evaluate, ThePrintedTableHasThePaperBesideIt) {
  const StraightSequence sequence(6);
  const auto em = sequence.write_estimates("em.est", {0, 1, 2, 3, 4}, {3, 4, 0});
  const auto fused = sequence.write_estimates("fused.est", kAllSix, {3, 1, 0});

  testing::internal::CaptureStdout();
  run_verb(add_evaluate, {"evaluate", sequence.path(), "--em", em, "--fused", fused});
  const std::string text = testing::internal::GetCapturedStdout();

  EXPECT_NE(text.find("x RMS      4.00 | 0.00  1.00 | 0.00  75.0 | 0.0"), std::string::npos) << text;
  EXPECT_NE(text.find("87.9 | 9.5"), std::string::npos) << text;
  EXPECT_NE(text.find("LEFT OUT: 1 missing in the estimates: frame 5"), std::string::npos) << text;
}

// Off by 3, 4 and 12 mm where nothing holds it, by 0, 0, 1 mm elsewhere; sigma 2.
TEST(Evaluate, SaysHowFarOffThePointsAreThatNothingHolds) {
  const StraightSequence sequence(1);
  std::string text = "frame,s_mm,x,y,z,sigma_x,sigma_y,sigma_z,validity,held_by\n";
  for (int s = 0; s <= 100; ++s) {
    const bool is_held = s < 80;
    text += "0," + std::to_string(s) + (is_held ? ",0,0," : ",3,4,") +
            std::to_string(s + (is_held ? 1 : 12)) + ",2,2,2,VALID," +
            (s < 40    ? "3"
             : is_held ? "2"
                       : "0") +
            "\n";
  }
  const auto file = sequence.write("held.est", text);

  const auto held = evaluated({sequence.path(), "--em", file})["em"]["held_by"];

  EXPECT_EQ(held.size(), 3U) << held;
  EXPECT_EQ(held["a coil and an image"]["points"], 40);
  EXPECT_EQ(held["an image"]["points"], 40);
  EXPECT_NEAR(held["an image"]["rms_mm"], 1, 1e-9);
  EXPECT_EQ(held["an image"]["within_sigma"][0], 1);
  EXPECT_EQ(held["nothing"]["points"], 21);
  EXPECT_NEAR(held["nothing"]["rms_mm"], 13, 1e-9);
  EXPECT_NEAR(held["nothing"]["within_sigma"][0], 0, 1e-9);
  EXPECT_NEAR(held["nothing"]["within_sigma"][1], 2.0 / 3, 1e-9);

  testing::internal::CaptureStdout();
  EXPECT_EQ(run_verb(add_evaluate, {"evaluate", sequence.path(), "--em", file}), kExitOk);
  const std::string words = testing::internal::GetCapturedStdout();
  EXPECT_NE(words.find("nothing               20.8 %    13.00  13.00      13.00   0.0 / 66.7 / 66.7 %"),
            std::string::npos)
      << words;
}

TEST(Evaluate, RefusesEstimatesOfAnotherSequence) {
  const StraightSequence sequence(2);
  const auto em = sequence.write_estimates("em.est", {0, 7}, {1, 0, 0});

  EXPECT_NE(refusal({"evaluate", sequence.path(), "--em", em}).find("frame 7 is not due"), std::string::npos);
}

TEST(Evaluate, RefusesBadEstimatesWithFileLineAndColumn) {
  const StraightSequence sequence(1);
  const std::string header = "frame,s_mm,x,y,z,sigma_x,sigma_y,sigma_z,validity\n";
  const std::vector<std::pair<std::string, std::string>> rows{
      {header + "0,0,0,nan,0,1,1,1,VALID\n", ":2:7: "},
      {header + "0,0,0,0,0,1,-1,1,VALID\n", ":2:13: "},
      {header + "0,0,0,0,0,1,1,1,GOOD\n", ":2:17: "},
      {header + "0,1,0,0,0,1,1,1,VALID\n0,1,0,0,0,1,1,1,VALID\n", ":3:3: "},
      {header + "0,0,0,0,0,1,1,1,VALID\n0,1,0,0,0,1,1,1,INVALID\n", ":3:17: "},
      {header + "0,0,0,0,0,1,1,1,VALID\n1,0,0,0,0,1,1,1,VALID\n0,1,0,0,0,1,1,1,VALID\n", ":4:1: "},
      {"frame,s_mm,x,y,z,sigma_x,sigma_y,sigma_z,validity,held_by\n0,0,0,0,0,1,1,1,VALID,4\n", ":2:23: "},
      {header, ":1:1: "},
      {"frame,s_mm,x,y,z,validity\n0,0,0,0,0,VALID\n", ":1:1: "}};
  for (const auto& [text, place] : rows) {
    const std::string file = sequence.write("bad.est", text);
    EXPECT_EQ(refusal({"evaluate", sequence.path(), "--em", file}).find(file + place), 0U)
        << text << refusal({"evaluate", sequence.path(), "--em", file});
  }
}

TEST(Evaluate, WithoutAnyEstimatesIsAMistakeOfTheCommandLine) {
  const StraightSequence sequence(1);

  EXPECT_THROW(run_verb(add_evaluate, {"evaluate", sequence.path()}), CLI::ParseError);
}

}  // namespace
}  // namespace tubed
