#include "daemon/estimator/agreement/coil_image_agreement.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <string>

#include "idl/geometry/degree.hpp"
#include "tests/daemon/estimator/agreement_bench.hpp"

namespace tubed {
namespace {

TEST(CoilImageAgreement, NothingIsSaidOfARoomThatIsAsStated) {
  int said = 0;
  for (unsigned seed = 1; seed <= 30; ++seed) {
    AgreementBench bench(one_view_room(), seed);
    std::mt19937 random(seed + 100);
    std::normal_distribution<double> normal;
    const Eigen::Vector3d shift_mm(normal(random), normal(random), normal(random));
    said += bench.watch(10, registered_wrong(shift_mm, 0.5 * kDegree * normal(random))).disagree() ? 1 : 0;
  }
  EXPECT_LE(said, 1);  // of 30; each of the others has odds of one in a hundred
}

TEST(CoilImageAgreement, AWrongRegistrationIsNamedWithinTwoSeconds) {
  AgreementBench bench;
  const CoilImageAgreement& agreement = bench.watch(4, registered_wrong({5, 3, 0}, -2 * kDegree));
  EXPECT_TRUE(agreement.disagree());
  EXPECT_EQ(agreement.verdict().explanation, Discord::kRegistration);
  EXPECT_LT(agreement.verdict().as_stated, 0.01);
  EXPECT_NEAR(agreement.verdict().turn_rad.z(), -2 * kDegree, 0.7 * kDegree);
  EXPECT_NE(bench.words().find("cath-1: coils and images disagree: all coils are off together, by about"),
            std::string::npos)
      << bench.words();
}

// What images in between bring is kept for the next verdict.
TEST(CoilImageAgreement, IsJudgedAfterATenthOfASecondAndAtOnceAfterItForgot) {
  AgreementBench bench;
  bench.rate_hz = 100;
  const CoilImageAgreement& agreement = bench.watch(0.01, as_it_is);
  const double first = agreement.verdict().as_stated;
  EXPECT_EQ(bench.watch(0.09, registered_wrong({8, 6, 0}, 0)).verdict().as_stated, first);
  EXPECT_NE(bench.watch(0.01, registered_wrong({8, 6, 0}, 0)).verdict().as_stated, first);
  bench.forget();
  EXPECT_NE(bench.watch(0.01, registered_wrong({8, 6, 0}, 0)).verdict().as_stated, 1);
}

TEST(CoilImageAgreement, CoilsInTheDarkAreNotComparedWithTheImage) {
  const Mistake off_from_the_third_on = [](const Eigen::Vector3d& p_mm, int coil, double) {
    return Eigen::Vector3d(p_mm + (coil > 1 ? 6 : 0) * Eigen::Vector3d::UnitX());
  };
  AgreementBench bright;
  AgreementBench dark;
  dark.dark_from_mm = 30;
  EXPECT_LT(bright.watch(1, off_from_the_third_on).verdict().as_stated, 0.3);
  EXPECT_GT(dark.watch(1, off_from_the_third_on).verdict().as_stated, 0.7);
}

TEST(CoilImageAgreement, TwoViewsSeeTheDepth) {
  AgreementBench bench(well_posed(two_views()));
  const CoilImageAgreement& agreement = bench.watch(5, registered_wrong({0, 0, 6}, 0));
  EXPECT_EQ(agreement.verdict().explanation, Discord::kRegistration);
  EXPECT_NEAR(agreement.verdict().shift_mm.z(), 6, 0.5);
  EXPECT_LT(bench.sigma_mm(200).maxCoeff(), 1);  // and hold the shape
}

TEST(CoilImageAgreement, ArcLengthsThatAreTooLargeAreNamed) {
  AgreementBench bench;
  bench.end_mm = -6;
  const CoilImageAgreement& agreement = bench.watch(3, as_it_is);
  EXPECT_TRUE(agreement.disagree());
  EXPECT_EQ(agreement.verdict().explanation, Discord::kArcLengths);
  EXPECT_NEAR(agreement.verdict().end_mm, -6, 0.7);
  EXPECT_NEAR(agreement.verdict().arc_length_mm, 6, 1.5);
  EXPECT_NE(bench.words().find("about 6 mm further back in the image"), std::string::npos) << bench.words();
}

TEST(CoilImageAgreement, AnEndThatAloneLiesElsewhereHasItsOwnProbability) {
  AgreementBench bench;
  bench.lasting_mm = 4;  // of coils along the tube, so that arc lengths explain nothing better
  bench.end_mm = 4;
  const EmImageAgreement summary = bench.watch(5, as_it_is).summary();
  EXPECT_TRUE(summary.disagree);
  EXPECT_EQ(summary.explanation, Discord::kArcLengths);
  EXPECT_GT(summary.probability, 0);
  EXPECT_LE(summary.probability, 1 - summary.as_stated + 1e-6F);
}

TEST(CoilImageAgreement, LateImagesAreNamedWhereTheTubeMoves) {
  AgreementBench bench;
  bench.motion_mm = [](double t_s) {
    return Eigen::Vector3d(12 * std::sin(1.5 * t_s), 12 * std::cos(1.1 * t_s), 0);
  };
  constexpr double kLate_s = 0.15;
  // The image of a stamp is older than the coils of that stamp.
  const Mistake mistake = [&bench](const Eigen::Vector3d& p_mm, int, double t_s) -> Eigen::Vector3d {
    return p_mm + bench.motion_mm(t_s + kLate_s) - bench.motion_mm(t_s);
  };
  const CoilImageAgreement& agreement = bench.watch(8, mistake);
  EXPECT_EQ(agreement.verdict().explanation, Discord::kClock);
  EXPECT_NEAR(agreement.verdict().clock_s, kLate_s, 0.04);
  EXPECT_NE(bench.words().find("too late"), std::string::npos) << bench.words();
}

// Over half a second its velocity is another one than now.
TEST(CoilImageAgreement, LateImagesAreNamedWhereTheTubeTurnsBackAllTheTime) {
  AgreementBench bench;
  constexpr double kTurns_rad_s = 2 * std::numbers::pi / 3.4;
  constexpr double kLate_s = 0.15;
  bench.motion_mm = [](double t_s) {
    const double way_mm = 12 * std::sin(kTurns_rad_s * t_s);
    return Eigen::Vector3d(way_mm, way_mm / 2, 0);
  };
  const Mistake mistake = [&bench](const Eigen::Vector3d& p_mm, int, double t_s) -> Eigen::Vector3d {
    return p_mm + bench.motion_mm(t_s + kLate_s) - bench.motion_mm(t_s);
  };
  const CoilImageAgreement& agreement = bench.watch(8, mistake);
  EXPECT_EQ(agreement.verdict().explanation, Discord::kClock) << bench.words();
  EXPECT_NEAR(agreement.verdict().clock_s, kLate_s, 0.04);
}

// The shape follows what the coils are off by, each time anew: its motion and their offset have one
// direction.
TEST(CoilImageAgreement, AShapeThatDriftsAfterItsCoilsSaysNothingOfTheClock) {
  AgreementBench bench;
  const Eigen::Vector3d way_mm(0.55, 0.45, 0);
  const auto since_jump = [](double t_s) { return std::fmod(t_s, 1.0) / 0.5; };
  bench.motion_mm = [=](double t_s) -> Eigen::Vector3d { return -std::exp(-since_jump(t_s)) * way_mm; };
  const auto jumps = [=](const Eigen::Vector3d& p_mm, int, double t_s) -> Eigen::Vector3d {
    return p_mm + std::exp(-since_jump(t_s)) * way_mm;
  };
  const CoilImageAgreement& agreement = bench.watch(12, jumps);
  EXPECT_FALSE(agreement.disagree()) << bench.words();
  EXPECT_GT(agreement.verdict().as_stated, 0.9);
}

TEST(CoilImageAgreement, AWrongFocalLengthIsNamed) {
  AgreementBench bench;
  bench.image_scale = 1 / 1.08;  // a focal length that is stated 8 % too large makes all of it smaller
  bench.shows_end = false;       // it is shorter than its arc length, which no shape of an estimator is
  const CoilImageAgreement& agreement = bench.watch(5, as_it_is);
  EXPECT_EQ(agreement.verdict().explanation, Discord::kMagnification);
  EXPECT_NEAR(agreement.verdict().magnification, 0.08, 0.02);
  EXPECT_NE(bench.words().find("camera A looks about"), std::string::npos) << bench.words();
}

TEST(CoilImageAgreement, OneCoilIsNamed) {
  AgreementBench bench;
  const CoilImageAgreement& agreement = bench.watch(5, [](const Eigen::Vector3d& p_mm, int coil, double) {
    return coil == 2 ? Eigen::Vector3d(p_mm + Eigen::Vector3d(6, 6, 0)) : p_mm;
  });
  EXPECT_EQ(agreement.verdict().explanation, Discord::kCoil);
  EXPECT_EQ(agreement.verdict().index, 2);
  EXPECT_NE(bench.words().find("coil 3 (sensor 3) is off by about"), std::string::npos) << bench.words();
}

TEST(CoilImageAgreement, CoilsThatAreOffEachInItsOwnWayAreAField) {
  AgreementBench bench;
  const CoilImageAgreement& agreement = bench.watch(5, [](const Eigen::Vector3d& p_mm, int coil, double) {
    const std::array<Eigen::Vector3d, 5> off_mm{Eigen::Vector3d(5, 4, 0), Eigen::Vector3d(-4, 5, 0),
                                                Eigen::Vector3d(4, -5, 0), Eigen::Vector3d(-5, -4, 0),
                                                Eigen::Vector3d(5, 5, 0)};
    return Eigen::Vector3d(p_mm + off_mm[static_cast<std::size_t>(coil)]);
  });
  EXPECT_EQ(agreement.verdict().explanation, Discord::kField);
  EXPECT_NE(bench.words().find("metal"), std::string::npos) << bench.words();
}

TEST(CoilImageAgreement, WhatIsMendedIsForgotten) {
  AgreementBench bench;
  EXPECT_TRUE(bench.watch(5, registered_wrong({6, 4, 0}, 0)).disagree());
  EXPECT_FALSE(bench.watch(6 * CoilImageEvidence::kMemory_s, as_it_is).disagree());
}

TEST(CoilImageAgreement, ALongMistakeIsForgottenAsSoonAsAShortOne) {
  AgreementBench bench;
  EXPECT_TRUE(bench.watch(10 * CoilImageEvidence::kMemory_s, registered_wrong({6, 4, 0}, 0)).disagree());
  EXPECT_FALSE(bench.watch(6 * CoilImageEvidence::kMemory_s, as_it_is).disagree());
}

TEST(CoilImageAgreement, TheWordIsTakenBackOnlyWhenItIsCertain) {
  AgreementBench bench;
  EXPECT_TRUE(bench.watch(5, registered_wrong({6, 4, 0}, 0)).disagree());
  const CoilImageAgreement* agreement = nullptr;
  double least_certain = 1;
  for (int i = 0; i < 400 && (agreement == nullptr || agreement->disagree()); ++i) {
    agreement = &bench.watch(0.1, as_it_is);
    if (agreement->verdict().as_stated > 0.5) {
      least_certain = std::min(least_certain, agreement->verdict().as_stated);
    }
  }
  EXPECT_FALSE(agreement->disagree());
  EXPECT_GE(agreement->verdict().as_stated, 0.8);
  EXPECT_LT(least_certain, 0.8) << "it went from wrong to certain at once: nothing was tested";
}

TEST(CoilImageAgreement, ACoilThatTheEstimatorLeavesOutIsEvidenceStill) {
  AgreementBench bench;
  bench.third = CoilState::kOutlier;
  const CoilImageAgreement& agreement = bench.watch(5, [](const Eigen::Vector3d& p_mm, int coil, double) {
    return coil == 2 ? Eigen::Vector3d(p_mm + Eigen::Vector3d(6, 6, 0)) : p_mm;
  });
  EXPECT_EQ(agreement.verdict().explanation, Discord::kCoil);
  EXPECT_EQ(agreement.verdict().index, 2);
}

Eigen::Vector3d third_is_off(const Eigen::Vector3d& p_mm, int coil, double /*t_s*/) {
  return coil == 2 ? Eigen::Vector3d(p_mm + Eigen::Vector3d(9, 9, 0)) : p_mm;
}

// As in a burst of wrong measurements that the tracker says are right.
TEST(CoilImageAgreement, ACoilThatComesBackIntoTheGateIsForgiven) {
  AgreementBench bench;
  bench.watch(0.3, as_it_is);
  bench.third = CoilState::kOutlier;
  EXPECT_TRUE(bench.watch(2, third_is_off).disagree());
  bench.third = CoilState::kUsed;
  EXPECT_FALSE(bench.watch(1, as_it_is).disagree());
}

// The gate believes the wrong coil, and leaves it out when it is right again.
TEST(CoilImageAgreement, WhatACoilSaidJustBeforeTheGateLeftItOutIsForgivenToo) {
  const auto [meanwhile, after] = disagree_in_and_after_a_burst(third_is_off);
  EXPECT_TRUE(meanwhile);
  EXPECT_FALSE(after);
}

TEST(CoilImageAgreement, ACoilThatStaysInTheGateIsNotForgiven) {
  AgreementBench bench;
  bench.watch(0.3, as_it_is);
  EXPECT_TRUE(bench.watch(2, third_is_off).disagree());
  EXPECT_TRUE(bench.watch(1, as_it_is).disagree());
}

TEST(CoilImageAgreement, WhatACoilSaidLongBeforeTheGateLeftItOutStays) {
  AgreementBench bench;
  EXPECT_TRUE(bench.watch(6, third_is_off).disagree());
  bench.third = CoilState::kOutlier;
  bench.watch(0.3, as_it_is);
  bench.third = CoilState::kUsed;
  EXPECT_TRUE(bench.watch(1, as_it_is).disagree());
}

TEST(CoilImageAgreement, AfterAResetNothingIsKnown) {
  AgreementBench bench;
  EXPECT_TRUE(bench.watch(5, registered_wrong({6, 4, 0}, 0)).disagree());
  const CoilImageAgreement& agreement = bench.forget();
  EXPECT_FALSE(agreement.disagree());
  EXPECT_EQ(agreement.verdict().explanation, Discord::kNone);
  EXPECT_EQ(bench.sigma_mm(100), AgreementBench().sigma_mm(100));
}

TEST(CoilImageAgreement, ItsSummaryIsEmptyUntilSomethingWasCompared) {
  AgreementBench bench;
  const CoilImageAgreement& agreement = bench.forget();
  EXPECT_EQ(agreement.summary().probability, 0);
  EXPECT_EQ(agreement.summary().as_stated, 0);
  bench.watch(4, registered_wrong({5, 3, 0}, -2 * kDegree));
  const EmImageAgreement summary = agreement.summary();
  EXPECT_TRUE(summary.disagree);
  EXPECT_EQ(summary.explanation, Discord::kRegistration);
  EXPECT_GT(summary.probability, 0.9F);
  EXPECT_LT(summary.as_stated, 0.01F);
  EXPECT_EQ(summary.shift_mm[0], static_cast<float>(agreement.verdict().shift_mm.x()));
  EXPECT_EQ(summary.turn_rad[2], static_cast<float>(agreement.verdict().turn_rad.z()));
  EXPECT_GT(summary.unsure_mm, 5) << "as far as it is seen to be off, at least";
}

TEST(CoilImageAgreement, APersonIsToldAlsoThatNothingHasToBeExplained) {
  const InstrumentDescription instrument = one_view_room().instruments.front();
  EXPECT_EQ(describe_agreement({}, instrument, {}), "coils and images were not compared yet");
  EmImageAgreement agreement{
      .probability = 0.8F, .as_stated = 0.93F, .shift_mm = {0, 0.6F, 0.8F}, .unsure_mm = 1.5F};
  EXPECT_EQ(describe_agreement(agreement, instrument, {}),
            "coils and images agree (as stated 93 %): seen off by 1.0 mm and 0.0 degrees together, may be by "
            "1.5 and 0.0; 0.0 mm along the tube, 0 ms");
  agreement.disagree = true;
  agreement.explanation = Discord::kCoilArcLength;
  agreement.index = 1;
  agreement.arc_length_mm = 7;
  agreement.as_stated = 0.02F;
  const std::string nearer = " lies about 7 mm nearer to the tip than its offset_from_tip_mm says";
  EXPECT_NE(describe_agreement(agreement, instrument, {})
                .find("coils and images disagree (as stated 2 %): coil 2 (sensor 2)" + nearer),
            std::string::npos);
  EXPECT_NE(explanation_of(agreement, InstrumentDescription{}, {}).find("coil 2" + nearer), std::string::npos)
      << "where nobody says which sensor that is";
}

TEST(CoilImageAgreement, WordsAreCutToTheirRoom) {
  const EmImageAgreement agreement{.explanation = Discord::kField};
  std::array<char, 20> text{};
  text.fill('x');
  write_disagreement(agreement, one_view_room().instruments.front(), {}, text);
  EXPECT_EQ(std::string(text.data()), "cath-1: coils and i");
}

}  // namespace
}  // namespace tubed
