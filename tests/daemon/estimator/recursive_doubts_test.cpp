// What the recursive estimator does not believe.
#include <gtest/gtest.h>

#include "tests/daemon/estimator/filter_bench.hpp"

namespace tubed {
namespace {

using std::chrono::milliseconds;

TEST(RecursiveDoubts, ACoilThatJumpsIsLeftOutAndFlaggedAtOnce) {
  FilterBench bench;
  bench.measure_times(40);
  const double before = bench.rms_mm();
  bench.measure(0, 2);
  EXPECT_EQ(bench.estimate->coils[2].state, CoilState::kOutlier);
  EXPECT_TRUE(bench.estimate->reasons.has(Reason::kCoilOutlier));
  EXPECT_LT(bench.rms_mm(), before + 0.5);
}

// A beginning knows little, so that nearly everything agrees with it, and noise may hide the coil at first.
TEST(RecursiveDoubts, ACoilThatIsWrongFromTheBeginningIsLeftOutInAMomentForGood) {
  for (const int liar : {1, 2, 3}) {
    FilterBench bench;
    double sum = 0;
    for (int i = 0; i < 120; ++i) {
      bench.measure(0, liar);
      sum += i >= 40 ? bench.rms_mm() / 80 : 0;
      if (i >= 20) {
        EXPECT_EQ(bench.estimate->coils[static_cast<std::size_t>(liar)].state, CoilState::kOutlier)
            << "coil " << liar << ", measurement " << i;
      }
    }
    EXPECT_LT(sum, 2) << "coil " << liar;
  }
}

// Longer than any contradiction is borne: the coils of a measurement alone say that the coil is wrong.
TEST(RecursiveDoubts, ACoilThatGoesWrongForGoodStaysOut) {
  for (const bool with_images : {true, false}) {
    FilterBench bench;
    bench.with_images = with_images;
    bench.measure_times(60);
    for (int i = 0; i < 280; ++i) {  // 7 s
      bench.measure(0, 2);
      ASSERT_EQ(bench.estimate->coils[2].state, CoilState::kOutlier)
          << "measurement " << i << (with_images ? ", images" : "");
      ASSERT_LT(bench.rms_mm(), 3) << "measurement " << i << (with_images ? ", images" : "");
    }
  }
}

TEST(RecursiveDoubts, ACoilThatIsRightAgainIsTakenInAgain) {
  FilterBench bench;
  for (int i = 0; i < 80; ++i) {
    bench.measure(0, 2);
  }
  ASSERT_EQ(bench.estimate->coils[2].state, CoilState::kOutlier);
  int used = 0;
  for (int i = 0; i < 40; ++i) {
    bench.measure();
    used += bench.estimate->coils[2].state == CoilState::kUsed ? 1 : 0;
  }
  EXPECT_GE(used, 30);
  EXPECT_EQ(bench.estimate->coils[2].state, CoilState::kUsed);
}

// A shape asked for without a new measurement, between images or for one: what is wrong is not used there
// either.
TEST(RecursiveDoubts, AWrongCoilStaysOutWhoeverAsksAgain) {
  FilterBench bench;
  bench.measure_times(60);
  for (int i = 0; i < 40; ++i) {
    bench.measure(0, 2);
    for (const bool is_image : {false, true}) {
      bench.now += milliseconds(5);
      bench.estimate_now(is_image);
      ASSERT_EQ(bench.estimate->coils[2].state, CoilState::kOutlier) << "measurement " << i;
      ASSERT_FALSE(bench.estimate->reasons.has(Reason::kImageLostTube)) << "measurement " << i;
    }
  }
  EXPECT_LT(bench.rms_mm(), 2);
}

// A beginning forgives nobody whom it cannot ask. Wrong by so little, it would not be told again at once.
TEST(RecursiveDoubts, AWrongCoilThatMissesABeginningIsStillWrong) {
  FilterBench bench;
  bench.outlier_mm = 25;
  for (int i = 0; i < 80; ++i) {
    bench.measure(0, 2);
  }
  ASSERT_EQ(bench.estimate->coils[2].state, CoilState::kOutlier);
  bench.now += milliseconds(1500);  // so long a gap that it begins again
  bench.missing = 2;
  bench.measure(0, 2);
  bench.missing = -1;
  for (int i = 0; i < 20; ++i) {
    bench.measure(0, 2);
    EXPECT_EQ(bench.estimate->coils[2].state, CoilState::kOutlier) << "measurement " << i;
  }
}

// What is missing for a moment is no better for that.
TEST(RecursiveDoubts, AWrongCoilThatDropsOutIsStillWrongWhenItReturns) {
  FilterBench bench;
  for (int i = 0; i < 80; ++i) {
    bench.measure(0, 2);
  }
  for (int i = 0; i < 40; ++i) {
    bench.missing = i % 2 == 0 ? 2 : -1;
    bench.measure(0, 2);
    EXPECT_NE(bench.estimate->coils[2].state, CoilState::kUsed) << "measurement " << i;
  }
  EXPECT_LT(bench.rms_mm(), 3);
}

// Nor for two seconds of silence.
TEST(RecursiveDoubts, AWrongCoilThatIsMissingForLongIsStillWrongWhenItReturns) {
  FilterBench bench;
  bench.measure_times(60);
  for (int i = 0; i < 40; ++i) {
    bench.measure(0, 2);
  }
  bench.missing = 2;
  bench.measure_times(80);
  bench.missing = -1;
  for (int i = 0; i < 20; ++i) {
    bench.measure(0, 2);
    EXPECT_EQ(bench.estimate->coils[2].state, CoilState::kOutlier) << "measurement " << i;
  }
}

TEST(RecursiveDoubts, TwoWrongCoilsAreLeftOutTogether) {
  FilterBench bench;
  bench.measure_times(60);
  const double before = bench.rms_mm();
  bench.second_outlier = 3;
  for (int i = 0; i < 20; ++i) {
    bench.measure(0, 1);
    EXPECT_EQ(bench.estimate->coils[1].state, CoilState::kOutlier) << "measurement " << i;
    EXPECT_EQ(bench.estimate->coils[3].state, CoilState::kOutlier) << "measurement " << i;
  }
  EXPECT_LT(bench.rms_mm(), before + 3);
}

// At each image it says the same by chance.
TEST(RecursiveDoubts, ACoilThatContradictsItselfIsNoSnap) {
  FilterBench bench;
  bench.measure_times(80);
  for (int i = 0; i < 60; ++i) {
    bench.outlier_mm = bench.seed % 4 == 3 ? 25 : -25;
    bench.measure(0, 0);
    ASSERT_EQ(bench.estimate->coils[0].state, CoilState::kOutlier) << "measurement " << i;
    ASSERT_LT(bench.rms_mm(), 3) << "measurement " << i;
  }
}

// With nothing else to say where the tip is, what is known of it fades and nearly everything agrees with it.
TEST(RecursiveDoubts, WithoutImagesACoilThatContradictsItselfStaysOutUntilItIsRight) {
  FilterBench bench;
  bench.with_images = false;
  bench.measure_times(80);
  const auto variance_mm2 = [&bench] { return bench.estimate->points[64].covariance_mm2[5]; };
  const float before_mm2 = variance_mm2();
  for (int i = 0; i < 80; ++i) {
    bench.outlier_mm = i % 2 == 0 ? 13 : -13;  // too little to be named by one measurement
    bench.measure(0, 0);
    ASSERT_EQ(bench.estimate->coils[0].state, CoilState::kOutlier) << "measurement " << i;
    ASSERT_LT(variance_mm2(), 2 * before_mm2) << "begun again at measurement " << i;
  }
  EXPECT_LT(bench.rms_mm(), 8);
  bench.measure_times(2);
  EXPECT_EQ(bench.estimate->coils[0].state, CoilState::kUsed);
  EXPECT_LT(bench.rms_mm(), 3);
}

TEST(RecursiveDoubts, NothingIsBegunWithACoilThatContradictsItself) {
  FilterBench bench;
  bench.measure_times(80);
  bench.hidden = {0, 380};  // so that it begins again
  for (int i = 0; i < 40; ++i) {
    bench.outlier_mm = i % 2 == 0 ? 13 : -13;
    bench.measure(0, 0);
    ASSERT_EQ(bench.estimate->coils[0].state, CoilState::kOutlier) << "measurement " << i;
  }
}

// The coils of a measurement alone named it while it was wrong; that is no reason to keep the tip where the
// wrong coil had it at the beginning.
TEST(RecursiveDoubts, ACoilThatIsNoLongerNamedIsHeardAgain) {
  for (const unsigned seed : {0U, 1000U}) {
    FilterBench bench;
    bench.seed = seed;
    bench.outlier_mm = 25;
    for (int i = 0; i < 8; ++i) {
      bench.measure(0, 0);
    }
    ASSERT_EQ(bench.estimate->coils[0].state, CoilState::kUsed);
    bench.outlier_mm = -30;
    for (int i = 0; i < 4; ++i) {
      bench.measure(0, 0);
    }
    ASSERT_EQ(bench.estimate->coils[0].state, CoilState::kOutlier);
    ASSERT_GT(bench.rms_mm(), 6);
    bench.measure_times(100);
    EXPECT_EQ(bench.estimate->coils[0].state, CoilState::kUsed);
    EXPECT_LT(bench.rms_mm(), 2);
  }
}

// However seldom the tracker measures, its coils are asked about every half second.
TEST(RecursiveDoubts, ACoilThatIsNoLongerNamedIsHeardAgainByASlowTrackerAsWell) {
  for (const unsigned seed : {5U, 7U, 11U}) {
    FilterBench bench;
    bench.interval = milliseconds(400);
    bench.seed = 1000 * seed;
    bench.measure_times(20);
    for (unsigned i = 0; i < 14; ++i) {
      const double wrong_mm = (5 * i + seed) % 2 == 0 ? -25 : 25;
      bench.outlier_mm = (7 * i + seed) % 3 == 1 ? 12 : wrong_mm;
      bench.measure(0, 0);
    }
    ASSERT_EQ(bench.estimate->coils[0].state, CoilState::kOutlier) << seed;
    bench.measure_times(4);
    EXPECT_EQ(bench.estimate->coils[0].state, CoilState::kUsed) << seed;
    EXPECT_LT(bench.rms_mm(), 4) << seed;
  }
}

// It was never there, and the first image comes when the shape of the coils alone ends 30 mm, 50 px, beside
// the tip: far beyond what lines reach.
TEST(RecursiveDoubts, BegunWithoutTheTipsCoilItEndsWhereItIsSeenAndItsDepthIsUncertain) {
  FilterBench bench;
  bench.missing = 0;
  bench.measure_times(3);
  ASSERT_GT(bench.rms_mm(), 5);
  for (int i = 0; i < 40; ++i) {
    bench.measure();
    const auto& tip = bench.estimate->points[0];
    const Eigen::Vector3d error_mm = Eigen::Map<const Eigen::Vector3d>(tip.p_world_mm.data()) - arc_point(0);
    ASSERT_LT(error_mm.head<2>().norm(), 3) << "measurement " << i;
    ASSERT_LT(std::abs(error_mm.z()), 2 * std::sqrt(tip.covariance_mm2[5])) << "measurement " << i;
  }
  EXPECT_LT(bench.rms_mm(), 2.5);
}

// It bends by 40 px at once, further than lines reach, and is looked for there at the next image.
TEST(RecursiveDoubts, ATipThatNoCoilHoldsIsFollowedAnewWhereItsLinesDisagree) {
  FilterBench bench;
  bench.measure_times(44);
  bench.missing = 0;
  bench.straight_tip_mm = 80;
  bench.measure_times(120);
  const auto aside_mm = [&bench](const Eigen::Vector3d& truth) {
    const Eigen::Vector3d tip =
        Eigen::Map<const Eigen::Vector3d>(bench.estimate->points[0].p_world_mm.data());
    return (tip - truth).head<2>().norm();
  };
  ASSERT_LT(aside_mm(bench.straight_tip(0)), 3);
  bench.straight_tip_mm = 0;
  bench.measure_times(4);
  ASSERT_GT(aside_mm(arc_point(0)), 15);
  bench.measure_times(8);
  EXPECT_LT(aside_mm(arc_point(0)), 7);
}

TEST(RecursiveDoubts, BegunWithAnImageButWithoutTheTipsCoilItsDepthIsAsUncertain) {
  FilterBench bench;
  bench.missing = 0;
  bench.seed = 3;
  bench.measure();
  ASSERT_EQ(bench.newest_image, bench.now);
  const auto depth_sigma_mm = [&bench] { return std::sqrt(bench.estimate->points[0].covariance_mm2[5]); };
  EXPECT_GT(depth_sigma_mm(), 15);
  bench.measure_times(20);
  EXPECT_GT(depth_sigma_mm(), 15);
}

// All coils 20 mm away at once: the tube has snapped, and the coils are right.
TEST(RecursiveDoubts, ASnapIsFollowedAtOnce) {
  FilterBench bench;
  bench.with_images = false;
  bench.measure_times(40);
  bench.measure(20);
  EXPECT_LT(bench.rms_mm(20), 5);
}

// Along the rays: the image shows nothing of it, and no coil is so far off that it would be left out.
TEST(RecursiveDoubts, ASnapAlongTheRaysIsFollowedAtTheNextImage) {
  FilterBench bench;
  bench.measure_times(43);
  bench.measure(11);
  ASSERT_EQ(bench.newest_image, bench.now);
  EXPECT_LT(bench.rms_mm(11), 4);
}

// Too little for a snap: coils are off by less than their error. All of them together say it at once.
TEST(RecursiveDoubts, AJerkThatNoCoilShowsByItselfIsMostlyFollowedAtOnce) {
  FilterBench bench;
  bench.with_images = false;
  bench.measure_times(80);
  ASSERT_LT(bench.rms_mm(), 1.5);
  for (int i = 0; i < 3; ++i) {
    bench.measure(5);
    EXPECT_EQ(bench.estimate->coils[2].state, CoilState::kUsed);
  }
  EXPECT_LT(bench.rms_mm(5), 2.5);
}

TEST(RecursiveDoubts, WithAJerkSigmaGrows) {
  FilterBench bench(well_registered(one_view_room()));
  bench.with_images = false;
  bench.measure_times(80);
  const auto variance_mm2 = [&bench] { return bench.estimate->points[64].covariance_mm2[5]; };
  const float before_mm2 = variance_mm2();
  bench.measure();
  EXPECT_NEAR(variance_mm2(), before_mm2, 0.1F * before_mm2);
  bench.measure(5);
  EXPECT_GT(variance_mm2(), 1.3F * before_mm2);
}

TEST(RecursiveDoubts, OneCoilThatIsOffOnceIsNoSnap) {
  FilterBench bench;
  const double before = bench.measure_with_one_coil_off();
  EXPECT_LT(bench.rms_mm(), before + 0.5);
  bench.measure();
  EXPECT_LT(bench.rms_mm(), before + 0.5);
}

// Images come faster than measurements: the second one says nothing new about the coil.
TEST(RecursiveDoubts, OneCoilThatIsOffOnceIsNoSnapHoweverManyImagesFollow) {
  FilterBench bench;
  const double before = bench.measure_with_one_coil_off();
  for (int image = 0; image < 4; ++image) {
    bench.show_image(milliseconds(5));
    EXPECT_LT(bench.rms_mm(), before + 0.5) << "image " << image;
  }
}

// Something that looks like the tube creeps away, slowly enough for every single image to be believed.
TEST(RecursiveDoubts, ImagesThatCreepAwayFromTheCoilsAreNotFollowedForEver) {
  FilterBench bench;
  bench.measure_times(40);
  for (int i = 0; i < 400; ++i) {
    bench.image_off_mm += 0.05;  // 20 mm in all, coils err by 4 mm
    bench.measure();
    ASSERT_TRUE(bench.estimate->validity != Validity::kValid || bench.rms_mm() < 9)
        << "VALID and " << bench.rms_mm() << " mm off after " << i;
  }
  EXPECT_LT(bench.rms_mm(), 4);
}

// Nobody looks at the image between two images: what it said holds until one shows the tube.
TEST(RecursiveDoubts, ATickAfterAnImageWithoutTheTubeIsAsDoubtfulAsTheImage) {
  FilterBench bench;
  bench.measure_times(44);
  bench.with_images = false;
  bench.measure();
  ASSERT_EQ(bench.estimate->validity, Validity::kValid);
  for (int image = 0; image < 5; ++image) {  // three make it begin anew
    bench.hidden = {-1, 400};
    bench.show_image(milliseconds(5));
    ASSERT_TRUE(bench.estimate->reasons.has(Reason::kImageLostTube)) << "image " << image;
    for (int tick = 0; tick < 3; ++tick) {
      bench.measure();
      ASSERT_EQ(bench.estimate->validity, Validity::kQuestionable) << "image " << image << ", tick " << tick;
      ASSERT_TRUE(bench.estimate->reasons.has(Reason::kImageLostTube))
          << "image " << image << ", tick " << tick;
    }
  }
  bench.hidden = {};
  bench.show_image(milliseconds(5));
  ASSERT_FALSE(bench.estimate->reasons.has(Reason::kImageLostTube));
  bench.measure();
  EXPECT_EQ(bench.estimate->validity, Validity::kValid);
}

}  // namespace
}  // namespace tubed
