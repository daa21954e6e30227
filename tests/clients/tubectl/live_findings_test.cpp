#include "clients/tubectl/check/live_findings.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>

#include "TubeEstimate.h"

namespace tubed {
namespace {

using Found = RecordingFinding::Verdict;

/// A straight catheter along x, tip at its larger end, coils 50 mm apart.
tubed_EmSamples straight_coils() {
  tubed_EmSamples samples{};
  samples.coil_count = 3;
  for (std::size_t i = 0; i < 3; ++i) {
    samples.coils[i].status = 1;
    samples.coils[i].p_em_mm[0] = -50.0 * static_cast<double>(i);
    samples.coils[i].tangent_em[0] = 1;
  }
  return samples;
}

tubed_TubeIdentity identity() {
  tubed_TubeIdentity identity{};
  std::strcpy(identity.instrument_id, "cath-1");
  std::strcpy(identity.mode, "filter");
  identity.coil_count = 3;
  for (std::size_t i = 0; i < 3; ++i) {
    identity.coil_offsets_from_tip_mm[i] = 10 + 50 * static_cast<float>(i);
  }
  identity.camera_count = 1;
  std::strcpy(identity.cameras[0].name, "lateral");
  return identity;
}

tubed_TubeStatus status_with(std::uint32_t reasons) {
  tubed_TubeStatus status{};
  status.validity = 1;
  status.reasons = reasons;
  return status;
}

tubed_TubeHealth compared() {
  tubed_TubeHealth health{};
  health.agreement.probability = 0.9F;
  health.agreement.as_stated = 0.95F;
  return health;
}

/// Some seconds of a room.
LiveFindings seconds_of(int seconds, const tubed_TubeStatus& status, const tubed_TubeHealth& health,
                        const tubed_EmSamples& coils = straight_coils()) {
  LiveFindings live;
  live.take(identity());
  for (int i = 0; i < seconds; ++i) {
    for (int k = 0; k < 30; ++k) live.take(coils);
    live.take(status);
    live.take(health);
  }
  return live;
}

const RecordingFinding& finding(const std::vector<RecordingFinding>& findings, const std::string& what) {
  const auto found = std::find_if(findings.begin(), findings.end(),
                                  [&](const RecordingFinding& each) { return each.what == what; });
  static const RecordingFinding none{"none", Found::kNotJudged, "there is no such finding", ""};
  return found == findings.end() ? none : *found;
}

TEST(LiveFindings, ARoomThatIsAsDescribedIsFine) {
  const auto findings = seconds_of(5, status_with(0), compared()).findings();
  EXPECT_EQ(findings.size(), 10U);
  for (const RecordingFinding& each : findings) {
    EXPECT_EQ(each.verdict, Found::kFine) << each.what << ": " << each.evidence;
    EXPECT_EQ(each.advice, "") << each.what;
  }
}

TEST(LiveFindings, WhatExplainsADisagreementIsWrongAndHidesTheRest) {
  tubed_TubeHealth health = compared();
  health.agreement.disagree = true;
  health.agreement.explanation = 4;
  health.agreement.magnification = -0.06F;
  const auto findings = seconds_of(5, status_with(0), health).findings();
  const RecordingFinding& focal = finding(findings, "focal length");
  EXPECT_EQ(focal.verdict, Found::kWrong) << focal.evidence;
  EXPECT_NE(focal.advice.find("camera lateral looks about 6 % too small"), std::string::npos) << focal.advice;
  for (const char* const hidden : {"registration", "arc lengths", "clock", "coils and field"}) {
    EXPECT_EQ(finding(findings, hidden).verdict, Found::kNotJudged) << hidden;
  }
}

TEST(LiveFindings, ImagesThatAreReadInAWrongWayAreNamed) {
  tubed_TubeHealth health = compared();
  health.agreement.disagree = true;
  health.agreement.explanation = 8;
  const auto negative = seconds_of(5, status_with(0), health).findings();
  EXPECT_EQ(finding(negative, "polarity").verdict, Found::kWrong);
  EXPECT_NE(finding(negative, "polarity").advice.find("images of camera lateral"), std::string::npos);
  EXPECT_EQ(finding(negative, "registration").verdict, Found::kNotJudged);
  EXPECT_EQ(finding(negative, "mirrored images").what, "none");
  health.agreement.explanation = 9;
  const auto mirrored = seconds_of(5, status_with(0), health).findings();
  EXPECT_EQ(finding(mirrored, "mirrored images").verdict, Found::kWrong);
  EXPECT_EQ(finding(mirrored, "polarity").what, "none");
}

TEST(LiveFindings, ATubeThatImagesDoNotShowIsWrong) {
  const auto findings = seconds_of(5, status_with(tubed_REASON_IMAGE_LOST_TUBE), {}).findings();
  EXPECT_EQ(finding(findings, "tube in images").verdict, Found::kWrong);
  const RecordingFinding& both = finding(findings, "coils and images");
  EXPECT_EQ(both.verdict, Found::kNotJudged);
  EXPECT_NE(both.evidence.find("no image has shown the tube"), std::string::npos) << both.evidence;
}

TEST(LiveFindings, WithoutFluoroscopyNothingIsSaidOfImages) {
  const auto findings = seconds_of(5, status_with(tubed_REASON_IMAGE_OFF), {}).findings();
  EXPECT_EQ(finding(findings, "tube in images").verdict, Found::kNotJudged);
  EXPECT_NE(finding(findings, "tube in images").advice.find("fluoroscopy on"), std::string::npos);
  EXPECT_EQ(finding(findings, "coil directions").verdict, Found::kFine);
}

TEST(LiveFindings, WhatWasSeenBeforeIsNoFindingOfARoomWithoutImages) {
  const auto findings = seconds_of(5, status_with(tubed_REASON_IMAGE_OFF), compared()).findings();
  for (const char* const of_images : {"registration", "arc lengths", "clock", "focal length", "view"}) {
    EXPECT_EQ(finding(findings, of_images).verdict, Found::kNotJudged) << of_images;
  }
}

TEST(LiveFindings, ARoomWithoutShapesIsNotFine) {
  tubed_TubeStatus stale = status_with(tubed_REASON_EM_STALE);
  stale.validity = 3;
  const auto findings = seconds_of(5, stale, {}).findings();
  EXPECT_EQ(finding(findings, "shapes").verdict, Found::kWrong);
  EXPECT_NE(finding(findings, "shapes").evidence.find("EM_STALE"), std::string::npos);
}

TEST(LiveFindings, ARivalIsTold) {
  const auto findings = seconds_of(5, status_with(tubed_REASON_RIVAL_WRITER), compared()).findings();
  EXPECT_EQ(finding(findings, "shapes").verdict, Found::kWrong);
  EXPECT_NE(finding(findings, "shapes").advice.find("doctor"), std::string::npos);
}

TEST(LiveFindings, AModeThatDoesNotCompareIsNamed) {
  LiveFindings live = seconds_of(5, status_with(0), {});
  tubed_TubeIdentity joint = identity();
  std::strcpy(joint.mode, "joint");
  live.take(joint);
  const auto findings = live.findings();
  const RecordingFinding& both = finding(findings, "coils and images");
  EXPECT_EQ(both.verdict, Found::kNotJudged);
  EXPECT_NE(both.evidence.find("mode joint"), std::string::npos) << both.evidence;
}

TEST(LiveFindings, ACoilThatPointsBackwardIsNamed) {
  tubed_EmSamples coils = straight_coils();
  coils.coils[1].tangent_em[0] = -1;
  const auto findings = seconds_of(5, status_with(0), compared(), coils).findings();
  EXPECT_EQ(finding(findings, "coil directions").verdict, Found::kWrong);
  EXPECT_NE(finding(findings, "coil directions").evidence.find("coil 2"), std::string::npos);
}

TEST(LiveFindings, CoilsFurtherApartThanAlongTheTubeAreTold) {
  tubed_EmSamples coils = straight_coils();
  coils.coils[2].p_em_mm[0] = -110;
  const auto findings = seconds_of(5, status_with(0), compared(), coils).findings();
  EXPECT_EQ(finding(findings, "coil distances").verdict, Found::kWrong);
}

TEST(LiveFindings, AViewThatMovedIsTold) {
  const auto findings = seconds_of(5, status_with(tubed_REASON_GEOMETRY_CHANGED), compared()).findings();
  EXPECT_EQ(finding(findings, "view").verdict, Found::kWrong);
}

TEST(LiveFindings, ADaemonThatHasNotSaidWhoItIsIsNotJudgedByItsCoils) {
  LiveFindings live;
  live.take(straight_coils());
  live.take(compared());
  EXPECT_EQ(finding(live.findings(), "coil directions").verdict, Found::kNotJudged);
}

}  // namespace
}  // namespace tubed
