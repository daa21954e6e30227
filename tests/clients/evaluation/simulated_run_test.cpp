#include "clients/evaluation/simulated_run.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>

#include "clients/evaluation/recording_check.hpp"

namespace tubed {
namespace {

namespace fs = std::filesystem;

SimulatedRun run_with(const std::vector<std::string>& mistakes) {
  return {.preset = "paper", .seed = 5, .every = 80, .mistakes = mistakes};
}

/// Written into a folder of its own and read again.
Sequence written(const SimulatedRun& run, const std::string& name) {
  const fs::path folder = fs::path(testing::TempDir()) / ("simulated-run-" + name);
  fs::remove_all(folder);
  write_simulated_run(run, scenario_of(run), folder);
  return read_sequence(folder);
}

TEST(SimulatedRun, MistakesThatLeaveThePicturesAloneAreMadeFromTheFolderWithoutThem) {
  const SimulatedRun run = run_with({"registration=6,2", "offset=2,5", "focal=1.25", "clock=150",
                                     "field-jump=4", "coil-order", "coil-direction"});
  ASSERT_FALSE(changes_pictures(run));
  const auto mechanics = shared_run_of(scenario_of(run));  // kept for all that follows
  const Sequence clean = written(run_with({}), "clean");
  const Sequence made = with_mistakes(clean, run, scenario_of(run));
  const Sequence mistaken = written(run, "mistaken");
  EXPECT_TRUE(made.room.T_world_em.isApprox(mistaken.room.T_world_em, 1e-14));
  EXPECT_EQ(made.room.cameras.front().fx, mistaken.room.cameras.front().fx);
  EXPECT_EQ(made.room.instruments.front().coils[1].offset_from_tip_mm, 95);
  ASSERT_EQ(made.frames.size(), mistaken.frames.size());
  for (std::size_t i = 0; i < made.frames.size(); ++i) {
    EXPECT_DOUBLE_EQ(made.frames[i].t_s, mistaken.frames[i].t_s);
    EXPECT_DOUBLE_EQ(made.frames[i].t_s, clean.frames[i].t_s + 0.15);
  }
  ASSERT_EQ(made.measurements.size(), mistaken.measurements.size());
  for (std::size_t i = 0; i < made.measurements.size(); ++i) {
    const auto& a = made.measurements[i].coils;
    const auto& b = mistaken.measurements[i].coils;
    for (std::size_t coil = 0; coil < 5; ++coil) {
      EXPECT_TRUE(a[coil].p_em_mm.isApprox(b[coil].p_em_mm, 1e-12)) << i << ' ' << coil;
    }
    EXPECT_GT((a[0].p_em_mm - clean.measurements[i].coils[0].p_em_mm).norm(), 1) << "in reverse order";
  }
  ASSERT_EQ(made.truth.size(), mistaken.truth.size());
  EXPECT_EQ(made.truth.back().points_world_mm, mistaken.truth.back().points_world_mm);
}

TEST(SimulatedRun, CoilsLieWhereTheyAreAskedFor) {
  SimulatedRun run = run_with({});
  run.coils_mm = {5, 45.5, 100};
  const Sequence sequence = written(run, "coils");
  const auto& coils = sequence.room.instruments.front().coils;
  ASSERT_EQ(coils.size(), 3U);
  EXPECT_EQ(coils[1].offset_from_tip_mm, 45.5);
  EXPECT_EQ(coils[2].sensor, 3);
  ASSERT_FALSE(sequence.measurements.empty());
  EXPECT_EQ(sequence.measurements.front().coil_count, 3);
}

TEST(SimulatedRun, CoilsThatCannotBeAreRefused) {
  for (const std::vector<double>& coils_mm :
       {std::vector<double>{50, 10}, {10, 10}, {-1, 20}, {10, 4000}, std::vector<double>(17, 1)}) {
    SimulatedRun run = run_with({});
    run.coils_mm = coils_mm;
    EXPECT_THROW((void)scenario_of(run), std::invalid_argument);
  }
}

TEST(SimulatedRun, ASecondViewOfAPresetWithOneIsRefusedWithThePresetsThatHaveTwo) {
  std::string two;
  for (const std::string& preset : preset_names()) {
    if (make_scenario(preset, 1).room.cameras.size() > 1) two += " " + preset;
  }
  ASSERT_FALSE(two.empty());
  try {
    (void)scenario_of({.preset = "paper", .second_view_every = 3});
    FAIL();
  } catch (const std::runtime_error& error) {
    const std::string words = error.what();
    EXPECT_NE(words.find("preset paper has one view; with two:" + two), std::string::npos) << words;
  }
}

TEST(SimulatedRun, AConsoleThatAveragesItsPicturesIsFoundInThem) {
  SimulatedRun run = run_with({"averaging=0.6"});
  run.every = 14;
  const std::vector<RecordingFinding> found = check_averaging(written(run, "averaging"));
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].what, "averaging");
  EXPECT_EQ(found[0].verdict, RecordingFinding::Verdict::kFine) << "it is undone";
  EXPECT_NEAR(std::stod(found[0].evidence), 60, 5) << found[0].evidence;
  run.mistakes.clear();
  Sequence clean = written(run, "not-averaging");
  EXPECT_TRUE(check_averaging(clean).empty());
}

TEST(SimulatedRun, AveragedPicturesThatAreKeptAreAMistake) {
  SimulatedRun run = run_with({"averaging=0.8"});
  run.every = 14;
  Sequence sequence = written(run, "averaging-kept");
  sequence.room.cameras.front().time_averaging = TimeAveraging::kKeep;
  const std::vector<RecordingFinding> found = check_averaging(sequence);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].verdict, RecordingFinding::Verdict::kWrong);
  EXPECT_NE(found[0].advice.find("time_averaging"), std::string::npos) << found[0].advice;
}

TEST(SimulatedRun, AConsoleThatAveragesLessWhereSomethingMovesIsFoundInItsPictures) {
  SimulatedRun run = run_with({"averaging=0.8,4"});
  run.every = 6;
  const std::vector<RecordingFinding> found = check_averaging(written(run, "averaging-gives-way"));
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].verdict, RecordingFinding::Verdict::kFine);
  EXPECT_NE(found[0].evidence.find("less where something moves"), std::string::npos) << found[0].evidence;
}

TEST(SimulatedRun, PicturesChangeWithWhatIsDoneToThemAndToTheView) {
  EXPECT_FALSE(changes_pictures(run_with({"registration=6,2", "focal=1.1", "clock=20"})));
  EXPECT_TRUE(changes_pictures(run_with({"polarity"})));
  EXPECT_TRUE(changes_pictures(run_with({"averaging=0.5"})));
  EXPECT_TRUE(changes_pictures({.pan_mm = 5}));
  EXPECT_TRUE(changes_pictures({.turn_deg = 15}));
}

TEST(SimulatedRun, TheTruthIsSeenAsTheCameraStoodAndNotAsItIsDescribed) {
  SimulatedRun run = run_with({"focal=1.25"});
  run.turn_deg = 15;
  run.announces_pose = false;
  const Scenario scenario = scenario_of(run);
  const auto mechanics = shared_run_of(scenario);
  const Sequence sequence = written(run, "turned");
  const TrueRun truth = true_run_of(run, scenario, sequence);
  EXPECT_NEAR(truth.cameras.front().calibration().fx, scenario.room.cameras.front().fx, 1e-9);
  EXPECT_NEAR(sequence.room.cameras.front().fx, 1.25 * scenario.room.cameras.front().fx, 1e-9);
  const auto turned_rad = [&](const TrueInstant& instant) {
    const Eigen::Matrix3d turn = instant.view->T_camera_world().linear() *
                                 scenario.room.cameras.front().T_camera_world.linear().transpose();
    return Eigen::AngleAxisd(turn).angle();
  };
  ASSERT_EQ(truth.instants.size(), 4U);
  EXPECT_NEAR(turned_rad(truth.instants.front()), 0, 1e-6);
  EXPECT_NEAR(turned_rad(truth.instants.back()), 15 * M_PI / 180, 1e-6);
}

TEST(SimulatedRun, AMoveIsUnseenWhereThatIsAsked) {
  SimulatedRun run = run_with({});
  run.every = 20;
  run.turn_deg = 60;
  const auto mechanics = shared_run_of(scenario_of(run));
  const auto without_fluoroscopy = [&run](const char* folder) {
    return std::ranges::count_if(written(run, folder).frames,
                                 [](const SequenceFrame& frame) { return !frame.fluoroscopy_on(); });
  };
  const auto usually = without_fluoroscopy("seen");
  run.moves_unseen = true;
  EXPECT_GT(without_fluoroscopy("unseen"), usually);
}

TEST(SimulatedRun, AMistakeThatCannotBeMadeIsRefusedBeforeAnythingRuns) {
  EXPECT_THROW(scenario_of(run_with({"offsets=-20"})), std::invalid_argument);
  EXPECT_THROW(scenario_of(run_with({"focus=2"})), std::invalid_argument);
}

}  // namespace
}  // namespace tubed
