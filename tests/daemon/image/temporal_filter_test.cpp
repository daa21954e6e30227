#include "daemon/image/temporal_filter.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "daemon/image/image_checks.hpp"
#include "tests/daemon/image/console_images.hpp"

namespace tubed {
namespace {

const MotionGhosts& no_ghosts() {
  static const MotionGhosts none(kConsoleWidth, kConsoleHeight, 1);
  return none;
}

/// Of a console's first images, in an even rhythm.
double found_of_before(double share, double noise = 8, int bands = 1) {
  Detector detector(noise, bands);
  RecursiveConsole console(share);
  TemporalFilterFinder finder(kConsoleWidth, kConsoleHeight);
  for (int k = 0; k < kEnough; ++k) {
    finder.look_at(console.show(detector.expose()), at_s(k / 15.0), kRounded);
  }
  return finder.filter().of_before();
}

TEST(TemporalFilterFinder, ConsolesThatShowTheirImagesAsTheyAreHaveNone) {
  EXPECT_EQ(found_of_before(0), 0);
  EXPECT_EQ(found_of_before(0, 2), 0);
  EXPECT_EQ(found_of_before(0, 8, 3), 0) << "most of the picture moves";
}

TEST(TemporalFilterFinder, TheShareIsFoundByTheNoise) {
  for (const double share : {0.2, 0.35, 0.5, 0.7, 0.8}) {
    EXPECT_NEAR(found_of_before(share), share, 0.05);
  }
}

TEST(TemporalFilterFinder, NeitherLittleNoiseNorWhatMovesMisleadsIt) {
  EXPECT_NEAR(found_of_before(0.5, 3), 0.5, 0.06) << "what moves is the clearer for it";
  EXPECT_NEAR(found_of_before(0.7, 3, 0), 0.7, 0.03) << "a sixth of the changes are of rounding";
  EXPECT_NEAR(found_of_before(0.7, 8, 3), 0.7, 0.06);
}

TEST(TemporalFilterFinder, WhereThereIsNoNoiseNothingIsSaid) { EXPECT_EQ(found_of_before(0.7, 0), 0); }

// Its correlations are those of no recursive filter: D has nothing in common with the one before, and -0.5
// with that of two before.
TEST(TemporalFilterFinder, AMovingAverageIsNone) {
  Detector detector;
  TemporalFilterFinder finder(kConsoleWidth, kConsoleHeight);
  ConsolePicture before = detector.expose();
  for (int k = 0; k < kEnough; ++k) {
    ConsolePicture seen = detector.expose();
    ConsolePicture shown(seen.size());
    for (std::size_t i = 0; i < seen.size(); ++i) shown[i] = std::round((seen[i] + before[i]) / 2);
    before = std::move(seen);
    finder.look_at(shown, at_s(k / 15.0), kRounded);
    EXPECT_EQ(finder.filter().share, 0);
  }
}

TEST(TemporalFilterFinder, NoneAreImagesThatAGrabberTakesTwiceWithNoiseOfItsOwn) {
  Detector detector;
  std::mt19937 random(9);
  std::normal_distribution<float> noise(0, 2);
  TemporalFilterFinder finder(kConsoleWidth, kConsoleHeight);
  ConsolePicture seen;
  for (int k = 0; k < 2 * kEnough; ++k) {
    seen = k % 2 == 0 ? detector.expose() : seen;
    ConsolePicture shown(seen.size());
    for (std::size_t i = 0; i < seen.size(); ++i) shown[i] = std::round(seen[i] + noise(random));
    finder.look_at(shown, at_s(k / 30.0), kRounded);
    EXPECT_EQ(finder.filter().share, 0);
  }
}

TEST(TemporalFilterFinder, AFilterThatIsTurnedOffIsForgotten) {
  Detector detector;
  RecursiveConsole console(0.6);
  TemporalFilterFinder finder(kConsoleWidth, kConsoleHeight);
  for (int k = 0; k < 2 * kEnough; ++k) {
    const ConsolePicture seen = detector.expose();
    finder.look_at(k < kEnough ? console.show(seen) : seen, at_s(k / 15.0), kRounded);
    if (k == kEnough - 1) {
      EXPECT_NEAR(finder.filter().share, 0.6, 0.03);
    }
  }
  EXPECT_EQ(finder.filter().share, 0);
}

TEST(TemporalFilterFinder, SoIsOneOfWhichImagesNoLongerAgree) {
  Detector detector;
  RecursiveConsole console(0.6);
  RecursiveConsole weaker(0.1);
  TemporalFilterFinder finder(kConsoleWidth, kConsoleHeight);
  for (int k = 0; k < 2 * kEnough; ++k) {
    const ConsolePicture seen = detector.expose();
    const ConsolePicture strongly = console.show(seen);
    const ConsolePicture weakly = weaker.show(seen);
    finder.look_at(k < kEnough || k % 3 == 0 ? strongly : weakly, at_s(k / 15.0), kRounded);
    if (k == kEnough - 1) {
      EXPECT_TRUE(finder.filter().any());
    }
  }
  EXPECT_FALSE(finder.filter().any());
}

TEST(TemporalFilterFinder, MissingExposuresArePutDownToTheRhythm) {
  Detector detector;
  TemporalFilterFinder finder(kConsoleWidth, kConsoleHeight);
  const auto between = [&](double t_s) {
    finder.look_at(detector.expose(), at_s(t_s), kRounded);
    return finder.exposures_between();
  };
  EXPECT_EQ(between(0), 0);
  EXPECT_EQ(between(0.1), 0) << "nobody knows the rhythm";
  EXPECT_EQ(between(0.2), 1);
  EXPECT_EQ(between(0.31), 1);
  EXPECT_EQ(between(0.5), 2);
  EXPECT_EQ(between(0.6), 1);
  EXPECT_EQ(between(5), 0) << "a pause";
  EXPECT_EQ(between(5.1), 1);
  EXPECT_EQ(between(5.13), 0);
  EXPECT_EQ(between(5.16), 1) << "thirty a second, twice";
}

// r_1 = phi_1 .. of D = e_t - (1 - w - l) e_{t-1} - ..., summed by hand.
TEST(TemporalFilter, ComesFromCorrelationsInClosedForm) {
  const double w = 0.8;
  EXPECT_NEAR(filter_of({-(1 - w) / 2, -w * (1 - w) / 2, -w * w * (1 - w) / 2})->share, w, 1e-12);
  EXPECT_NEAR(filter_of({-(1 - w) / 2, -w * (1 - w) / 2, -w * w * (1 - w) / 2})->second, 0, 1e-12);
  EXPECT_FALSE(filter_of({-0.5, 0, 0})) << "nothing but noise";
  EXPECT_FALSE(filter_of({0, -0.5, 0})) << "the mean of two images";
  EXPECT_FALSE(filter_of({-0.1, -0.08, -0.02})) << "the third is that of no recursion";
  EXPECT_FALSE(filter_of({-1, 1, -1})) << "two images in turn";
  EXPECT_FALSE(filter_of({-0.98, 0.97, -0.97})) << "nearly so";
  EXPECT_FALSE(filter_of({0.5, 0.4, 0.44})) << "slow motion: nothing of the newest exposure would be left";
}

TEST(TemporalFilter, OfDetectorAndConsoleIsTakenApart) {
  const double w = 0.7;
  const double l = 0.2;
  std::vector<double> response{1};  // of I to one X
  for (int k = 1; k < 400; ++k) {
    const double two_before = k > 1 ? response[static_cast<std::size_t>(k) - 2] : 0;
    response.push_back((w + l) * response.back() - w * l * two_before);
  }
  const auto covariance = [&](std::size_t apart) {
    double sum = apart == 0 ? 1 : response[apart] - response[apart - 1];
    for (std::size_t k = 1; k + apart < response.size(); ++k) {
      sum += (response[k] - response[k - 1]) * (response[k + apart] - response[k + apart - 1]);
    }
    return sum;
  };
  const auto r = [&](std::size_t apart) { return covariance(apart) / covariance(0); };
  const std::optional<TemporalFilter> found = filter_of({r(1), r(2), r(3)});
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->share, w, 1e-9);
  EXPECT_NEAR(found->second, l, 1e-9);
  EXPECT_NEAR(1 - found->of_before(), (1 - w) * (1 - l), 1e-9);
}

TEST(TemporalFilterFinder, TheLagOfADetectorIsToldFromTheConsoles) {
  Detector detector;
  RecursiveConsole lag(0.25);
  RecursiveConsole console(0.6);
  TemporalFilterFinder finder(kConsoleWidth, kConsoleHeight);
  for (int k = 0; k < kEnough; ++k) {
    finder.look_at(console.show(lag.show(detector.expose())), at_s(k / 15.0), kRounded);
  }
  EXPECT_NEAR(finder.filter().share, 0.6, 0.1);
  EXPECT_NEAR(finder.filter().second, 0.25, 0.1);
  EXPECT_NEAR(finder.filter().of_before(), 1 - 0.4 * 0.75, 0.03);
}

TEST(TemporalFilterInverse, UndoesTwoSharesAtOnce) {
  Detector detector;
  RecursiveConsole lag(0.25);
  RecursiveConsole console(0.6);
  TemporalFilterInverse inverse(kConsoleWidth, kConsoleHeight);
  ImageMeasurement image;
  image.reserve(kConsoleWidth, kConsoleHeight);
  for (int k = 0; k < 6; ++k) {
    const ConsolePicture seen = detector.expose();
    image.grey = console.show(lag.show(seen));
    inverse.undo({0.6, 0.25}, no_ghosts(), k == 0 ? 0 : 1, kWhite, image);
    double square = 0;
    for (std::size_t i = 0; i < seen.size(); ++i) square += std::pow(image.grey[i] - seen[i], 2);
    const double rms = std::sqrt(square / (kConsoleWidth * kConsoleHeight));
    if (k > 1) {
      EXPECT_LT(rms, 0.29 * (1.0 / (0.4 * 0.75) * 1.5 + 1.5 / 0.75)) << "rounded twice";
    }
  }
}

TEST(TemporalFilterInverse, AnImageThatIsMissingLeavesTheSquareOfTheShare) {
  constexpr double kShare = 0.6;
  RecursiveConsole console(kShare);
  TemporalFilterInverse inverse(kConsoleWidth, kConsoleHeight);
  ImageMeasurement image;
  image.reserve(kConsoleWidth, kConsoleHeight);
  const auto shown = [&](float grey) {
    image.grey = console.show(ConsolePicture(static_cast<std::size_t>(kConsoleWidth * kConsoleHeight), grey));
  };
  shown(100);
  inverse.undo({kShare, 0}, no_ghosts(), 0, kWhite, image);
  shown(100);
  shown(180);
  inverse.undo({kShare, 0}, no_ghosts(), 2, kWhite, image);
  // Two exposures, of which the older one counts for 0.6.
  EXPECT_NEAR(image.grey[0], (180 + kShare * 100) / (1 + kShare), 1.5);
  shown(180);
  inverse.undo({kShare, 0}, no_ghosts(), 1, kWhite, image);
  EXPECT_NEAR(image.grey[0], 180, 2);
}

TEST(TemporalFilterInverse, GivesWhatTheDetectorSaw) {
  constexpr double kShare = 0.6;
  Detector detector;
  RecursiveConsole console(kShare);
  TemporalFilterInverse inverse(kConsoleWidth, kConsoleHeight);
  ImageMeasurement image;
  image.reserve(kConsoleWidth, kConsoleHeight);
  for (int k = 0; k < 5; ++k) {
    const ConsolePicture seen = detector.expose();
    image.grey = console.show(seen);
    inverse.undo({kShare, 0}, no_ghosts(), k == 0 ? 0 : 1, kWhite, image);
    double off = 0;
    for (std::size_t i = 0; i < seen.size(); ++i) {
      off = std::max(off, static_cast<double>(std::abs(image.grey[i] - std::clamp(seen[i], 0.0F, kWhite))));
    }
    // Half a grey level of this image, and 0.6 of one of the one before, over 0.4.
    EXPECT_LT(off, 0.5 * (1 + kShare) / (1 - kShare) + 0.01) << "image " << k;
    if (k > 0) {
      EXPECT_EQ(image.brightest, *std::ranges::max_element(image.grey));
      EXPECT_EQ(image.darkest, *std::ranges::min_element(image.grey));
    }
  }
}

double square_off(TimeAveraging what_is_done, double missing_s) {
  ImageDoor door(camera_of(what_is_done));
  return square_off(door, Detector(), RecursiveConsole(0.6), kEnough, missing_s);
}

TEST(ImageDoor, UndoesWhatAConsoleHasAveraged) {
  EXPECT_LT(square_off(TimeAveraging::kUndo, 0), 3);
  EXPECT_GT(square_off(TimeAveraging::kKeep, 0), 30);
}

TEST(ImageDoor, UndoesNothingAfterAPause) {
  EXPECT_NEAR(square_off(TimeAveraging::kUndo, 4), square_off(TimeAveraging::kKeep, 0), 1e-6);
}

}  // namespace
}  // namespace tubed
