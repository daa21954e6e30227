#include "bench/geometry/study.hpp"

#include <gtest/gtest.h>

namespace tubed {
namespace {

/// Of images at 0, 1, 2, ... s.
MistakeRuns::Outcome outcome(const std::vector<Validity>& validities, double began_s = 0) {
  MistakeRuns::Outcome outcome;
  for (const Validity validity : validities) {
    Reasons reasons;
    if (validity != Validity::kValid) reasons.add(Reason::kImageLostTube);
    outcome.instants.push_back({static_cast<double>(outcome.instants.size()), true, validity, reasons});
  }
  outcome.began_s = began_s;
  return outcome;
}

constexpr auto V = Validity::kValid;
constexpr auto Q = Validity::kQuestionable;
constexpr auto I = Validity::kInvalid;

TEST(MistakeStudy, OnlyWhatIsNotSaidWithoutTheMistakeIsNews) {
  const Said said = said_of(outcome({Q, Q, V, V, I, Q}), outcome({Q, V, V, V, Q, V}));
  EXPECT_EQ(said.first_s, 1);
  EXPECT_EQ(said.instants, 2U);
  EXPECT_TRUE(said.first_reasons.has(Reason::kImageLostTube));
  EXPECT_EQ(said.reasons, (std::map<std::string, std::size_t>{{"IMAGE_LOST_TUBE", 2}}));
}

TEST(MistakeStudy, TimeCountsFromWhenTheMistakeBegan) {
  EXPECT_EQ(said_of(outcome({V, Q, V, V, V, Q}, 2), outcome({V, V, V, V, V, V})).first_s, 3);
  EXPECT_FALSE(said_of(outcome({V, Q, V}, 2), outcome({V, V, V})).first_s);
  EXPECT_FALSE(said_of(outcome({Validity::kNotAvailable}), outcome({V})).first_s)
      << "no shape is no wrong one";
}

TEST(MistakeStudy, MovesAreUnannouncedAndOtherWordsAreMistakesOfTheRoom) {
  EXPECT_EQ(run_with("pan=5", "field", 51).pan_mm, 5);
  EXPECT_FALSE(run_with("pan=5", "field", 51).announces_pose);
  EXPECT_EQ(run_with("turn=-15", "field", 51).turn_deg, -15);
  EXPECT_EQ(run_with("zoom=1.2", "field", 51).zoom, 1.2);
  EXPECT_EQ(run_with("focal=1.08", "field", 51).mistakes, std::vector<std::string>{"focal=1.08"});
  EXPECT_TRUE(run_with("none", "field", 51).mistakes.empty());
  EXPECT_THROW(run_with("pan=", "field", 51), std::invalid_argument);
  EXPECT_THROW(run_with("pan=5mm", "field", 51), std::invalid_argument);
  EXPECT_THROW(run_with("roll=5", "field", 51), std::invalid_argument);
}

TEST(MistakeStudy, TheTipsErrorIsThatOfTheFirstPointWhereTheShapeIsJudged) {
  TrueRun run;
  Estimates estimates;
  MethodEvaluation judged;
  for (std::uint32_t frame = 1; frame <= 3; ++frame) {
    Eigen::Matrix3Xd points_mm = Eigen::Matrix3Xd::Zero(3, 2);
    points_mm(2, 1) = 1;
    run.instants.push_back({frame, {{0, 1}, points_mm}});
    points_mm.colwise() += Eigen::Vector3d(3.0 * frame, 4.0 * frame, 0);
    estimates[frame].centreline = {{0, 1}, points_mm};
    judged.errors.push_back(frame == 2 ? std::nullopt : std::optional(ShapeError{}));
  }
  EXPECT_EQ(tip_errors_mm(run, estimates, judged), (std::vector<double>{5, 15}));
}

}  // namespace
}  // namespace tubed
