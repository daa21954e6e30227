#include "daemon/estimator/recursive_estimator.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <vector>

#include "tests/daemon/estimator/filter_bench.hpp"

namespace tubed {
namespace {

using std::chrono::milliseconds;

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

/// Share of a displacement of `off_mm` in the image, along its x axis, that the shape has followed.
double followed_share(const FilterBench& bench, double off_mm) {
  double sum = 0;
  int count = 0;
  for (std::size_t i = 0; i < bench.estimate->point_count; ++i) {
    const double s_mm = static_cast<double>(bench.estimate->length_mm) * static_cast<double>(i) /
                        (bench.estimate->point_count - 1);
    const Eigen::Vector3d aside = FilterBench::aside(s_mm);
    const double expected_mm = off_mm * aside.x();
    if (s_mm > 340 || std::abs(aside.x()) < 0.7) continue;
    const Eigen::Vector3d p = Eigen::Map<const Eigen::Vector3d>(bench.estimate->points[i].p_world_mm.data());
    sum += aside.dot(p - arc_point(s_mm)) / expected_mm;
    ++count;
  }
  return count > 0 ? sum / count : 0;
}

// An image that shows the tube where it cannot have gone, by all that was learnt of its motion, shows a jerk.
TEST(RecursiveEstimator, AJerkThatAnImageShowsIsFollowedAtOnce) {
  FilterBench bench;
  bench.measure_times(80);
  ASSERT_LT(bench.rms_mm(), 2);
  bench.image_off_mm = 5;
  bench.show_image(std::chrono::milliseconds(50));
  EXPECT_GT(followed_share(bench, 5), 0.65);
}

TEST(RecursiveEstimator, GoesOnWithCoilsAloneAndSaysThatImagesStopped) {
  FilterBench bench;
  bench.measure_times(40);
  bench.with_images = false;
  bench.measure_times(40);
  EXPECT_LT(bench.rms_mm(), 2.5);
  EXPECT_TRUE(bench.estimate->reasons.has(Reason::kImageStale));
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
    observation.image_timeout = milliseconds(220);
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

double max_distance_mm(const std::vector<Eigen::Vector3d>& a, const std::vector<Eigen::Vector3d>& b) {
  double greatest = a.size() == b.size() && !a.empty() ? 0 : 1e9;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
    greatest = std::max(greatest, (a[i] - b[i]).norm());
  }
  return greatest;
}

// What the daemon finds live, with the latency of images and ticks between them, is what is found offline.
TEST(RecursiveEstimator, ALateImageGivesTheShapeOfItsOwnTime) {
  const auto in_time = shape_with_images(milliseconds(0), false);
  EXPECT_LT(max_distance_mm(shape_with_images(milliseconds(50), true), in_time), 1e-3);
  EXPECT_LT(max_distance_mm(shape_with_images(milliseconds(100), true), in_time), 1e-3);
}

TEST(RecursiveEstimator, ATickLeavesNoTrace) {
  EXPECT_LT(
      max_distance_mm(shape_with_images(milliseconds(0), true), shape_with_images(milliseconds(0), false)),
      1e-3);
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

// Until enough was measured all is taken for noise. Where that was right, nothing of the average is lost.
TEST(RecursiveEstimator, NoiseThatTurnsOutToBeAllOfTheErrorIsAveragedOn) {
  FilterBench bench(well_registered(one_view_room()));
  bench.with_images = false;
  const auto variance_mm2 = [&bench] { return bench.estimate->points[64].covariance_mm2[5]; };
  bench.measure();
  float min_mm2 = variance_mm2();
  const float first_mm2 = min_mm2;
  for (int i = 1; i < 40; ++i) {
    bench.measure();
    ASSERT_LT(variance_mm2(), 1.3F * min_mm2) << "measurement " << i;
    min_mm2 = std::min(min_mm2, variance_mm2());
  }
  EXPECT_LT(min_mm2, first_mm2 / 4);
}

TEST(RecursiveEstimator, ErrorsThatTurnOutToStayAreNotAveraged) {
  std::array<float, 2> variances_mm2{};
  for (const bool frozen : {false, true}) {
    FilterBench bench(well_registered(one_view_room()));
    bench.with_images = false;
    bench.frozen = frozen;
    for (int i = 0; i < 40; ++i) {
      bench.measure(0.02 * (i % 2));
    }
    variances_mm2[frozen ? 1 : 0] = bench.estimate->points[64].covariance_mm2[5];
  }
  EXPECT_GT(variances_mm2[1], 3 * variances_mm2[0]);
}

}  // namespace
}  // namespace tubed
