#include "daemon/estimator/recursive_estimator.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "tests/daemon/estimator/simulated_tube.hpp"

namespace tubed {
namespace {

using std::chrono::milliseconds;

/// A filter fed with a measurement every 25 ms and, if wanted, an image every 100 ms.
struct FilterBench {
  FilterBench() {
    settings.mode = EstimatorMode::kFilter;
    estimator = make_estimator(settings, room.instruments.front(), room);
  }
  /// One more measurement, displaced by `shift_mm` in z; the shape after it.
  const TubeEstimate& measure(double shift_mm = 0, int outlier = -1) {
    now += milliseconds(25);
    EmFrame frame = measure_coils(room, now, 4, ++seed);
    for (int i = 0; i < frame.coil_count; ++i) {
      frame.coils[static_cast<std::size_t>(i)].p_em_mm.z() += shift_mm + (i == outlier ? outlier_mm : 0);
      if (i == missing) {
        frame.coils[static_cast<std::size_t>(i)] = CoilSample{};
      }
    }
    history->add(frame);
    return estimate_now(with_images && seed % 4 == 0);
  }
  void measure_times(int count) {
    for (int i = 0; i < count; ++i) {
      measure();
    }
  }
  /// An image that much later, without a measurement since; the shape after it.
  const TubeEstimate& show_image(milliseconds later) {
    now += later;
    return estimate_now(true);
  }
  const TubeEstimate& estimate_now(bool is_image) {
    Observation observation;
    observation.instant = observation.now = now;
    observation.em = history.get();
    observation.is_image_instant = is_image;
    if (is_image) {
      RoomDescription displaced = room;
      displaced.cameras[0].T_camera_world.translation().x() += image_off_mm;
      image = image_of_arc(displaced, now, hidden);
      for (double s = kDecoy.from_mm; s < kDecoy.to_mm && decoy_mm > 0; s += 0.25) {
        if (std::fmod(s, 12) < 2) {  // broken, as what is not a tube often is
          draw_ridge(Camera(displaced.cameras[0]), decoy_point(s), 0.9, image);
        }
      }
      newest_image = now;
      observation.images[0] = &image;
    }
    observation.newest_image = newest_image;
    observation.image_patience = milliseconds(120);
    estimator->estimate(observation, *estimate);
    return *estimate;
  }
  /// RMS over s = 0 .. 370, the truth being displaced by `shift_mm` in z.
  [[nodiscard]] double rms_mm(double shift_mm = 0) const {
    double sum = 0;
    int count = 0;
    for (std::size_t i = 0; i < estimate->point_count; ++i) {
      const double s =
          static_cast<double>(estimate->length_mm) * static_cast<double>(i) / (estimate->point_count - 1);
      if (s <= 370) {
        const Eigen::Vector3d truth = arc_point(s) + Eigen::Vector3d(0, 0, shift_mm);
        sum +=
            (Eigen::Map<const Eigen::Vector3d>(estimate->points[i].p_world_mm.data()) - truth).squaredNorm();
        ++count;
      }
    }
    return count > 0 ? std::sqrt(sum / count) : 1e9;
  }
  /// A stretch of something else, up to `decoy_mm` beside the arc in the image.
  [[nodiscard]] Eigen::Vector3d decoy_point(double s_mm) const {
    const double part = (s_mm - kDecoy.from_mm) / (kDecoy.to_mm - kDecoy.from_mm);
    const Eigen::Vector3d aside = arc_tangent_to_tip(s_mm).cross(Eigen::Vector3d::UnitZ()).normalized();
    return arc_point(s_mm) + decoy_mm * std::min(1.0, 2 * std::pow(std::sin(M_PI * part), 2)) * aside;
  }
  /// How far the shape is from the arc in the image, in the middle of that stretch, as mm of the world.
  [[nodiscard]] double beside_mm() const {
    const double s_mm = (kDecoy.from_mm + kDecoy.to_mm) / 2;
    const auto i = static_cast<std::size_t>(
        std::lround(s_mm / static_cast<double>(estimate->length_mm) * (estimate->point_count - 1)));
    const Eigen::Vector3d p = Eigen::Map<const Eigen::Vector3d>(estimate->points[i].p_world_mm.data());
    const Eigen::Vector3d aside = arc_tangent_to_tip(s_mm).cross(Eigen::Vector3d::UnitZ()).normalized();
    return std::abs(aside.dot(p - arc_point(s_mm)));
  }
  static constexpr Stretch kDecoy{20, 165};
  RoomDescription room = one_view_room();
  EstimatorSettings settings;
  std::unique_ptr<Estimator> estimator;
  std::unique_ptr<EmHistory> history = std::make_unique<EmHistory>();
  std::unique_ptr<TubeEstimate> estimate = std::make_unique<TubeEstimate>();
  ImageMeasurement image;
  MonotonicTime newest_image{};
  MonotonicTime now = from_ns(10'000'000'000);
  unsigned seed = 0;
  bool with_images = true;
  double outlier_mm = 30;
  int missing = -1;         ///< coil that drops out
  Stretch hidden;           ///< of the arc, in the image
  double decoy_mm = 0;      ///< 0: none
  double image_off_mm = 0;  ///< what the image shows is so far beside the coils
};

TEST(RecursiveEstimator, ForgetsNoMeasurementSoNoiseAveragesOut) {
  FilterBench bench;
  bench.measure();
  const double first = bench.rms_mm();
  double sum = 0;
  for (int i = 0; i < 80; ++i) {
    bench.measure();
    sum += i >= 40 ? bench.rms_mm() : 0;
  }
  EXPECT_LT(sum / 40, 0.6 * first);
  EXPECT_EQ(bench.estimate->validity, Validity::kValid);
}

TEST(RecursiveEstimator, GoesOnWithCoilsAloneAndSaysThatImagesStopped) {
  FilterBench bench;
  bench.measure_times(40);
  bench.with_images = false;
  bench.measure_times(40);
  EXPECT_LT(bench.rms_mm(), 2.5);
  EXPECT_TRUE(bench.estimate->reasons.has(Reason::kImageStale));
}

TEST(RecursiveEstimator, ACoilThatJumpsIsLeftOutAndFlaggedAtOnce) {
  FilterBench bench;
  bench.measure_times(40);
  const double before = bench.rms_mm();
  bench.measure(0, 2);
  EXPECT_EQ(bench.estimate->coils[2].state, CoilState::kOutlier);
  EXPECT_TRUE(bench.estimate->reasons.has(Reason::kCoilOutlier));
  EXPECT_LT(bench.rms_mm(), before + 0.5);
}

// A beginning knows little, so that nearly everything agrees with it, and noise may hide the coil at first.
TEST(RecursiveEstimator, ACoilThatIsWrongFromTheBeginningIsLeftOutInAMomentForGood) {
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
TEST(RecursiveEstimator, ACoilThatGoesWrongForGoodStaysOut) {
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

TEST(RecursiveEstimator, ACoilThatIsRightAgainIsTakenInAgain) {
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
TEST(RecursiveEstimator, AWrongCoilStaysOutWhoeverAsksAgain) {
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

// A beginning forgives nobody whom it cannot ask.
TEST(RecursiveEstimator, AWrongCoilThatMissesABeginningIsStillWrong) {
  FilterBench bench;
  for (int i = 0; i < 80; ++i) {
    bench.measure(0, 2);
  }
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
TEST(RecursiveEstimator, AWrongCoilThatDropsOutIsStillWrongWhenItReturns) {
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

// All coils 20 mm away at once: the tube has snapped, and the coils are right.
TEST(RecursiveEstimator, ASnapIsFollowedAtOnce) {
  FilterBench bench;
  bench.with_images = false;
  bench.measure_times(40);
  bench.measure(20);
  EXPECT_LT(bench.rms_mm(20), 5);
}

// Along the rays: the image shows nothing of it, and no coil is so far off that the gate would leave it out.
TEST(RecursiveEstimator, ASnapAlongTheRaysIsFollowedAtTheNextImage) {
  FilterBench bench;
  bench.measure_times(43);
  bench.measure(11);
  ASSERT_EQ(bench.newest_image, bench.now);
  EXPECT_LT(bench.rms_mm(11), 4);
}

// Too little for a snap: coils are off by less than their error. All of them together say it at once.
TEST(RecursiveEstimator, AJerkThatNoCoilShowsByItselfIsMostlyFollowedAtOnce) {
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

TEST(RecursiveEstimator, WithAJerkSigmaGrows) {
  FilterBench bench;
  bench.with_images = false;
  bench.measure_times(80);
  const auto variance_mm2 = [&bench] { return bench.estimate->points[64].covariance_mm2[5]; };
  const float before_mm2 = variance_mm2();
  bench.measure();
  EXPECT_NEAR(variance_mm2(), before_mm2, 0.1F * before_mm2);
  bench.measure(5);
  EXPECT_GT(variance_mm2(), 1.3F * before_mm2);
}

TEST(RecursiveEstimator, OneCoilThatIsOffOnceIsNoSnap) {
  FilterBench bench;
  bench.measure_times(43);
  const double before = bench.rms_mm();
  bench.outlier_mm = 20;
  bench.measure(0, 1);
  EXPECT_LT(bench.rms_mm(), before + 0.5);
  bench.measure();
  EXPECT_LT(bench.rms_mm(), before + 0.5);
}

// Images come faster than measurements: the second one says nothing new about the coil.
TEST(RecursiveEstimator, OneCoilThatIsOffOnceIsNoSnapHoweverManyImagesFollow) {
  FilterBench bench;
  bench.measure_times(43);
  const double before = bench.rms_mm();
  bench.outlier_mm = 20;
  bench.measure(0, 1);
  for (int image = 0; image < 4; ++image) {
    bench.show_image(milliseconds(5));
    EXPECT_LT(bench.rms_mm(), before + 0.5) << "image " << image;
  }
}

/// The shape's points after measurements every 25 ms until 2 s with images every 100 ms, each shown `late`
/// after its exposure and with a tick at every measurement if `ticks`.
std::vector<Eigen::Vector3d> shape_with_images(milliseconds late, bool ticks) {
  FilterBench bench;
  std::vector<MonotonicTime> exposures;
  const MonotonicTime start = bench.now;
  const auto ask = [&](MonotonicTime instant, MonotonicTime now, bool is_image) {
    Observation observation;
    observation.instant = instant;
    observation.now = now;
    observation.em = bench.history.get();
    observation.is_image_instant = is_image;
    if (is_image) {
      bench.image = image_of_arc(bench.room, instant);
      bench.newest_image = instant;
      observation.images[0] = &bench.image;
    }
    observation.newest_image = bench.newest_image;
    observation.image_patience = milliseconds(220);
    bench.estimator->estimate(observation, *bench.estimate);
  };
  for (int i = 1; i <= 86; ++i) {
    const MonotonicTime now = start + i * milliseconds(25);
    bench.history->add(measure_coils(bench.room, now, 4, static_cast<unsigned>(i)));
    const bool beginning = now - start <= milliseconds(500);
    if (ticks || beginning) {
      ask(now, now, false);
    }
    const MonotonicTime exposure = beginning ? now : now - late;
    if (!beginning && exposure - start <= milliseconds(500)) {
      continue;
    }
    if ((exposure - start) % milliseconds(100) == milliseconds(0) && exposure > start) {
      ask(exposure, now, true);
      if (exposure == start + milliseconds(2000)) {
        break;
      }
    }
  }
  std::vector<Eigen::Vector3d> points;
  for (std::size_t i = 0; i < bench.estimate->point_count; ++i) {
    points.emplace_back(Eigen::Map<const Eigen::Vector3d>(bench.estimate->points[i].p_world_mm.data()));
  }
  return points;
}

double greatest_distance_mm(const std::vector<Eigen::Vector3d>& a, const std::vector<Eigen::Vector3d>& b) {
  double greatest = a.size() == b.size() && !a.empty() ? 0 : 1e9;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
    greatest = std::max(greatest, (a[i] - b[i]).norm());
  }
  return greatest;
}

// What the daemon finds live, with the latency of images and ticks between them, is what is found offline.
TEST(RecursiveEstimator, ALateImageGivesTheShapeOfItsOwnTime) {
  const auto in_time = shape_with_images(milliseconds(0), false);
  EXPECT_LT(greatest_distance_mm(shape_with_images(milliseconds(50), true), in_time), 1e-3);
  EXPECT_LT(greatest_distance_mm(shape_with_images(milliseconds(100), true), in_time), 1e-3);
}

TEST(RecursiveEstimator, ATickLeavesNoTrace) {
  EXPECT_LT(greatest_distance_mm(shape_with_images(milliseconds(0), true),
                                 shape_with_images(milliseconds(0), false)),
            1e-3);
}

// Something that looks like the tube creeps away, slowly enough for every single image to be believed.
TEST(RecursiveEstimator, ImagesThatCreepAwayFromTheCoilsAreNotFollowedForEver) {
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

// It hid the tube and led the shape further beside it than lines reach; then both are seen.
TEST(RecursiveEstimator, AStretchCaughtBesideTheTubeIsGivenUpOnceTheTubeIsSeen) {
  FilterBench bench;
  bench.hidden = FilterBench::kDecoy;
  for (int i = 0; i < 200; ++i) {
    bench.decoy_mm = std::min(11.0, 0.08 * i);
    bench.measure();
  }
  ASSERT_GT(bench.beside_mm(), 9);
  bench.hidden = {};
  bench.measure_times(4);
  EXPECT_LT(bench.beside_mm(), 2);
}

TEST(RecursiveEstimator, AfterASecondOfSilenceItBeginsAgain) {
  FilterBench bench;
  bench.with_images = false;
  bench.measure_times(10);
  bench.now += std::chrono::seconds(3);
  bench.measure(8);
  EXPECT_LT(bench.rms_mm(8), 4);
}

TEST(RecursiveEstimator, AfterAResetItIsLikeANewOne) {
  FilterBench used;
  for (int i = 0; i < 60; ++i) {
    used.measure(0.1 * i);
  }
  used.estimator->reset();
  FilterBench fresh;
  used.history = std::make_unique<EmHistory>();
  used.now = fresh.now;
  used.seed = fresh.seed;
  used.newest_image = fresh.newest_image;
  for (int i = 0; i < 40; ++i) {
    used.measure();
    fresh.measure();
    for (std::size_t p = 0; p < fresh.estimate->point_count; ++p) {
      ASSERT_EQ(used.estimate->points[p].p_world_mm, fresh.estimate->points[p].p_world_mm)
          << "measurement " << i;
      ASSERT_EQ(used.estimate->points[p].covariance_mm2, fresh.estimate->points[p].covariance_mm2)
          << "measurement " << i;
    }
  }
}

TEST(RecursiveEstimator, TheCovarianceCoversTheErrors) {
  FilterBench bench;
  int inside = 0;
  int all = 0;
  for (int i = 0; i < 200; ++i) {
    bench.measure();
    if (i < 20) {
      continue;
    }
    for (std::size_t point = 5; point < 120; point += 10) {
      const double s = 380.0 * static_cast<double>(point) / (bench.estimate->point_count - 1);
      const double error = bench.estimate->points[point].p_world_mm[2] - arc_point(s).z();
      const double sigma = std::sqrt(static_cast<double>(bench.estimate->points[point].covariance_mm2[5]));
      inside += std::abs(error) < 2 * sigma ? 1 : 0;
      ++all;
    }
  }
  EXPECT_GT(inside, all * 85 / 100) << "a normal error lies within two sigma in 95 of 100 cases";
}

}  // namespace
}  // namespace tubed
