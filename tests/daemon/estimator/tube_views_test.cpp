#include "daemon/estimator/tube_views.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "daemon/geometry/camera.hpp"
#include "tests/daemon/estimator/simulated_tube.hpp"

namespace tubed {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

/// Looks where the arc is.
struct Views {
  Views() : spline(settings.coefficient_count, 380), C(3, settings.coefficient_count) {
    for (int i = 0; i < C.cols(); ++i) {
      C.col(i) = arc_point((i - 1) * spline.spacing_mm());
    }
  }
  void show(const Stretch& hidden) {
    image = image_of_arc(room, now, hidden);
    Observation observation;
    observation.instant = observation.now = now;
    observation.images[0] = &image;
    observation.image_patience = milliseconds(120);
    views.measure(observation, spline, C, 5, *estimate);
    constraints = views.constraints(observation, 1, true).size();
  }
  RoomDescription room = one_view_room();
  EstimatorSettings settings;
  TubeViews views{settings, room.instruments.front(), room};
  UniformCubicBSpline spline;
  Eigen::Matrix3Xd C;
  ImageMeasurement image;
  std::unique_ptr<TubeEstimate> estimate = std::make_unique<TubeEstimate>();
  MonotonicTime now = from_ns(10'000'000'000);
  std::size_t constraints = 0;  ///< views that a solver was given lines of
};

TEST(TubeViews, AViewInWhichFewLinesAgreeSaysNothingToTheSolverAndHowFewThereWere) {
  Views of;
  of.show({});
  EXPECT_EQ(of.constraints, 1U);
  EXPECT_GT(of.views.agreeing(0, of.now).value_or(0), 0.95);
  of.show({20, 300});
  EXPECT_EQ(of.constraints, 0U);
  ASSERT_TRUE(of.views.agreeing(0, of.now).has_value());
  EXPECT_LT(*of.views.agreeing(0, of.now), 0.5);
}

TEST(TubeViews, OnlyAnImageOfTheInstantTellsHowManyAgree) {
  Views of;
  EXPECT_FALSE(of.views.agreeing(0, of.now).has_value());
  of.show({});
  EXPECT_TRUE(of.views.agreeing(0, of.now + microseconds(1500)).has_value());
  EXPECT_FALSE(of.views.agreeing(0, of.now + milliseconds(3)).has_value());
  of.views.forget();
  EXPECT_FALSE(of.views.agreeing(0, of.now).has_value());
}

TEST(TubeViews, ForgetsLinesWhenTold) {
  Views of;
  of.show({});
  of.views.forget_lines();
  Observation observation;
  observation.instant = observation.now = of.now;
  observation.image_patience = milliseconds(120);
  EXPECT_TRUE(of.views.constraints(observation, 1, false).empty());
  EXPECT_EQ(to_ns(of.views.newest_exposure()), 0);
  of.show({});
  EXPECT_EQ(of.constraints, 1U);
}

}  // namespace
}  // namespace tubed
