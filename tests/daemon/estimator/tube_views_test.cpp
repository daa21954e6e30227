#include "daemon/estimator/tube_views.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "idl/geometry/camera.hpp"
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
  void show(const Stretch& hidden, const TubeSearch& search = {5}) {
    image = image_of_arc(room, now, hidden);
    Observation observation;
    observation.instant = observation.now = now;
    observation.images[0] = &image;
    observation.image_timeout = milliseconds(120);
    views.measure(observation, spline, C, search, *estimate);
    const auto found = views.constraints(observation, 1, true);
    constraints = found.size();
    lines = found.empty() ? ViewConstraints{} : found[0];
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
  ViewConstraints lines;        ///< the first one's; the tip's end last
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

TEST(TubeViews, LooksForTheStretchThatIsAskedForOnly) {
  Views of;
  of.show({}, {5, false, 40});
  ASSERT_GT(of.lines.count, 100);
  for (int i = 0; i < of.lines.count; ++i) {
    EXPECT_GE(of.lines.lines[i].s_mm, 40) << "the tip's end neither";
  }
}

TEST(TubeViews, MissATipOfWhichMostLinesDisagree) {
  Views of;
  of.show({});
  EXPECT_FALSE(of.views.misses_tip(of.now));
  of.show({-1, 6});
  EXPECT_FALSE(of.views.misses_tip(of.now)) << "a little of it";
  of.show({-1, 20});
  EXPECT_TRUE(of.views.misses_tip(of.now));
  EXPECT_FALSE(of.views.misses_tip(of.now + milliseconds(1))) << "of another instant";
  of.show({}, {5, false, 40});
  EXPECT_FALSE(of.views.misses_tip(of.now)) << "nobody has looked";
}

// What pixels that are not independent say together is tempered; a tip that a coil holds has no need of more.
TEST(TubeViews, WhereTheTipEndsCountsForWhatItIsWhenNoCoilHoldsIt) {
  Views of;
  of.show({}, {5, true});
  const LineConstraint held = of.lines.lines[of.lines.count - 1];
  const double line_px2 = of.lines.lines[0].variance_px2;
  of.show({}, {5, false});
  const LineConstraint loose = of.lines.lines[of.lines.count - 1];
  ASSERT_EQ(held.s_mm, 0);
  ASSERT_EQ(loose.s_mm, 0);
  EXPECT_DOUBLE_EQ(held.variance_px2, of.settings.image_temper * loose.variance_px2);
  EXPECT_GT(loose.variance_px2, 9);
  EXPECT_EQ(of.lines.lines[0].variance_px2, line_px2);
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
  observation.image_timeout = milliseconds(120);
  EXPECT_TRUE(of.views.constraints(observation, 1, false).empty());
  EXPECT_EQ(to_ns(of.views.newest_exposure()), 0);
  of.show({});
  EXPECT_EQ(of.constraints, 1U);
}

}  // namespace
}  // namespace tubed
