#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "daemon/config/load_configuration.hpp"
#include "drivers/driver_registry/driver_registry.hpp"

namespace tubed {
namespace {

constexpr const char* kSensor =
    "sensor = 6\nT_em_reference = [[0, -1, 0, 70], [1, 0, 0, 40], [0, 0, 1, 60], [0, 0, 0, 1]]\n";
constexpr const char* kCoils =
    "sensors = [6, 8]\npositions_em_mm = [55, 40, 60, 85, 40, 60]\naxes_em = [0, 0, 1, 0, 1, 0]\n";

Configuration with_reference(const std::string& keys, const std::string& camera_key = "") {
  std::ifstream in(std::string(TUBED_SOURCE_DIR) + "/tests/daemon/config/base.toml", std::ios::binary);
  std::ostringstream stream;
  stream << in.rdbuf();
  std::string text = stream.str();
  const std::string camera = "\n[[camera]]\n";
  text.replace(text.find(camera), camera.size(), "\n[em.reference]\n" + keys + camera + camera_key);
  return parse_configuration(text, "reference.toml");
}

TEST(Reference, ASensorIsWhereTheFileSays) {
  const auto reference = with_reference(std::string(kSensor) + "timeout_ms = 300.0\n").room.reference;
  ASSERT_TRUE(reference);
  EXPECT_EQ(reference->sensors, std::vector<int>{6});
  EXPECT_EQ(reference->T_em_reference_registered.translation(), Eigen::Vector3d(70, 40, 60));
  EXPECT_EQ(reference->T_em_reference_registered.linear().col(0), Eigen::Vector3d::UnitY());
  EXPECT_EQ(reference->timeout_ms, 300);
  EXPECT_EQ(reference->time_constant_ms, 100);
}

TEST(Reference, TwoCoilsAreWhereTheFileSays) {
  const auto reference = with_reference(kCoils).room.reference;
  ASSERT_TRUE(reference);
  EXPECT_TRUE(reference->has_two_coils());
  EXPECT_EQ(reference->p_em_registered_mm[1], Eigen::Vector3d(85, 40, 60));
  EXPECT_EQ(reference->axis_em_registered[0], Eigen::Vector3d::UnitZ());
}

TEST(Reference, WithoutTheTableThereIsNone) {
  EXPECT_FALSE(
      load_configuration(std::string(TUBED_SOURCE_DIR) + "/tests/daemon/config/base.toml").room.reference);
}

TEST(Reference, ItsSensorsAreMeasuredToo) {
  const auto coils = tracked_coils(with_reference(std::string(kCoils) + "ports = [4]\n").room);
  ASSERT_EQ(coils.size(), 4U);
  EXPECT_EQ(coils[2].sensor, 6);
  EXPECT_EQ(coils[2].port, 4);
  EXPECT_EQ(coils[2].channel, 0);
  EXPECT_EQ(coils[3].sensor, 8);
  EXPECT_EQ(coils[3].port, 4);
  EXPECT_EQ(coils[3].channel, 1) << "both on one plug";
  const auto apart = tracked_coils(with_reference(std::string(kCoils) + "ports = [4, 5]\n").room);
  EXPECT_EQ(apart[3].port, 5);
  EXPECT_EQ(apart[3].channel, 0);
}

TEST(Reference, CamerasThatNeedNotSayHowTheyStandAreWorthAWarning) {
  const auto warns = [](const Configuration& configuration) {
    return std::any_of(configuration.warnings.begin(), configuration.warnings.end(),
                       [](const std::string& line) {
                         return line.find("wrong once the patient does") != std::string::npos;
                       });
  };
  EXPECT_TRUE(warns(with_reference(kSensor)));
  EXPECT_FALSE(warns(with_reference(kSensor, "geometry = \"required\"\n")));
}

}  // namespace
}  // namespace tubed
