#include <gtest/gtest.h>

#include <CLI/Error.hpp>
#include "clients/tubectl/verbs.hpp"
#include "daemon/config/load_configuration.hpp"
#include "tests/clients/tubectl/straight_sequence.hpp"

namespace tubed {
namespace {

/// What the daemon makes of what `tubectl configure` wrote.
Configuration configured(const StraightSequence& sequence, std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), {"configure", sequence.path()});
  testing::internal::CaptureStdout();
  EXPECT_EQ(run_verb(add_configure, arguments), kExitOk);
  return parse_configuration(testing::internal::GetCapturedStdout(), "tubed.toml");
}

TEST(Configure, WritesWhatTheDaemonReadsBackToTheLastBit) {
  const StraightSequence sequence(2);

  const Configuration configuration = configured(sequence, {"--domain", "7"});

  EXPECT_EQ(configuration.dds.domain, 7);
  EXPECT_EQ(configuration.em_source.driver, "replay");
  EXPECT_EQ(configuration.em_source.settings.get<std::string>("folder"), sequence.path());
  EXPECT_FALSE(configuration.em_source.settings.get<bool>("loop"));
  EXPECT_TRUE(configuration.room.registered);
  EXPECT_EQ(configuration.room.T_world_em.translation(), Eigen::Vector3d(0.1, 20, 0));
  ASSERT_EQ(configuration.room.cameras.size(), 1U);
  EXPECT_EQ(configuration.room.cameras[0].width, 101);
  EXPECT_EQ(configuration.room.cameras[0].T_camera_world.translation(), Eigen::Vector3d(0, 0, 1000));
}

TEST(Configure, EmTooAddsAnInstrumentOnTheSameCoils) {
  const StraightSequence sequence(2);

  const Configuration configuration = configured(sequence, {"--em-too", "--loop"});

  ASSERT_EQ(configuration.room.instruments.size(), 2U);
  EXPECT_EQ(configuration.room.instruments[0].id, "cath-1");
  EXPECT_EQ(configuration.room.instruments[1].id, "cath-1-em");
  EXPECT_EQ(configuration.estimators[0].mode, EstimatorMode::kFilter);
  EXPECT_EQ(configuration.estimators[1].mode, EstimatorMode::kEm);
  ASSERT_EQ(configuration.room.instruments[1].coils.size(), 2U);
  EXPECT_EQ(configuration.room.instruments[1].coils[1].offset_from_tip_mm, 370);
  EXPECT_TRUE(configuration.em_source.settings.get<bool>("loop"));
}

TEST(Configure, RefusesAModeThatDoesNotExist) {
  const StraightSequence sequence(1);

  EXPECT_THROW(run_verb(add_configure, {"configure", sequence.path(), "--mode", "magic"}), CLI::ParseError);
}

}  // namespace
}  // namespace tubed
