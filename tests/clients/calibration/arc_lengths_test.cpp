#include "clients/calibration/arc_lengths.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "clients/calibration/coil_recording.hpp"
#include "drivers/replay/sequence_folder.hpp"

namespace tubed {
namespace {

using Vector3 = Eigen::Vector3d;

/// A catheter in the shape of a wave that is pushed through; three coils at 10, 90 and 170 mm from its tip,
/// no images.
class PushedCatheter {
 public:
  explicit PushedCatheter(double noise_mm = 0, int coils = 3) : noise_mm_(noise_mm), coils_(coils) {
    InstrumentDescription instrument;
    instrument.id = "cath-1";
    instrument.length_mm = 300;
    for (int k = 0; k < coils; ++k) instrument.coils.push_back({k + 1, 10.0 + 80 * k, false});
    run.sequence.room.instruments = {instrument};
  }

  void push_for(double seconds) {
    for (int i = 0; i < std::lround(40 * seconds); ++i) measure(i / 40.0);
  }

  /// Another arc length of a coil than the true one.
  void describe(std::size_t coil, double offset_from_tip_mm) {
    run.sequence.room.instruments.front().coils[coil].offset_from_tip_mm = offset_from_tip_mm;
  }

  ConfiguredSequence run;
  double radius_mm = 150;  ///< of the bend that it lies in

 private:
  void measure(double t_s) {
    SequenceMeasurement measurement;
    measurement.t_s = t_s;
    measurement.coil_count = coils_;
    const double pushed_mm = 60 * std::sin(t_s / 2);
    for (int k = 0; k < coils_; ++k) {
      CoilSample& sample = measurement.coils[static_cast<std::size_t>(k)];
      const double angle = (pushed_mm - 10 - 80 * k) / radius_mm;
      sample.status = CoilStatus::kOk;
      sample.p_em_mm = radius_mm * Vector3(std::sin(angle), -std::cos(angle), 0) + noise();
      sample.tangent_em = Vector3(std::cos(angle), std::sin(angle), 0);
    }
    run.sequence.measurements.push_back(measurement);
  }
  Vector3 noise() { return noise_mm_ * Vector3(normal_(random_), normal_(random_), normal_(random_)); }

  double noise_mm_;
  int coils_;
  std::mt19937 random_{1};
  std::normal_distribution<double> normal_;
};

TEST(CubicLength, OfAStraightLineIsItsLength) {
  EXPECT_NEAR(cubic_length_mm({0, 0, 0}, Vector3::UnitX(), {80, 0, 0}, Vector3::UnitX()), 80, 1e-9);
}

TEST(CubicLength, OfASixthOfACircleIsThatOfTheArc) {
  const double angle = M_PI / 3;
  const double found =
      cubic_length_mm({0, 0, 0}, Vector3::UnitX(), 100 * Vector3(std::sin(angle), 1 - std::cos(angle), 0),
                      {std::cos(angle), std::sin(angle), 0});
  EXPECT_NEAR(found, 100 * angle, 0.05);
}

TEST(ArcLengths, DistancesOfCoilsAreThoseAlongTheTube) {
  PushedCatheter catheter;
  catheter.describe(1, 84);
  catheter.push_for(30);
  const ArcLengths found = measure_arc_lengths(catheter.run, {});
  EXPECT_NEAR(found.pieces[0].found_mm, 80, 0.1);
  EXPECT_NEAR(found.pieces[1].found_mm, 80, 0.1);
  EXPECT_FALSE(found.coils[0].was_found) << "no image has shown the end";
  EXPECT_NEAR(found.coils[1].found_mm, 90, 0.1);
  EXPECT_NEAR(found.coils[2].found_mm, 170, 0.2);
  EXPECT_TRUE(found.pieces[0].is_changed) << "6 mm at a sigma of 0.7";
}

TEST(ArcLengths, NoiseIsAveragedAwayAndTheFieldIsNot) {
  PushedCatheter catheter(2.3);
  catheter.push_for(60);
  const ArcLengths found = measure_arc_lengths(catheter.run, {.field_mm = 0.5});
  for (const MeasuredPiece& piece : found.pieces) {
    EXPECT_NEAR(piece.found_mm, 80, 0.5);
    EXPECT_GT(piece.sigma_mm, 0.5);
    EXPECT_LT(piece.sigma_mm, 1);
    EXPECT_GT(piece.scatter_mm, 0.5);
  }
}

TEST(ArcLengths, WhatIsBentTooMuchIsNotMeasured) {
  PushedCatheter catheter;
  catheter.radius_mm = 60;  // 76 degrees between two coils
  catheter.push_for(30);
  try {
    measure_arc_lengths(catheter.run, {});
    FAIL() << "measured around a bend";
  } catch (const CalibrationError& error) {
    EXPECT_NE(std::string(error.what()).find("between coil 1 and coil 2"), std::string::npos) << error.what();
  }
}

TEST(ArcLengths, AMomentIsNotEnough) {
  PushedCatheter catheter;
  catheter.push_for(3);
  EXPECT_THROW(measure_arc_lengths(catheter.run, {}), CalibrationError);
}

TEST(ArcLengths, OneCoilHasNoDistance) {
  PushedCatheter catheter;
  catheter.run.sequence.room.instruments.front().coils.resize(1);
  EXPECT_THROW(measure_arc_lengths(catheter.run, {}), CalibrationError);
}

/// Half a millimetre of a field of 0.7 mm is chance: what a bent field adds to one piece is not handed on to
/// all coils behind it.
TEST(ArcLengths, WhatIsNoMoreThanChanceStaysAsStated) {
  PushedCatheter catheter;
  catheter.describe(1, 90.5);
  catheter.describe(2, 176.5);
  catheter.push_for(30);
  const ArcLengths found = measure_arc_lengths(catheter.run, {});
  EXPECT_FALSE(found.pieces[0].is_changed);
  EXPECT_NEAR(found.pieces[0].found_mm, 80, 0.1);
  EXPECT_TRUE(found.pieces[1].is_changed) << "86 mm stated, 80 measured";
  EXPECT_EQ(found.coils[1].found_mm, 90.5);
  EXPECT_NEAR(found.coils[2].found_mm, 170.5, 0.2);
  const ConfigurationFragment fragment = fragment_of(found, "cath-1");
  ASSERT_EQ(fragment.values.size(), 1U);
  EXPECT_EQ(fragment.values[0].path, "instrument[cath-1].coil[3].offset_from_tip_mm");
  EXPECT_NEAR(measure_arc_lengths(catheter.run, {.take_all = true}).coils[1].found_mm, 90, 0.1);
}

/// The third coil is described 6 mm too far from the tip, the fourth one not: it stays where it is, whatever
/// the two distances add up to.
TEST(ArcLengths, OfACoilThatAloneIsElsewhereTheOnesBehindItStay) {
  PushedCatheter catheter(1.0, 4);
  catheter.describe(2, 176);
  catheter.push_for(60);
  const ArcLengths found = measure_arc_lengths(catheter.run, {});
  EXPECT_TRUE(found.pieces[1].is_lone_coil && found.pieces[2].is_lone_coil);
  EXPECT_FALSE(found.pieces[0].is_lone_coil);
  EXPECT_NEAR(found.coils[2].found_mm, 170, 0.5);
  EXPECT_NEAR(found.coils[3].found_mm, 250, 1e-9);
  const ConfigurationFragment fragment = fragment_of(found, "cath-1");
  ASSERT_EQ(fragment.values.size(), 1U);
}

TEST(ArcLengths, NothingBeyondChanceOffersNothingAndSaysSo) {
  PushedCatheter catheter;
  catheter.push_for(30);
  const ConfigurationFragment fragment = fragment_of(measure_arc_lengths(catheter.run, {}), "cath-1");
  EXPECT_TRUE(fragment.values.empty());
  EXPECT_NE(fragment.remarks.back().find("as stated as far as this recording tells"), std::string::npos)
      << fragment.remarks.back();
}

TEST(ArcLengths, WithoutTheEndNoSigmaIsOffered) {
  PushedCatheter catheter;
  catheter.describe(1, 94);
  catheter.describe(2, 178);
  catheter.push_for(30);
  const ArcLengths found = measure_arc_lengths(catheter.run, {});
  const ConfigurationFragment fragment = fragment_of(found, "cath-1");
  for (const FoundValue& value : fragment.values) {
    EXPECT_EQ(value.path.find("offset_sigma_mm"), std::string::npos) << value.path;
  }
  EXPECT_EQ(fragment.values.size(), 2U) << "of the second and the third coil";
  EXPECT_NE(page_of(found, fragment).find("distances between coils alone"), std::string::npos);
}

TEST(ArcLengths, HowFarOneImageIsOffIsSaid) {
  PushedCatheter catheter;
  catheter.push_for(30);
  ArcLengths found = measure_arc_lengths(catheter.run, {});
  found.end = {10, 10.5, 1, 2.34, 120, 10};
  const std::string page = page_of(found, fragment_of(found, "cath-1"));
  EXPECT_NE(page.find("one measurement scatters by 2.3 mm"), std::string::npos);
}

}  // namespace
}  // namespace tubed
