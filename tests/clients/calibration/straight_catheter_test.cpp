#include "clients/calibration/straight_catheter.hpp"

#include <gtest/gtest.h>

#include "tests/clients/calibration/synthetic_coils.hpp"

namespace tubed {
namespace {

const std::vector<double> kStated{10, 90, 170, 270, 370};
const Eigen::Vector3d kTip_mm(10, -20, -150);

StraightTip touched_tip() {
  StraightTip tip;
  tip.p_em_mm = kTip_mm;
  tip.p_sigma_mm = 0.2;
  return tip;
}

/// What it is refused with.
std::string refusal(const std::vector<CoilRecording>& recordings, const StraightTip& tip = {}) {
  try {
    measure_straight(recordings, tip);
  } catch (const CalibrationError& error) {
    return error.what();
  }
  return "not refused";
}

TEST(StraightCatheter, WithATouchedTipArcLengthsAreFoundWithinAMillimetre) {
  const auto recording = straight_recording({12.5, 89, 171.5, 270, 366}, {0.5, 0, 0.01}, 1);
  const StraightCatheter found = measure_straight({recording}, touched_tip());
  const std::vector<double> truth{12.5, 89, 171.5, 270, 366};
  ASSERT_TRUE(found.has_tip);
  EXPECT_TRUE(found.mistakes.empty());
  for (std::size_t k = 0; k < truth.size(); ++k) {
    EXPECT_TRUE(found.coils[k].was_found);
    EXPECT_NEAR(found.coils[k].found_mm, truth[k], 0.3);
    EXPECT_DOUBLE_EQ(found.coils[k].stated_mm, kStated[k]);
  }
}

TEST(StraightCatheter, WithoutATipDistancesAreFoundAndTheFirstCoilStaysAsStated) {
  const auto recording = straight_recording({15, 95, 178, 275, 375}, {0.3, 0, 0.01}, 2);
  const StraightCatheter found = measure_straight({recording}, {});
  EXPECT_FALSE(found.has_tip);
  EXPECT_FALSE(found.coils[0].was_found);
  EXPECT_DOUBLE_EQ(found.coils[0].found_mm, 10);
  EXPECT_NEAR(found.coils[2].found_mm, 173, 0.3);
}

TEST(StraightCatheter, ATipMeasuredFromTheFirstCoilPlacesAllOfThem) {
  const auto recording = straight_recording({15, 95, 175, 275, 375}, {0.3, 0, 0.01}, 3);
  StraightTip tip;
  tip.beyond_coil_mm = 15;
  const StraightCatheter found = measure_straight({recording}, tip);
  EXPECT_TRUE(found.coils[0].was_found);
  EXPECT_DOUBLE_EQ(found.coils[0].sigma_mm, tip.beyond_sigma_mm);
  EXPECT_NEAR(found.coils[4].found_mm, 375, 0.3);
}

// A share of n draws has the standard deviation sqrt(p (1 - p) / n); 5 coils of one draw share the tip: n is
// the number of draws. Three of them below what a Gaussian has; sigma may be too large, by half at most.
TEST(StraightCatheter, SigmaCoversWhatTheFieldPutsIn) {
  Coverage coverage;
  double chi2 = 0;
  constexpr int kDraws = 300;
  for (unsigned seed = 0; seed < kDraws; ++seed) {
    Draw draw(seed + 5000);
    const auto recording = straight_recording(kStated, {0.4, 0.6, 0.01}, seed + 100, 60);
    StraightTip tip;
    tip.p_em_mm = kTip_mm + draw.normal3(0.3);
    tip.p_sigma_mm = 0.3;
    const StraightCatheter found = measure_straight({recording}, tip);
    for (std::size_t k = 0; k < kStated.size(); ++k) {
      coverage.add(found.coils[k].found_mm - kStated[k], found.coils[k].sigma_mm);
      chi2 += std::pow((found.coils[k].found_mm - kStated[k]) / found.coils[k].sigma_mm, 2);
    }
  }
  EXPECT_GT(coverage.share(1), 0.683 - 3 * std::sqrt(0.683 * 0.317 / kDraws));
  EXPECT_GT(coverage.share(2), 0.954 - 3 * std::sqrt(0.954 * 0.046 / kDraws));
  EXPECT_GT(coverage.share(3), 0.997 - 3 * std::sqrt(0.997 * 0.003 / kDraws));
  EXPECT_GT(chi2 / coverage.of, 0.44) << "sigma is more than 1.5 times too large";
}

TEST(StraightCatheter, AGrooveThatIsMovedAveragesTheFieldAway) {
  double one_square = 0;
  double four_square = 0;
  for (unsigned seed = 0; seed < 60; ++seed) {
    std::vector<CoilRecording> moved;
    for (unsigned i = 0; i < 4; ++i) {
      moved.push_back(straight_recording(kStated, {0.2, 0.8, 0.01}, 1000 + 4 * seed + i, 50));
    }
    const double stated = 360;
    const auto four = measure_straight(moved, {});
    const auto one = measure_straight({moved.front()}, {});
    four_square += std::pow(four.coils[4].found_mm - four.coils[0].found_mm - stated, 2);
    one_square += std::pow(one.coils[4].found_mm - one.coils[0].found_mm - stated, 2);
    EXPECT_LT(four.coils[4].sigma_mm, 1.6);
  }
  EXPECT_LT(four_square, 0.5 * one_square);
}

TEST(StraightCatheter, ABentCatheterIsRefusedByTheCoilThatLiesBesideTheLine) {
  auto recording = straight_recording(kStated, {0.2, 0, 0.01}, 4);
  for (SequenceMeasurement& measurement : recording.measurements) {
    measurement.coils[2].p_em_mm += 9 * Eigen::Vector3d(2, -1, 0).normalized();
  }
  EXPECT_NE(refusal({recording}).find("is not straight: coil 3 (sensor 3) lies"), std::string::npos)
      << refusal({recording});
}

TEST(StraightCatheter, ACatheterThatIsBentBetweenItsCoilsIsRefusedByTheirDirections) {
  auto recording = straight_recording(kStated, {0.2, 0, 0.01}, 5);
  for (SequenceMeasurement& measurement : recording.measurements) {
    for (std::size_t k = 0; k < 3; ++k) {
      measurement.coils[k].tangent_em =
          (measurement.coils[k].tangent_em + 0.2 * Eigen::Vector3d(2, -1, 0).normalized()).normalized();
    }
  }
  EXPECT_NE(refusal({recording}).find("bent between"), std::string::npos) << refusal({recording});
}

TEST(StraightCatheter, OneCoilThatSitsAskewIsToldAndNotRefused) {
  auto recording = straight_recording(kStated, {0.2, 0, 0.005}, 6);
  for (SequenceMeasurement& measurement : recording.measurements) {
    measurement.coils[1].tangent_em =
        (measurement.coils[1].tangent_em + 0.2 * Eigen::Vector3d(2, -1, 0).normalized()).normalized();
  }
  const StraightCatheter found = measure_straight({recording}, {});
  ASSERT_EQ(found.remarks.size(), 1U);
  EXPECT_EQ(found.remarks[0].rfind("coil 2 (sensor 2) points 11", 0), 0U) << found.remarks[0];
}

TEST(StraightCatheter, AReversedOrderIsToldFromTheDistances) {
  const auto recording = straight_recording({370, 290, 210, 110, 10}, {0.2, 0, 0.01}, 7);
  const StraightCatheter found = measure_straight({recording}, {});
  ASSERT_EQ(found.mistakes.size(), 1U);
  EXPECT_NE(found.mistakes[0].find("all coils point away"), std::string::npos) << found.mistakes[0];
  // 80, 80, 100, 100 mm from the other end.
  const auto unequal = straight_recording({370, 290, 210, 110, 10}, {0.2, 0, 0.01}, 7);
  auto stated = unequal;
  const std::vector<double> other{10, 110, 210, 290, 370};
  for (std::size_t k = 0; k < other.size(); ++k) {
    stated.instrument.coils[k].offset_from_tip_mm = other[k];
  }
  const StraightCatheter told = measure_straight({stated}, {});
  ASSERT_EQ(told.mistakes.size(), 1U);
  EXPECT_EQ(told.mistakes[0].rfind("the coils' order is reversed: sensor 5", 0), 0U) << told.mistakes[0];
}

TEST(StraightCatheter, ATouchedTipBeyondTheLastCoilMeansThatTheOrderIsReversed) {
  const auto recording = straight_recording({370, 290, 210, 110, 10}, {0.2, 0, 0.01}, 8);
  const StraightCatheter found = measure_straight({recording}, touched_tip());
  ASSERT_EQ(found.mistakes.size(), 1U);
  EXPECT_EQ(found.mistakes[0].rfind("the coils' order is reversed", 0), 0U) << found.mistakes[0];
}

TEST(StraightCatheter, ACoilMountedBackwardIsNamedWithTheKeyThatRepairsIt) {
  auto recording = straight_recording(kStated, {0.2, 0, 0.01}, 9);
  for (SequenceMeasurement& measurement : recording.measurements) {
    measurement.coils[3].tangent_em *= -1;
  }
  EXPECT_EQ(measure_straight({recording}, {}).mistakes,
            std::vector<std::string>{"coil 4 (sensor 4) points away from the tip: flipped = true there"});
  recording.instrument.coils[3].flipped = true;
  EXPECT_TRUE(measure_straight({recording}, {}).mistakes.empty());
}

TEST(StraightCatheter, TwoSensorsThatAreExchangedAreNamed) {
  const auto recording = straight_recording({10, 170, 90, 270, 370}, {0.2, 0, 0.01}, 10);
  const StraightCatheter found = measure_straight({recording}, {});
  ASSERT_EQ(found.mistakes.size(), 1U);
  EXPECT_EQ(found.mistakes[0].rfind("coil 2 (sensor 2) and coil 3 (sensor 3) lie in the other order", 0), 0U);
}

TEST(StraightCatheter, AMissingCoilIsToldAndStaysAsStated) {
  auto recording = straight_recording(kStated, {0.2, 0, 0.01}, 11);
  for (SequenceMeasurement& measurement : recording.measurements) {
    measurement.coils[1] = CoilSample{};
  }
  const StraightCatheter found = measure_straight({recording}, {});
  EXPECT_FALSE(found.coils[1].was_found);
  EXPECT_DOUBLE_EQ(found.coils[1].found_mm, 90);
  ASSERT_EQ(found.remarks.size(), 1U);
  EXPECT_EQ(found.remarks[0], "coil 2 (sensor 2) was not measured; its arc length stays as stated");
}

TEST(StraightCatheter, AMissingCoilBetweenOthersThatMoveIsToldByHowMuch) {
  auto recording = straight_recording({14, 94, 174, 274, 374}, {0.2, 0, 0.01}, 11);
  for (SequenceMeasurement& measurement : recording.measurements) {
    measurement.coils[1] = CoilSample{};
  }
  const StraightCatheter found = measure_straight({recording}, touched_tip());
  ASSERT_EQ(found.remarks.size(), 1U);
  EXPECT_NE(found.remarks[0].find("although the coils next to it move by +4"), std::string::npos)
      << found.remarks[0];
}

// In metres, or touched elsewhere: where it falls on the line says nothing.
TEST(StraightCatheter, ATipBesideTheLineIsRefused) {
  const auto recording = straight_recording(kStated, {0.5, 0, 0.01}, 14);
  StraightTip tip = touched_tip();
  EXPECT_EQ(refusal({recording}, tip), "not refused");
  for (const Eigen::Vector3d& wrong_mm :
       {Eigen::Vector3d(1e-3 * kTip_mm), Eigen::Vector3d(kTip_mm + Eigen::Vector3d(0, 20, 0))}) {
    tip.p_em_mm = wrong_mm;
    const std::string words = refusal({recording}, tip);
    EXPECT_NE(words.find("mm beside the line through the coils"), std::string::npos) << words;
    EXPECT_NE(words.find("give it in mm"), std::string::npos) << words;
  }
}

TEST(StraightCatheter, WithoutAnyCoilItSaysWhatToDo) {
  auto recording = straight_recording(kStated, {}, 12);
  for (SequenceMeasurement& measurement : recording.measurements) {
    measurement.coils.fill(CoilSample{});
  }
  EXPECT_NE(refusal({recording}).find("tubectl doctor --tracker"), std::string::npos);
}

TEST(StraightCatheter, ACatheterThatWasMovedMeanwhileIsRefused) {
  auto recording = straight_recording(kStated, {0.5, 0, 0.01}, 13);
  for (SequenceMeasurement& measurement : recording.measurements) {
    measurement.coils[4].p_em_mm += measurement.t_s > 1 ? Eigen::Vector3d(0, 0, 6) : Eigen::Vector3d::Zero();
  }
  EXPECT_NE(refusal({recording}).find("coil 5 (sensor 5) moved by"), std::string::npos)
      << refusal({recording});
}

TEST(StraightCatheter, TimeStampsThatStandStillAreRefused) {
  auto recording = straight_recording(kStated, {0.5, 0, 0.01}, 14);
  for (SequenceMeasurement& measurement : recording.measurements) {
    measurement.t_s = 3;
  }
  EXPECT_NE(refusal({recording}).find("time stamps stand still"), std::string::npos) << refusal({recording});
}

}  // namespace
}  // namespace tubed
