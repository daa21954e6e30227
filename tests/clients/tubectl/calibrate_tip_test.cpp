// `tubectl calibrate tip`: a drawing becomes arcs in a configuration.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "daemon/config/sample_configuration.hpp"
#include "tests/clients/tubectl/calibrate_outcome.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tubed {
namespace {

/// A hook of 10 mm radius and 15 mm length, 25 mm of shaft; exact.
std::string drawing() {
  std::string text = "x_mm,y_mm\n";
  for (double s_mm = 0; s_mm <= 40; s_mm += 2) {
    const double angle = std::max(15 - s_mm, 0.0) / 10;
    const double x = s_mm < 15 ? -10 * std::sin(angle) : s_mm - 15;
    const double y = s_mm < 15 ? 10 * (1 - std::cos(angle)) : 0;
    text += std::to_string(x) + "," + std::to_string(y) + "\n";
  }
  return text;
}

TEST(CalibrateTip, ADrawingBecomesAFragmentAndAPage) {
  const TemporaryFolder folder;
  folder.write("hook.csv", drawing());
  const std::string page = (folder.path() / "hook.svg").string();
  const CalibrateOutcome outcome =
      calibrate({"tip", (folder.path() / "hook.csv").string(), "--instrument", "guide", "--report", page});
  EXPECT_EQ(outcome.exit_code, kExitOk) << outcome.err;
  EXPECT_NE(outcome.out.find("id = 'guide'\nrest_shape = 'arcs'\nrest_arcs_mm = [15"), std::string::npos)
      << outcome.out;
  EXPECT_TRUE(std::filesystem::exists(page));
}

TEST(CalibrateTip, NumbersForMachines) {
  const TemporaryFolder folder;
  folder.write("hook.csv", drawing());
  const CalibrateOutcome outcome = calibrate({"tip", (folder.path() / "hook.csv").string(), "--json", "-"});
  const nlohmann::json found = nlohmann::json::parse(outcome.out);
  ASSERT_EQ(found.at("arcs").size(), 1U) << outcome.out;
  EXPECT_NEAR(found.at("arcs")[0].at("length_mm").get<double>(), 15, 0.3);
  EXPECT_NEAR(found.at("arcs")[0].at("radius_mm").get<double>(), 10, 0.3);
  EXPECT_FALSE(found.at("ends_bent").get<bool>());
}

TEST(CalibrateTip, NumbersForMachinesLeaveTheFragmentAndTheConfigurationAsTheyAreWithoutThem) {
  const TemporaryFolder folder;
  folder.write("hook.csv", drawing());
  folder.write("tubed.toml", sample_configuration({}));
  const std::string config = (folder.path() / "tubed.toml").string();
  const std::string out = (folder.path() / "hook.toml").string();
  const CalibrateOutcome outcome =
      calibrate({"tip", (folder.path() / "hook.csv").string(), "--instrument", "cath-1", "--json", "-",
                 "--out", out, "--config", config, "--yes"});
  EXPECT_EQ(outcome.exit_code, kExitOk) << outcome.err;
  EXPECT_EQ(nlohmann::json::parse(outcome.out).at("arcs").size(), 1U);
  for (const char* const file : {"hook.toml", "tubed.toml"}) {
    EXPECT_NE(folder.read(file).find("\nrest_arcs_mm = [15"), std::string::npos) << file;
  }
}

TEST(CalibrateTip, WithNumbersForMachinesNobodyIsAskedAndThatNothingWasWrittenIsSaid) {
  const TemporaryFolder folder;
  folder.write("hook.csv", drawing());
  folder.write("tubed.toml", sample_configuration({}));
  const std::string config = (folder.path() / "tubed.toml").string();
  const CalibrateOutcome outcome =
      calibrate({"tip", (folder.path() / "hook.csv").string(), "--json", "-", "--config", config});
  EXPECT_EQ(outcome.exit_code, kExitOk) << outcome.err;
  EXPECT_NE(
      outcome.err.find("Nothing was written into " + config + ": with --json nobody is asked; add --yes"),
      std::string::npos)
      << outcome.err;
  EXPECT_EQ(folder.read("tubed.toml"), sample_configuration({}));
}

TEST(CalibrateTip, WhatIsDoubtfulIsWarnedOf) {
  const TemporaryFolder folder;
  std::string reversed = "x_mm,y_mm\n";
  std::vector<std::string> points;
  std::istringstream lines(drawing());
  for (std::string line; std::getline(lines, line);) points.insert(points.begin(), line);
  points.pop_back();  // the header
  for (const std::string& point : points) reversed += point + "\n";
  folder.write("hook.csv", reversed);
  const CalibrateOutcome outcome = calibrate({"tip", (folder.path() / "hook.csv").string()});
  EXPECT_EQ(outcome.exit_code, kExitOk) << outcome.err;
  EXPECT_NE(outcome.err.find("WARNING: the drawing is straight over its first 25 mm"), std::string::npos)
      << outcome.err;
}

TEST(CalibrateTip, WhatIsNoDrawingIsBadData) {
  const TemporaryFolder folder;
  folder.write("few.csv", "x_mm,y_mm\n0,0\n2,0\n");
  const CalibrateOutcome outcome = calibrate({"tip", (folder.path() / "few.csv").string()});
  EXPECT_EQ(outcome.exit_code, kExitBadData);
  EXPECT_NE(outcome.err.find("expected 8 points or more, found 2"), std::string::npos) << outcome.err;
  EXPECT_EQ(outcome.out, "");
}

}  // namespace
}  // namespace tubed
