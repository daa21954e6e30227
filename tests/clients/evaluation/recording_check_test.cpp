#include "clients/evaluation/recording_check.hpp"

#include <gtest/gtest.h>

#include <random>

#include "tests/daemon/estimator/simulated_tube.hpp"

namespace tubed {
namespace {

using Verdict = RecordingFinding::Verdict;

/// Five coils on the arc, `count` measurements with noise of 1 mm.
Sequence measured_arc(int count = 100) {
  Sequence sequence;
  sequence.room = one_view_room();
  for (int i = 0; i < count; ++i) {
    const EmFrame frame =
        measure_coils(sequence.room, from_ns(i * 25'000'000LL), 1, static_cast<unsigned>(i + 1));
    SequenceMeasurement measurement;
    measurement.t_s = i * 0.025;
    measurement.coil_count = frame.coil_count;
    measurement.coils = frame.coils;
    sequence.measurements.push_back(measurement);
  }
  return sequence;
}

std::vector<CoilPlacement>& coils_of(Sequence& sequence) { return sequence.room.instruments.front().coils; }

TEST(RecordingCheck, CoilsThatPointTowardTheTipAreFine) {
  const RecordingFinding finding = check_coil_directions(measured_arc());
  EXPECT_EQ(finding.verdict, Verdict::kFine);
  EXPECT_EQ(finding.evidence, "each of 5 coils points toward its neighbour nearer the tip");
  EXPECT_EQ(finding.advice, "");
}

TEST(RecordingCheck, ACoilThatIsMountedBackwardIsNamed) {
  Sequence sequence = measured_arc();
  for (SequenceMeasurement& measurement : sequence.measurements) {
    measurement.coils[3].tangent_em *= -1;
  }
  const RecordingFinding finding = check_coil_directions(sequence);
  EXPECT_EQ(finding.verdict, Verdict::kWrong);
  EXPECT_EQ(finding.evidence, "coil 4 (sensor 4) points away from the tip");
  EXPECT_NE(finding.advice.find("flipped = true"), std::string::npos);
  coils_of(sequence)[3].flipped = true;
  EXPECT_EQ(check_coil_directions(sequence).verdict, Verdict::kFine);
}

TEST(RecordingCheck, AnOrderThatIsTheWrongWayRoundIsNamed) {
  Sequence sequence = measured_arc();
  std::reverse(coils_of(sequence).begin(), coils_of(sequence).end());
  const RecordingFinding finding = check_coil_directions(sequence);
  EXPECT_EQ(finding.verdict, Verdict::kWrong);
  EXPECT_EQ(finding.evidence, "all 5 coils point away from the tip");
  EXPECT_NE(finding.advice.find("order"), std::string::npos);
}

TEST(RecordingCheck, CoilsFurtherApartThanAlongTheTubeAreNamed) {
  Sequence sequence = measured_arc();
  EXPECT_EQ(check_coil_distances(sequence).verdict, Verdict::kFine);
  coils_of(sequence)[2].offset_from_tip_mm -= 15;
  const RecordingFinding finding = check_coil_distances(sequence);
  EXPECT_EQ(finding.verdict, Verdict::kWrong);
  EXPECT_EQ(finding.evidence.rfind("coils 2 and 3 lie ", 0), 0U) << finding.evidence;
  EXPECT_NE(finding.evidence.find("65.0 mm along the tube"), std::string::npos) << finding.evidence;
}

TEST(RecordingCheck, TooFewMeasurementsAreNotJudged) {
  const Sequence sequence = measured_arc(5);
  EXPECT_EQ(check_coil_directions(sequence).verdict, Verdict::kNotJudged);
  EXPECT_EQ(check_coil_distances(sequence).verdict, Verdict::kNotJudged);
}

TEST(RecordingCheck, WithoutImagesTheCoilsAreJudgedAlone) {
  const auto findings =
      check_recording({measured_arc(), {}, {}, std::chrono::milliseconds(500)}, [](const std::string&) {});
  ASSERT_EQ(findings.size(), 3U);
  EXPECT_EQ(findings[0].verdict, Verdict::kFine);
  EXPECT_EQ(findings[2].verdict, Verdict::kNotJudged);
}

}  // namespace
}  // namespace tubed
