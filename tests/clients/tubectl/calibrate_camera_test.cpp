// `tubectl calibrate camera` with numbers that no C-arm has.
#include <gtest/gtest.h>

#include <CLI/Error.hpp>

#include "clients/tubectl/verbs.hpp"
#include "tests/clients/tubectl/calibrate_outcome.hpp"

namespace tubed {
namespace {

/// What is said of these options, before an image is looked at.
std::string complaint(const std::vector<std::string>& options) {
  std::vector<std::string> words{"calibrate", "camera",    "none.png", "--camera",
                                 "A",         "--phantom", "none.toml"};
  words.insert(words.end(), options.begin(), options.end());
  testing::internal::CaptureStderr();
  std::string refusal;
  try {
    run_verb(add_calibrate, words);
  } catch (const CLI::ParseError& error) {
    refusal = error.what();
  }
  return refusal + testing::internal::GetCapturedStderr();
}

TEST(CalibrateCamera, APitchThatNoDetectorHasIsRefusedWithItsUnit) {
  for (const std::string pitch : {"-1", "0", "0.0006", "600", "2.01", "nan", "inf"}) {
    EXPECT_EQ(complaint({"--pitch", pitch}), "--pitch: expected 0.02 to 2 mm, found " + pitch);
  }
  for (const std::string pitch : {"0.02", "0.154", "2"}) {
    EXPECT_EQ(complaint({"--pitch", pitch}).find("--pitch"), std::string::npos) << pitch;
  }
}

TEST(CalibrateCamera, SoAreDistancesFocalLengthsAndSquares) {
  EXPECT_EQ(complaint({"--source-detector", "1.2"}), "--source-detector: expected 100 to 3000 mm, found 1.2");
  EXPECT_EQ(complaint({"--source-isocentre", "-785"}),
            "--source-isocentre: expected 100 to 3000 mm, found -785");
  EXPECT_EQ(complaint({"--focal", "0"}), "--focal: expected 50 to 150000 px, found 0");
  EXPECT_EQ(complaint({"--square", "0.01"}), "--square: expected 0.1 to 1000 mm, found 0.01");
}

TEST(CalibrateCamera, AnglesThatNoCArmTurnsToAreRefused) {
  const std::string expected =
      "expected a primary angle of -180 to 180 deg and a secondary one of -90 to 90 deg";
  EXPECT_NE(complaint({"--angles", "0,0:300,0"}).find("--angles: \"300,0\": " + expected), std::string::npos);
  EXPECT_NE(complaint({"--angles", "0,-91"}).find("--angles: \"0,-91\": " + expected), std::string::npos);
}

TEST(CalibrateCamera, AnIsocentreBehindTheDetectorIsRefused) {
  const std::string words = complaint({"--source-detector", "785", "--source-isocentre", "1200"});
  EXPECT_NE(words.find("--source-isocentre has to be less than --source-detector"), std::string::npos)
      << words;
}

}  // namespace
}  // namespace tubed
