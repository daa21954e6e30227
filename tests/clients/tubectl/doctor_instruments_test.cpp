#include "clients/tubectl/check/doctor_instruments.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace tubed {
namespace {

Configuration room_with(const std::vector<double>& coils_mm, int cameras = 1) {
  Configuration configuration;
  RoomDescription& room = configuration.room;
  InstrumentDescription instrument;
  instrument.rest_shape = RestShape::kStraight;
  instrument.id = "cath-1";
  instrument.length_mm = 380;
  for (const double s_mm : coils_mm) {
    instrument.coils.push_back({static_cast<int>(instrument.coils.size()) + 1, s_mm, false});
  }
  room.instruments = {instrument};
  room.cameras.resize(static_cast<std::size_t>(cameras));
  configuration.estimators.resize(1);
  return configuration;
}

Finding finding_of(const Configuration& configuration) {
  const std::vector<NamedFinding> findings = examine_instruments(configuration);
  EXPECT_EQ(findings.size(), 1U);
  EXPECT_EQ(findings.front().name, "coils of cath-1");
  return findings.front().finding;
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(DoctorInstruments, CoilsSixtyMillimetresApartHoldEverything) {
  const Finding finding = finding_of(room_with({20, 80, 140, 200, 260, 320, 360}));
  EXPECT_EQ(finding.verdict, Verdict::kGood) << finding.found;
}

// The paper's catheter: 8, 94, 174 and 274 mm.
TEST(DoctorInstruments, StretchesBetweenCoilsAndBehindTheLastOneAreNamed) {
  const Finding finding = finding_of(room_with({8, 94, 174, 274}));
  EXPECT_TRUE(contains(finding.found, "38 to 64 mm, 124 to 144 mm, 204 to 244 mm, 304 to 380 mm"))
      << finding.found;
}

TEST(DoctorInstruments, WhereOnlyStretchesBetweenCoilsAreLongThatIsANote) {
  const Finding finding = finding_of(room_with({8, 94, 174, 274, 360}));
  EXPECT_EQ(finding.verdict, Verdict::kNote);
  EXPECT_TRUE(contains(finding.found, "out of view")) << finding.found;
}

TEST(DoctorInstruments, ALongPieceBeyondTheLastCoilIsAnAdvice) {
  const Finding finding = finding_of(room_with({8, 60, 110}));
  EXPECT_EQ(finding.verdict, Verdict::kAdvice);
  EXPECT_TRUE(contains(finding.found, "270 mm lie beyond the last coil: where no image shows them"))
      << finding.found;
  EXPECT_TRUE(contains(finding.found, "may be 260 mm off")) << "as far as it is long, but for 10 mm";
  EXPECT_TRUE(contains(finding.advice, "length_mm")) << finding.advice;
}

TEST(DoctorInstruments, WithoutACameraNothingElseHolds) {
  const Finding finding = finding_of(room_with({8, 94, 174, 274, 360}, 0));
  EXPECT_TRUE(contains(finding.found, "nothing holds the tube there")) << finding.found;
  EXPECT_FALSE(contains(finding.found, "view")) << finding.found;
}

TEST(DoctorInstruments, ATipFarFromItsFirstCoilIsWorthAnAdviceInOneView) {
  const Finding one = finding_of(room_with({45, 90, 140, 200, 260, 320, 360}));
  EXPECT_EQ(one.verdict, Verdict::kAdvice);
  EXPECT_TRUE(contains(one.advice, "within 30 mm of the tip")) << one.advice;
  EXPECT_EQ(finding_of(room_with({45, 90, 140, 200, 260, 320, 360}, 2)).verdict, Verdict::kNote);
}

TEST(DoctorInstruments, AHookWithoutACoilInItIsToldWhereToMountOne) {
  Configuration configuration = room_with({15, 60, 110, 160, 220, 280, 340, 375});
  configuration.room.instruments[0].rest_shape = RestShape::kHook;
  configuration.room.instruments[0].hook_radius_mm = 8;
  configuration.room.instruments[0].hook_length_mm = 14;
  const Finding blind = finding_of(configuration);
  EXPECT_EQ(blind.verdict, Verdict::kAdvice);
  EXPECT_TRUE(contains(blind.found, "AMBIGUOUS")) << blind.found;
  EXPECT_TRUE(contains(blind.advice, "9 mm from the tip or nearer")) << blind.advice;
  configuration.room.instruments[0].coils[0].offset_from_tip_mm = 9;
  EXPECT_EQ(finding_of(configuration).verdict, Verdict::kGood);
}

TEST(DoctorInstruments, AHookThatItsModeTakesForStraightIsAnAdvice) {
  Configuration configuration = room_with({9, 60, 110, 160, 220, 280, 340, 375});
  configuration.room.instruments[0].rest_shape = RestShape::kHook;
  configuration.room.instruments[0].hook_radius_mm = 8;
  configuration.room.instruments[0].hook_length_mm = 14;
  for (const EstimatorMode mode : {EstimatorMode::kEm, EstimatorMode::kPaper}) {
    configuration.estimators[0].mode = mode;
    const Finding finding = finding_of(configuration);
    EXPECT_EQ(finding.verdict, Verdict::kAdvice);
    EXPECT_TRUE(contains(finding.found, std::string(name_of(mode)) + "\" takes every tip for straight"))
        << finding.found;
    EXPECT_TRUE(contains(finding.advice, "filter")) << finding.advice;
  }
  configuration.estimators[0].mode = EstimatorMode::kFilter;
  EXPECT_EQ(finding_of(configuration).verdict, Verdict::kGood);
  configuration.room.cameras.clear();
  EXPECT_TRUE(contains(finding_of(configuration).advice, "configure a camera"));
}

TEST(DoctorInstruments, AHookThatIsTooShortForACoilIsNotToldToMountOneAtItsTip) {
  Configuration configuration = room_with({8, 60, 110, 160, 220, 280, 340, 375});
  configuration.room.instruments[0].rest_shape = RestShape::kHook;
  configuration.room.instruments[0].hook_radius_mm = 4;
  for (const double length_mm : {3.0, 5.0, 6.5}) {
    configuration.room.instruments[0].hook_length_mm = length_mm;
    const Finding finding = finding_of(configuration);
    EXPECT_EQ(finding.verdict, Verdict::kAdvice);
    EXPECT_FALSE(contains(finding.advice, "or nearer")) << finding.advice;
    EXPECT_TRUE(contains(finding.advice, "as near to the tip as the catheter allows")) << finding.advice;
    EXPECT_TRUE(contains(finding.advice, "TIP_NOT_SEEN or AMBIGUOUS")) << finding.advice;
  }
  configuration.room.instruments[0].hook_length_mm = 7.5;
  EXPECT_TRUE(contains(finding_of(configuration).advice, "2 mm from the tip or nearer"));
}

TEST(DoctorInstruments, ATipThatNobodyDescribedIsWorthANote) {
  for (const int cameras : {1, 2}) {
    Configuration configuration = room_with({15, 60, 110, 160, 220, 280, 340, 375}, cameras);
    configuration.room.instruments[0].rest_shape = RestShape::kUnknown;
    EXPECT_TRUE(contains(finding_of(configuration).advice, "say rest_shape")) << cameras;
    configuration.room.instruments[0].coils[0].offset_from_tip_mm = 10;
    EXPECT_EQ(finding_of(configuration).verdict, Verdict::kGood) << cameras;
  }
}

TEST(DoctorInstruments, ModeEmHasNoViewsToBeGiven) {
  Configuration configuration = room_with({45, 90, 140, 200, 260, 320, 360}, 2);
  configuration.estimators[0].mode = EstimatorMode::kEm;
  const Finding finding = finding_of(configuration);
  EXPECT_EQ(finding.verdict, Verdict::kAdvice);
  EXPECT_FALSE(contains(finding.found + finding.advice, "view")) << finding.found << finding.advice;
}

TEST(DoctorInstruments, EachInstrumentHasItsFinding) {
  Configuration configuration = room_with({8, 94});
  configuration.room.instruments.push_back(configuration.room.instruments[0]);
  configuration.room.instruments[1].id = "cath-2";
  configuration.estimators.resize(2);
  const std::vector<NamedFinding> findings = examine_instruments(configuration);
  ASSERT_EQ(findings.size(), 2U);
  EXPECT_EQ(findings[1].name, "coils of cath-2");
}

}  // namespace
}  // namespace tubed
