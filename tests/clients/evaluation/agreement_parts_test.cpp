// What a recording's check says of coils against images, part by part.
#include "clients/evaluation/agreement_parts.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "clients/evaluation/recording_check.hpp"
#include "idl/geometry/degree.hpp"

namespace tubed {
namespace {

using Verdict = RecordingFinding::Verdict;
constexpr double kSeldom = 0.05;

/// A recording of which each instant is added, seen along a direction in the x-z plane.
struct Recorded {
  void add(const EmImageAgreement& agreement, double direction_deg = 0) {
    estimate->agreement = agreement;
    estimate->view_count = 1;
    estimate->views[0].T_camera_world[8] = std::sin(direction_deg * kDegree);
    estimate->views[0].T_camera_world[10] = std::cos(direction_deg * kDegree);
    whole.add(*estimate);
  }
  [[nodiscard]] RecordingFinding of(const std::string& what) const {
    for (const RecordingFinding& finding : whole.findings(kSeldom)) {
      if (finding.what == what) return finding;
    }
    ADD_FAILURE() << "nothing is said of " << what;
    return {};
  }

  RecordedAgreement whole;
  std::unique_ptr<TubeEstimate> estimate = std::make_unique<TubeEstimate>();
};

EmImageAgreement agreeing(float shift_mm) {
  EmImageAgreement agreement;
  agreement.probability = agreement.as_stated = 0.97F;
  agreement.shift_mm = {shift_mm, 0, 0};
  agreement.arc_length_mm = -0.4F;
  return agreement;
}

EmImageAgreement disagreeing(Discord explanation) {
  EmImageAgreement agreement = agreeing(0);
  agreement.disagree = true;
  agreement.explanation = explanation;
  return agreement;
}

TEST(RecordedAgreement, FineCarriesTheMediansOfItsNumbers) {
  Recorded recorded;
  for (const float shift_mm : {9.0F, 0.5F, 0.8F, 0.1F, 1.2F}) recorded.add(agreeing(shift_mm));
  const RecordingFinding registration = recorded.of("registration");
  EXPECT_EQ(registration.verdict, Verdict::kFine);
  EXPECT_EQ(registration.evidence.rfind("seen 0.8 mm", 0), 0U) << registration.evidence;
  EXPECT_EQ(recorded.of("arc lengths").evidence.rfind("seen -0.4 mm", 0), 0U);
}

TEST(RecordedAgreement, WhatExplainsBestIsWrongAndHidesTheRest) {
  Recorded recorded;
  for (int i = 0; i < 8; ++i) recorded.add(agreeing(0));
  for (int i = 0; i < 2; ++i) recorded.add(disagreeing(Discord::kClock));
  const RecordingFinding clock = recorded.of("clock");
  EXPECT_EQ(clock.verdict, Verdict::kWrong);
  EXPECT_NE(clock.evidence.find("20 %"), std::string::npos) << clock.evidence;
  EXPECT_EQ(recorded.of("registration").verdict, Verdict::kNotJudged);
}

TEST(RecordedAgreement, OfTwoThatAreNamedTheOneThatIsNamedOftenerIsWrong) {
  Recorded recorded;
  for (int i = 0; i < 6; ++i) recorded.add(disagreeing(Discord::kRegistration));
  for (int i = 0; i < 3; ++i) recorded.add(disagreeing(Discord::kCoilArcLength));
  recorded.add(agreeing(0));
  EXPECT_EQ(recorded.of("registration").verdict, Verdict::kWrong);
  EXPECT_EQ(recorded.of("arc lengths").verdict, Verdict::kNotJudged);
  EXPECT_EQ(recorded.of("arc lengths").evidence.rfind("named in 30 %", 0), 0U);
}

TEST(RecordedAgreement, WhatIsNamedSeldomIsFine) {
  Recorded recorded;
  for (int i = 0; i < 99; ++i) recorded.add(agreeing(0));
  recorded.add(disagreeing(Discord::kClock));
  EXPECT_EQ(recorded.of("clock").verdict, Verdict::kFine);
}

TEST(RecordedAgreement, OneDirectionOfViewIsSaidToShowNoDepth) {
  Recorded recorded;
  recorded.add(agreeing(0), 0);
  recorded.add(agreeing(0), 5);
  EXPECT_NE(recorded.of("registration").advice.find("one direction"), std::string::npos);
  EXPECT_EQ(recorded.of("clock").advice, "");
  recorded.add(agreeing(0), 15);
  EXPECT_EQ(recorded.of("registration").advice, "");
}

TEST(RecordedAgreement, BeforeAnythingWasComparedNothingIsSaid) {
  Recorded recorded;
  recorded.add(EmImageAgreement{});
  EXPECT_TRUE(recorded.whole.findings(kSeldom).empty());
}

}  // namespace
}  // namespace tubed
