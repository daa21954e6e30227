#include "drivers/laboratory/instrument/catheterisation.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "drivers/laboratory/vessel/aorta.hpp"

namespace tubed {
namespace {

Catheterisation paper_run(std::int64_t seed, std::size_t steps = 337) {
  const AortaDimensions size = aorta_of_patient(seed);
  const Vessel vessel = make_aorta(size);
  std::vector<CatheterCommand> commands = paper_commands();
  const CatheterisationStart start = start_for(vessel, -size.arch_turn_from_anterior_rad, seed, commands);
  commands.resize(steps);
  return catheterise(vessel, {}, start, commands);
}

TEST(PaperCommands, Are337StepsOf328MmAnd90Degrees) {
  double inserted_mm = 0;
  double bent_rad = 0;
  for (const CatheterCommand& command : paper_commands()) {
    inserted_mm += command.insert_mm;
    bent_rad += command.bend_rad;
  }
  EXPECT_EQ(paper_commands().size(), 337U);
  EXPECT_NEAR(inserted_mm, 83 + 70 + 175, 1e-9);
  EXPECT_NEAR(bent_rad, std::numbers::pi / 2, 1e-9);
}

class PaperRun : public ::testing::TestWithParam<std::int64_t> {};

TEST_P(PaperRun, EveryStepIsABalanceInsideTheVesselAndAsLongAsTheCatheter) {
  const Catheterisation run = paper_run(GetParam());
  const RunReport report = run.report();

  EXPECT_EQ(report.steps, 337U);
  EXPECT_EQ(report.unfinished, 0);
  EXPECT_LT(report.median_penetration_mm, 0.2);
  EXPECT_LT(report.max_penetration_mm, 0.5);
  EXPECT_LT(report.max_length_error, 1e-3);
  for (const CatheterShape& shape : run.shapes) {
    double length_mm = 0;
    for (double s_mm = 0; s_mm < 380; s_mm += 1) {
      length_mm += (shape.at(s_mm + 1).p_world_mm - shape.at(s_mm).p_world_mm).norm();
    }
    ASSERT_NEAR(length_mm, 380, 0.38);
  }
}

TEST_P(PaperRun, ItGoesFromTheDescendingAortaToTheValve) {
  const Vessel vessel = make_aorta(aorta_of_patient(GetParam()));
  const Catheterisation run = paper_run(GetParam());
  const Eigen::Vector3d first_tip_mm = run.shapes.front().at(0).p_world_mm;
  const Eigen::Vector3d last_tip_mm = run.shapes.back().at(0).p_world_mm;

  EXPECT_LT(first_tip_mm.z(), -60) << "below the arch";
  EXPECT_LT((last_tip_mm - vessel.route.back().p_world_mm).norm(), 35);
  EXPECT_TRUE(vessel.wall.contains(last_tip_mm));
}

INSTANTIATE_TEST_SUITE_P(Patients, PaperRun, ::testing::Values(0, 1));

TEST(Catheterisation, IsTheSameToTheLastBitForTheSameSeedAndAnotherForAnother) {
  const Catheterisation one = paper_run(2, 120);
  EXPECT_EQ(one.shapes.back().nodes_world_mm(), paper_run(2, 120).shapes.back().nodes_world_mm());
  EXPECT_GT((one.shapes.back().at(0).p_world_mm - paper_run(3, 120).shapes.back().at(0).p_world_mm).norm(),
            1);
}

}  // namespace
}  // namespace tubed
