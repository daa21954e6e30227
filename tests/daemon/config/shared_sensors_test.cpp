// Two instruments with the same sensors: one catheter in two modes, or a mistake.
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "daemon/config/load_configuration.hpp"

namespace tubed {
namespace {

constexpr const char* kCoils =
    "[[instrument.coil]]\nsensor = 1\noffset_from_tip_mm = 10.0\n"
    "[[instrument.coil]]\nsensor = 2\noffset_from_tip_mm = 90.0\n";

/// Beside "cath-1", which has kCoils and mode joint.
Configuration with_second(const std::string& mode, const std::string& coils) {
  std::ifstream in(std::string(TUBED_SOURCE_DIR) + "/tests/daemon/config/base.toml");
  std::ostringstream text;
  text << in.rdbuf() << "\n[[instrument]]\nid = \"cath-2\"\nmode = \"" << mode << "\"\n" << coils;
  return parse_configuration(text.str(), "room.toml");
}

TEST(SharedSensors, OneSensorOfTwoInstrumentsIsAllowedAndSaid) {
  const Configuration configuration =
      with_second("joint", "[[instrument.coil]]\nsensor = 2\noffset_from_tip_mm = 5\n");

  ASSERT_EQ(configuration.warnings.size(), 1U);
  EXPECT_NE(
      configuration.warnings[0].find("instrument[1].coil: sensor 2 belongs to instrument \"cath-1\" too"),
      std::string::npos)
      << configuration.warnings[0];
  EXPECT_EQ(configuration.estimators.size(), 2U);
}

TEST(SharedSensors, OneCatheterInTwoModesIsAComparison) {
  EXPECT_TRUE(with_second("em", kCoils).warnings.empty());
}

TEST(SharedSensors, OneCatheterTwiceInTheSameModeIsSaidOnce) {
  const std::vector<std::string> warnings = with_second("joint", kCoils).warnings;

  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_NE(warnings[0].find("sensors 1, 2 belong to instrument \"cath-1\" too"), std::string::npos)
      << warnings[0];
}

TEST(SharedSensors, CoilsAtOtherPlacesAreAnotherCatheter) {
  EXPECT_EQ(with_second("em",
                        "[[instrument.coil]]\nsensor = 1\noffset_from_tip_mm = 10.0\n"
                        "[[instrument.coil]]\nsensor = 2\noffset_from_tip_mm = 91.0\n")
                .warnings.size(),
            1U);
}

}  // namespace
}  // namespace tubed
