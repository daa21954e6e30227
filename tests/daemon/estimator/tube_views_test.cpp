#include "daemon/estimator/images/tube_views.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <vector>

#include "idl/geometry/camera.hpp"
#include "tests/daemon/estimator/simulated_tube.hpp"

namespace tubed {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

/// Paints the tube into the greys: 20 darker than the rest, 30 more at each band.
void paint(const RoomDescription& room, const std::vector<double>& bands_mm, ImageMeasurement& image) {
  const Camera camera(room.cameras.front());
  std::fill(image.grey.begin(), image.grey.end(), 150.0F);
  image.darkest = 90;
  image.brightest = 150;
  constexpr int kHalf_px = 2;
  for (double s_mm = 0; s_mm <= 380; s_mm += 0.2) {
    const bool is_band = std::any_of(bands_mm.begin(), bands_mm.end(),
                                     [=](double band_mm) { return std::abs(s_mm - band_mm) < 0.65; });
    const auto at = camera.project(arc_point(s_mm));
    if (!at || !camera.contains(at->p_image_px, kHalf_px + 1)) continue;
    for (int y = -kHalf_px; y <= kHalf_px; ++y) {
      for (int x = -kHalf_px; x <= kHalf_px; ++x) {
        const auto column = static_cast<std::size_t>(std::lround(at->p_image_px.x()) + x);
        const auto row = static_cast<std::size_t>(std::lround(at->p_image_px.y()) + y);
        float& grey = image.grey[row * static_cast<std::size_t>(image.width) + column];
        grey = std::min(grey, is_band ? 100.0F : 130.0F);
      }
    }
  }
}

/// Looks where the arc is.
struct Views {
  Views() : spline(settings.coefficient_count, 380), C(3, settings.coefficient_count) {
    for (int i = 0; i < C.cols(); ++i) {
      C.col(i) = arc_point((i - 1) * spline.spacing_mm());
    }
  }
  void show(const Stretch& hidden, const TubeSearch& search = {5}) {
    image = image_of_arc(room, now, hidden);
    look(search);
  }
  void look(const TubeSearch& search) {
    Observation observation;
    observation.instant = observation.now = now;
    observation.images[0] = &image;
    observation.image_timeout = milliseconds(120);
    views.measure(observation, spline, C, search, *estimate);
    const auto found = views.constraints(observation, 1, true);
    constraints = found.size();
    lines = found.empty() ? ViewConstraints{} : found[0];
  }
  [[nodiscard]] const LineConstraint& last_line() const { return lines.lines[lines.count - 1]; }

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

TEST(TwoSides, AreTwoViewsOfTheTipTenDegreesApart) {
  const auto shown = [](double turn_deg, double second_from_mm) {
    CameraCalibration turned = one_view_room().cameras[0];
    turned.T_camera_world.linear() =
        Eigen::AngleAxisd(turn_deg * M_PI / 180, Eigen::Vector3d::UnitY()).toRotationMatrix();
    const Camera a(one_view_room().cameras[0]);
    const Camera b(turned);
    LineConstraint at_tip{};
    LineConstraint second{};
    second.s_mm = second_from_mm;
    const std::array<ViewConstraints, 2> views{{{&a, &at_tip, 1}, {&b, &second, 1}}};
    return show_tip_from_two_sides(views, 120) && !show_tip_from_two_sides(std::span(views).first(1), 120);
  };
  EXPECT_TRUE(shown(11, 0));
  EXPECT_FALSE(shown(9, 0));
  EXPECT_TRUE(shown(11, 59));
  EXPECT_FALSE(shown(11, 61)) << "it looks past the tip";
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
  of.image = image_of_arc(of.room, of.now);
  paint(of.room, {}, of.image);
  of.look({5, true});
  const LineConstraint held = of.last_line();
  const double line_px2 = of.lines.lines[0].variance_px2;
  of.look({5, false});
  const LineConstraint loose = of.last_line();
  ASSERT_EQ(held.s_mm, 0);
  ASSERT_EQ(loose.s_mm, 0);
  EXPECT_DOUBLE_EQ(held.variance_px2, of.settings.image_temper * loose.variance_px2);
  EXPECT_GT(loose.variance_px2, 9);
  EXPECT_EQ(of.lines.lines[0].variance_px2, line_px2);
}

TEST(TubeViews, TheEndOfARidgeHoldsATipAlongTheTubeWhereTheGreysEndAsWell) {
  constexpr double kFurtherOut_mm = 6;
  const TubeSearch held{5, true};
  Views of;
  of.image = image_of_arc(of.room, of.now);
  of.look(held);
  EXPECT_NE(of.last_line().s_mm, 0) << "the greys are even";
  EXPECT_FALSE(of.lines.end_by_greys);
  of.look({5, false});
  EXPECT_EQ(of.last_line().s_mm, 0) << "nothing else says where a loose tip ends";

  paint(of.room, {}, of.image);
  of.look(held);
  EXPECT_EQ(of.last_line().s_mm, 0);
  const Camera camera(of.room.cameras.front());
  ASSERT_TRUE(of.lines.end_by_greys);
  const Eigen::Vector2d tip_px = camera.project(arc_point(0))->p_image_px;
  EXPECT_NEAR(of.lines.end_by_greys->normal.dot(of.lines.end_by_greys->target_px - tip_px), 0, 3.5)
      << "painted to half a tube's width beyond it";
  for (double s_mm = -kFurtherOut_mm; s_mm < 0; s_mm += 0.25) {
    draw_ridge(camera, arc_point(s_mm), 0.9, of.image);
  }
  of.look(held);
  EXPECT_NE(of.last_line().s_mm, 0) << "an edge goes on";
  of.image = image_of_arc(of.room, of.now);
  of.look(held);
  EXPECT_FALSE(of.lines.end_by_greys) << "that of the image before";
}

/// One view of a tube with three marks, which are asked for.
struct MarkedViews {
  MarkedViews() {
    room.instruments.front().marks_mm = {8, 18, 34};
    room.instruments.front().mark_length_mm = 3.6;  // 1.3 mm and the brush
    views.emplace(of.settings, room.instruments.front(), room);
  }

  /// An image whose bands lie there; the lines that it gives.
  ViewConstraints show(const std::vector<double>& bands_mm) {
    of.now += milliseconds(100);
    ImageMeasurement image = image_of_arc(room, of.now);
    paint(room, bands_mm, image);
    Observation observation;
    observation.instant = observation.now = of.now;
    observation.images[0] = &image;
    observation.image_timeout = milliseconds(120);
    views->measure(observation, of.spline, of.C, {5, true, 0, true}, *of.estimate);
    return views->constraints(observation, 1, true)[0];
  }

  Views of;
  RoomDescription room = one_view_room();
  std::optional<TubeViews> views;
};

TEST(TubeViews, MarksThatAreSeenFurtherAlongSayHowFar) {
  MarkedViews marked;
  const RoomDescription& room = marked.room;
  const int without = marked.show({}).count;
  constexpr double kFurther_mm = 2;
  const ViewConstraints with = marked.show({8 + kFurther_mm, 18 + kFurther_mm, 34 + kFurther_mm});
  ASSERT_EQ(with.count, without + 3);
  for (int mark = 0; mark < 3; ++mark) {
    const LineConstraint& line = with.lines[with.count - 4 + mark];  // the tube's end is the last
    EXPECT_EQ(line.s_mm, room.instruments.front().marks_mm[static_cast<std::size_t>(mark)]);
    const Camera camera(room.cameras.front());
    const Eigen::Vector2d shown_px = camera.project(arc_point(line.s_mm + kFurther_mm))->p_image_px;
    EXPECT_LT(std::abs(line.normal.dot(line.target_px - shown_px)), 0.5);
    const Eigen::Vector2d tipward = camera.project(arc_point(line.s_mm))->p_image_px - shown_px;
    EXPECT_GT(line.normal.dot(tipward.normalized()), 0.95) << "it holds along the tube";
    EXPECT_LT(line.variance_px2, 2);
  }
}

TEST(TubeViews, MarksThatNoImageShowsAreMissing) {
  MarkedViews marked;
  TubeViews& views = *marked.views;
  for (int i = 0; i < 30; ++i) marked.show({});
  EXPECT_FALSE(views.marks_are_missing()) << "too early to say";
  for (int i = 0; i < 10; ++i) marked.show({});
  EXPECT_TRUE(views.marks_are_missing());
  for (int i = 0; i < 10; ++i) marked.show({8, 18, 34});
  EXPECT_FALSE(views.marks_are_missing());
  for (int i = 0; i < 400; ++i) marked.show({});
  EXPECT_TRUE(views.marks_are_missing()) << "what was long ago counts";
  views.forget();
  EXPECT_FALSE(views.marks_are_missing());
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
