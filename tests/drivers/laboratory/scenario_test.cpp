#include "drivers/laboratory/scenario.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "drivers/interface/monotonic_clock.hpp"
#include "drivers/interface/read_until.hpp"
#include "drivers/laboratory/played_run.hpp"
#include "drivers/laboratory/simulated_tracker.hpp"
#include "idl/geometry/camera.hpp"
#include "tests/drivers/laboratory/simulated_room.hpp"

namespace tubed {
namespace {

TEST(Scenario, AnUnknownPresetIsRefusedWithTheNamesThereAre) {
  try {
    make_scenario("papper", 1);
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("'papper'; there are paper, field"), std::string::npos);
  }
}

TEST(Scenario, ThePaperIsWhatThePaperSays) {
  const Scenario paper = make_scenario("paper", 3);
  EXPECT_EQ(paper.commands.size(), 337U);
  EXPECT_EQ(paper.em.lambda_mm, 4);
  EXPECT_NEAR(paper.em.psi_rad * 180 / std::numbers::pi, 3, 1e-12);
  EXPECT_EQ(paper.room.cameras[0].fx, 2000);
  EXPECT_EQ(paper.room.T_world_em.matrix(), RigidTransform::Identity().matrix());
  EXPECT_EQ(paper.room.instruments[0].coils[4].offset_from_tip_mm, 370);
}

TEST(Scenario, TheClinicalRegistrationIsOffByAMillimetreAndATrackerHasAFrameOfItsOwn) {
  const Scenario clinical = make_scenario("clinical", 3);
  EXPECT_NEAR(clinical.registration_error.translation().norm(), 1, 1e-9);
  EXPECT_NEAR(Eigen::AngleAxisd(clinical.registration_error.linear()).angle() * 180 / std::numbers::pi, 0.3,
              1e-6);
  EXPECT_GT(clinical.room.T_world_em.translation().norm(), 100);
  const TimeSpan off = clinical.fluoroscopy_off.front();
  EXPECT_TRUE(clinical.fluoroscopy_on(off.from_s - 0.01));
  EXPECT_FALSE(clinical.fluoroscopy_on(off.from_s));
  EXPECT_TRUE(clinical.fluoroscopy_on(off.until_s));
}

TEST(Scenario, AHookIsAsAskedForAndItsRollIsTheSeeds) {
  const Hook usual = make_scenario("preshaped", 3).catheter.hook;
  EXPECT_EQ(usual.curve, RestCurve::hook(8, 14));
  EXPECT_NE(usual.roll_rad, make_scenario("preshaped", 4).catheter.hook.roll_rad);
  const Hook wider = with_hook(make_scenario("paper", 3), {16, 0}).catheter.hook;
  EXPECT_EQ(wider.curve, RestCurve::hook(16, 28));
  const Hook arcs = with_hook(make_scenario("paper", 3), {0, 0, {5, 0, 12, 8, 10, -20, 4, 0}}).catheter.hook;
  EXPECT_EQ(arcs.length_mm(), 27) << "a straight piece behind the arcs is not bent";
  EXPECT_EQ(arcs.roll_rad, usual.roll_rad);
  EXPECT_EQ(wider.roll_rad, usual.roll_rad);
  EXPECT_FALSE(with_hook(make_scenario("paper", 3), {}).catheter.hook.is_there());
}

TEST(Scenario, AHookThatCannotBeIsRefused) {
  const Scenario paper = make_scenario("paper", 3);
  for (const HookChoice& hook :
       {HookChoice{5, 0}, HookChoice{30, 46}, HookChoice{6, 20}, HookChoice{0, 14},
        HookChoice{0, 0, {10, 8, 5}}, HookChoice{0, 0, {10, 5}}, HookChoice{0, 0, {10, 0}},
        HookChoice{0, 0, {20, 10, 26, -30}}, HookChoice{0, 0, {0, 8, 10, 8}}}) {
    EXPECT_THROW(with_hook(paper, hook), std::invalid_argument) << hook.radius_mm << ' ' << hook.length_mm;
  }
}

TEST(Scenario, ATipIsAsStiffAsAskedForAgainstItsShaft) {
  const Scenario paper = make_scenario("paper", 3);
  const Scenario soft = with_tip_stiffness(paper, 0.2);
  EXPECT_DOUBLE_EQ(soft.catheter.tip_bending_stiffness_N_mm2, 0.2 * paper.catheter.bending_stiffness_N_mm2);
  EXPECT_EQ(soft.catheter.bending_stiffness_N_mm2, paper.catheter.bending_stiffness_N_mm2);
  EXPECT_EQ(with_tip_stiffness(paper, 0).catheter.tip_bending_stiffness_N_mm2,
            paper.catheter.tip_bending_stiffness_N_mm2);
  for (const double times : {-1.0, 0.01, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_THROW(with_tip_stiffness(paper, times), std::invalid_argument) << times;
  }
}

TEST(Scenario, InTheVesselAHookIsNearlyAsItsMakerBentIt) {
  Scenario scenario = make_scenario("preshaped", 5);
  scenario.commands.resize(150);
  const Catheterisation run = run_scenario(scenario);
  EXPECT_EQ(run.report().unfinished, 0);
  std::vector<double> turns_rad;
  for (const CatheterShape& shape : run.shapes) {
    turns_rad.push_back(std::acos(shape.at(0).tangent_world.dot(shape.at(14).tangent_world)));
  }
  std::sort(turns_rad.begin(), turns_rad.end());
  const double rest_rad = (14 - 1.5625) / 8;
  EXPECT_NEAR(turns_rad[turns_rad.size() / 2], rest_rad, 0.2 * rest_rad);
  EXPECT_GT(turns_rad.front(), 0.5 * rest_rad);
  EXPECT_LT(turns_rad.back(), 1.5 * rest_rad);
}

/// One run of the mechanics for all tests below: its truth and its tracker are played live.
class PlayedPreset : public ::testing::Test {
 protected:
  static constexpr std::int64_t kSeed = 5;
  static void SetUpTestSuite() { run_ = shared_run_of(make_scenario("clinical", kSeed)); }
  static void TearDownTestSuite() { run_.reset(); }

  static DriverSettings settings() {
    return default_settings().with("preset", std::string("clinical")).with("seed", kSeed);
  }

  static inline std::shared_ptr<const Catheterisation> run_;
  RoomDescription room_ = make_scenario("clinical", kSeed).room;
};

TEST_F(PlayedPreset, StepsAreShapesAndTheWayBackIsTheWayIn) {
  const PlayedRun played(run_, 10);
  const double end_s = played.duration_s();
  EXPECT_NEAR(end_s, 39.7, 1e-9);
  EXPECT_LT((played.at(3.0, 50).p_world_mm - run_->shapes[30].at(50).p_world_mm).norm(), 1e-9);
  EXPECT_LT((played.at(end_s + 2.3, 70).p_world_mm - played.at(end_s - 2.3, 70).p_world_mm).norm(), 1e-6);
  EXPECT_LT((played.at(2 * end_s + 1.7, 70).p_world_mm - played.at(1.7, 70).p_world_mm).norm(), 1e-6);
}

TEST_F(PlayedPreset, BetweenStepsTheCatheterKeepsItsLength) {
  const PlayedRun played(run_, 10);
  for (double t_s = 0.05; t_s < played.duration_s(); t_s += 0.1) {
    double length_mm = 0;
    for (double s_mm = 0; s_mm < 380; s_mm += 2) {
      length_mm += (played.at(t_s, s_mm + 2).p_world_mm - played.at(t_s, s_mm).p_world_mm).norm();
    }
    ASSERT_NEAR(length_mm, 380, 0.38) << t_s;
  }
}

TEST_F(PlayedPreset, ItsArchIsInTheImage) {
  const Camera camera(room_.cameras[0]);
  for (const std::size_t step : {100U, 250U, 390U}) {
    const auto tip = camera.project(run_->shapes[step].at(0).p_world_mm);
    ASSERT_TRUE(tip.has_value());
    EXPECT_TRUE(camera.contains(tip->p_image_px, 10)) << step << ": " << tip->p_image_px.transpose();
  }
}

TEST_F(PlayedPreset, AStuckCoilRepeatsItsLastSampleAndTheOthersGoOn) {
  const Scenario scenario = make_scenario("clinical", kSeed);
  const auto stuck = std::find_if(scenario.em.events.begin(), scenario.em.events.end(),
                                  [](const EmEvent& event) { return event.kind == EmEventKind::kStuck; });
  const SimulatedWorld world(room_, settings());
  const SimulatedTracker tracker(world, settings(), 0.025);
  const auto sample = [&](int sensor, std::int64_t k) {
    const CoilPlacement& coil = room_.instruments[0].coils[static_cast<std::size_t>(sensor - 1)];
    return tracker.measure(world, 0, coil, k, 0.025 * static_cast<double>(k));
  };
  const auto first = static_cast<std::int64_t>(std::ceil(stuck->from_s / 0.025));
  EXPECT_EQ(sample(stuck->sensor, first).p_em_mm, sample(stuck->sensor, first - 1).p_em_mm);
  EXPECT_EQ(sample(stuck->sensor, first + 20).p_em_mm, sample(stuck->sensor, first - 1).p_em_mm);
  const int other = stuck->sensor % 5 + 1;
  EXPECT_NE(sample(other, first + 20).p_em_mm, sample(other, first - 1).p_em_mm);
}

TEST_F(PlayedPreset, TheLiveTrackerMeasuresIt) {
  const SimulatedWorld world(room_, settings());
  const auto source = make_simulation_em_source(room_, settings());
  ASSERT_TRUE(source->open().ok);
  EmFrame em;
  ASSERT_EQ(read_until(*source, em, monotonic_now() + std::chrono::seconds(30)), ReadOutcome::kFrame);
  // Warp 3 mm, registration 1 mm + 0.3 deg, jitter: wrong by millimetres, not by centimetres.
  int near = 0;
  for (const CoilPlacement& coil : room_.instruments[0].coils) {
    const Eigen::Vector3d truth_mm = world.point(0, world.seconds(em.measured), coil.offset_from_tip_mm);
    near +=
        (room_.T_world_em * em.coils[static_cast<std::size_t>(coil.sensor - 1)].p_em_mm - truth_mm).norm() <
                12
            ? 1
            : 0;
  }
  EXPECT_GE(near, 4);
}

}  // namespace
}  // namespace tubed
