#include "daemon/estimator/tip/mirror_test.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <utility>
#include <vector>

#include "daemon/estimator/estimator.hpp"
#include "tests/daemon/estimator/simulated_tube.hpp"
#include "tests/daemon/estimator/tilted_tip.hpp"

namespace tubed {
namespace {

using std::chrono::milliseconds;

constexpr double kLoose_mm = TiltedTip::kLoose_mm;
constexpr int kCoefficients = 26;

/// A still hooked tube without the coil of its tip, and what an estimator makes of it.
struct LooseTip {
  LooseTip(EstimatorMode mode, double side, RoomDescription in = one_view_room())
      : tube(side), room(std::move(in)) {
    settings.mode = mode;
    estimator = make_estimator(settings, room.instruments.front(), room);
  }
  /// A measurement with a millimetre of noise, and an image of the tube in each of the first `views` views.
  void measure(std::size_t views = 1) {
    now += milliseconds(25);
    EmFrame frame = measure_coils(room, now, 0, ++seed);
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    for (int i = 0; i < frame.coil_count; ++i) {
      CoilSample& sample = frame.coils[static_cast<std::size_t>(i)];
      const double s_mm = room.instruments.front().coils[static_cast<std::size_t>(i)].offset_from_tip_mm;
      const Eigen::Vector3d noise(normal(random), normal(random), normal(random));
      sample.p_em_mm = tube.point(s_mm) + noise;
      sample.tangent_em = tube.tangent_to_tip(s_mm);
    }
    if (!has_tip_coil && room.instruments.front().coils.size() == 5) {
      frame.coils[0] = CoilSample{};
    }
    history->add(frame);
    Observation observation;
    observation.instant = observation.now = now;
    observation.newest_image = views > 0 ? now : observation.newest_image;
    observation.em = history.get();
    observation.fluoroscopy_off = fluoroscopy_off;
    observation.is_image_instant = views > 0;
    observation.image_timeout = milliseconds(120);
    for (std::size_t view = 0; view < views; ++view) {
      images[view] = image_of_arc(room, now, {-1, 381}, view);  // of nothing
      for (double s_mm = 0; s_mm <= 380; s_mm += 0.25) {
        if (!hidden.contains(s_mm)) {
          draw_ridge(Camera(room.cameras[view]), tube.point(s_mm), 0.9, images[view]);
        }
      }
      observation.images[view] = &images[view];
    }
    estimator->estimate(observation, *estimate);
  }
  [[nodiscard]] Eigen::Vector3d tip_error_mm() const {
    return Eigen::Map<const Eigen::Vector3d>(estimate->points[0].p_world_mm.data()) - tube.point(0);
  }
  /// Of the tip, along the first camera's axis.
  [[nodiscard]] double depth_sigma_mm() const {
    return std::sqrt(static_cast<double>(estimate->points[0].covariance_mm2[5]));
  }
  TiltedTip tube;
  RoomDescription room;
  EstimatorSettings settings;
  std::unique_ptr<Estimator> estimator;
  std::unique_ptr<EmHistory> history = std::make_unique<EmHistory>();
  std::unique_ptr<TubeEstimate> estimate = std::make_unique<TubeEstimate>();
  std::array<ImageMeasurement, kMaxCameras> images{};
  MonotonicTime now = from_ns(10'000'000'000);
  unsigned seed = 0;
  bool has_tip_coil = false;
  bool fluoroscopy_off = false;
  Stretch hidden;  ///< of the tube, in the images
};

/// The second camera looks along x.
RoomDescription two_view_room() {
  RoomDescription room = one_view_room();
  CameraCalibration second = room.cameras[0];
  second.name = "B";
  second.T_camera_world.linear() << 0, 0, 1, 0, 1, 0, -1, 0, 0;
  room.cameras.push_back(second);
  return room;
}

/// Coefficients of the tube hooked to that side, and what asks about them.
struct Coefficients {
  explicit Coefficients(double side) {
    const TiltedTip tube(side);
    for (int k = 0; k < kCoefficients; ++k) {
      C.col(k) = tube.point((k - 1) * spline.spacing_mm());
    }
  }
  [[nodiscard]] Eigen::Vector3d point(const Eigen::Matrix3Xd& of, double s_mm) const {
    const CubicBasis basis = spline.basis(s_mm);
    return combine(of, basis.first, basis.value);
  }
  /// What becomes of C, which costs 100, where shapes on the other side cost `cost` and all others 1000.
  Eigen::Matrix3Xd tested(double cost) {
    Eigen::Matrix3Xd tested = C;
    const double side = point(C, 0).z();
    mirror_test.run(shape, tested,
                    [&](Eigen::Matrix3Xd& tried) { return side * point(tried, 0).z() < 0 ? cost : 1000.0; });
    return tested;
  }
  UniformCubicBSpline spline{kCoefficients, 380};
  Camera camera{one_view_room().cameras[0]};
  LooseShape shape{camera, spline, kLoose_mm, 100};
  Eigen::Matrix3Xd C{3, kCoefficients};
  MirrorTest mirror_test{kCoefficients};
};

TEST(MirrorTest, TheMirrorImageHasTheOtherDepthAndTheSameImage) {
  const Coefficients of(1);
  Eigen::Matrix3Xd mirrored;
  MirrorTest::mirror_before(kLoose_mm, of.shape, of.C, mirrored);
  ASSERT_GT(of.point(of.C, 0).z(), 25);
  for (double s_mm = 0; s_mm <= 380; s_mm += 5) {
    const Eigen::Vector3d here = of.point(of.C, s_mm);
    const Eigen::Vector3d there = of.point(mirrored, s_mm);
    EXPECT_NEAR(there.z(), s_mm < kLoose_mm ? -here.z() : here.z(), 1) << s_mm;
    EXPECT_LT((of.camera.project(here)->p_image_px - of.camera.project(there)->p_image_px).norm(), 0.5)
        << s_mm;
  }
}

TEST(MirrorTest, MirroredTwiceItIsTheSame) {
  const Coefficients of(-1);
  Eigen::Matrix3Xd once;
  Eigen::Matrix3Xd twice;
  MirrorTest::mirror_before(kLoose_mm, of.shape, of.C, once);
  MirrorTest::mirror_before(kLoose_mm, of.shape, once, twice);
  EXPECT_GT((once - of.C).norm(), 50);
  EXPECT_LT((twice - of.C).norm(), 1);
}

// The depth goes up, and from 40 mm before the tip down again.
TEST(MirrorTest, ItTurnsAtTheFirstCoilAndWhereTheTubeRunsAcrossTheView) {
  Coefficients of(1);
  for (int k = 0; k < kCoefficients; ++k) {
    const double s_mm = (k - 1) * of.spline.spacing_mm();
    of.C.col(k) = Eigen::Vector3d(s_mm - 200, 0, -0.01 * (s_mm - 40) * (s_mm - 40));
  }
  const auto turns = of.mirror_test.find_turns(of.shape, of.C);
  ASSERT_EQ(turns.size(), 2U);
  EXPECT_DOUBLE_EQ(turns[0], kLoose_mm);
  EXPECT_NEAR(turns[1], 40, 4);
}

TEST(MirrorTest, WhatCostsAsMuchStaysAndTheOtherWayIsAsLikely) {
  Coefficients of(1);
  EXPECT_EQ(of.tested(100), of.C);
  const Eigen::Vector3d way_mm = of.point(of.mirror_test.rival(), 0);
  EXPECT_NEAR(way_mm.z(), -std::sqrt(0.5) * 2 * of.point(of.C, 0).z(), 1);
  EXPECT_LT(of.point(of.mirror_test.rival(), 200).norm(), 1e-9) << "behind the turn there is no other way";
  EXPECT_TRUE(of.mirror_test.is_ambiguous());
}

TEST(MirrorTest, WhatSavesLittleStaysAndTheOtherWayIsTheLikelierOne) {
  Coefficients of(1);
  EXPECT_EQ(of.tested(98), of.C);
  const double likelier = 1 / (1 + std::exp(-1.0));
  EXPECT_NEAR(of.point(of.mirror_test.rival(), 0).z(), -std::sqrt(likelier) * 2 * of.point(of.C, 0).z(), 1);
}

TEST(MirrorTest, WhatSavesMuchTakesItsPlace) {
  Coefficients of(1);
  EXPECT_NEAR(of.point(of.tested(80), 0).z(), -of.point(of.C, 0).z(), 0.5);
  EXPECT_LT(of.point(of.mirror_test.rival(), 0).norm(), 1) << "the former one is out of the question";
  EXPECT_FALSE(of.mirror_test.is_ambiguous());
}

TEST(MirrorTest, WhatCostsMuchMoreOrCannotBeSolvedIsNone) {
  for (const double cost : {150.0, std::numeric_limits<double>::quiet_NaN()}) {
    Coefficients of(1);
    EXPECT_EQ(of.tested(cost), of.C) << cost;
    EXPECT_LT(of.mirror_test.rival().norm(), 1e-3) << cost;
    EXPECT_FALSE(of.mirror_test.is_ambiguous()) << cost;
  }
}

// 1 / (1 + e^2.9) = 0.052, 1 / (1 + e^3) = 0.047.
TEST(MirrorTest, ATwentiethOfTheProbabilityIsAmbiguous) {
  Coefficients of(1);
  of.tested(105.8);
  EXPECT_TRUE(of.mirror_test.is_ambiguous());
  of.tested(106);
  EXPECT_FALSE(of.mirror_test.is_ambiguous());
  of.tested(102);
  of.mirror_test.clear();
  EXPECT_FALSE(of.mirror_test.is_ambiguous());
}

TEST(MirrorTest, MoreThanAHundredMillimetresInOneViewAreAmbiguousWhateverTheyCost) {
  Coefficients of(1);
  of.shape.loose_mm = 101;
  of.tested(1000);
  EXPECT_TRUE(of.mirror_test.is_ambiguous());
  of.shape.is_seen_from_two_sides = true;
  of.tested(1000);
  EXPECT_FALSE(of.mirror_test.is_ambiguous());
  of.shape.is_seen_from_two_sides = false;
  of.shape.loose_mm = 99;
  of.tested(1000);
  EXPECT_FALSE(of.mirror_test.is_ambiguous());
}

TEST(MirrorTest, AShapeWhoseTipIsNearlyTheSameIsNoOtherOne) {
  Coefficients of(1);
  Eigen::Matrix3Xd C = of.C;
  of.mirror_test.run(of.shape, C, [&](Eigen::Matrix3Xd& tried) {
    tried = of.C;
    tried.col(0).y() += 3;  // 2 mm and less at the tip
    return 100.0;
  });
  EXPECT_FALSE(of.mirror_test.is_ambiguous());
}

// It is its own mirror image.
TEST(MirrorTest, ATipThatRunsAcrossTheViewIsTriedOnBothSides) {
  for (const double likelier : {-1.0, 1.0}) {
    Coefficients of(0);
    Eigen::Matrix3Xd C = of.C;
    of.mirror_test.run(of.shape, C, [&](Eigen::Matrix3Xd& tried) {
      return likelier * of.point(tried, 0).z() > 10 ? 80.0 : 100.0;
    });
    EXPECT_GT(likelier * of.point(C, 0).z(), 10);
    EXPECT_LT((C.rightCols(kCoefficients - 8) - of.C.rightCols(kCoefficients - 8)).norm(), 1e-9);
  }
}

// A camera in the midst of the tube, as only a wrong calibration has it.
TEST(MirrorTest, WhatIsAtTheCamerasCentreStaysWhereItIs) {
  Coefficients of(1);
  CameraCalibration calibration = one_view_room().cameras[0];
  calibration.T_camera_world.translation().z() = 0;
  const Camera camera(calibration);
  Eigen::Matrix3Xd moved;
  MirrorTest::mirror_before(kLoose_mm, {camera, of.spline, kLoose_mm, 100}, of.C, moved);
  EXPECT_LT((moved - of.C).norm(), 1e-9);
  MirrorTest::lean(-1, {camera, of.spline, kLoose_mm, 100}, of.C, moved);
  EXPECT_LT((moved - of.C).norm(), 500) << "it does not fly away";
}

// Whichever side the solver takes, the other one is within what it says not to know.
TEST(MirrorTest, ATipThatNoCoilHoldsIsWithinThreeSigmaOnEitherSide) {
  for (const EstimatorMode mode : {EstimatorMode::kJoint, EstimatorMode::kFilter}) {
    double furthest_mm = 0;
    for (const double side : {-1.0, 1.0}) {
      LooseTip tip(mode, side);
      for (int i = 0; i < 40; ++i) {
        tip.measure();
        const double off_mm = std::abs(tip.tip_error_mm().z());
        ASSERT_LT(tip.tip_error_mm().head<2>().norm(), 10) << name_of(mode) << side << " " << i;
        ASSERT_LT(off_mm, 3 * tip.depth_sigma_mm()) << name_of(mode) << side << " " << i;
        furthest_mm = std::max(furthest_mm, off_mm);
      }
    }
    EXPECT_GT(furthest_mm, 30) << "of two sides one is the wrong one";
  }
}

TEST(MirrorTest, ATipThatTwoViewsShowHasOneSide) {
  for (const EstimatorMode mode : {EstimatorMode::kJoint, EstimatorMode::kFilter}) {
    for (const double side : {-1.0, 1.0}) {
      LooseTip tip(mode, side, two_view_room());
      for (int i = 0; i < 20; ++i) {
        tip.measure(1);
      }
      ASSERT_GT(tip.depth_sigma_mm(), 10) << name_of(mode) << side;
      EXPECT_TRUE(tip.estimate->reasons.has(Reason::kAmbiguous)) << name_of(mode) << side;
      tip.measure(0);
      EXPECT_TRUE(tip.estimate->reasons.has(Reason::kAmbiguous))
          << "between images: " << name_of(mode) << side;
      for (int i = 0; i < 10; ++i) {
        tip.measure(2);
      }
      EXPECT_FALSE(tip.estimate->reasons.has(Reason::kAmbiguous)) << name_of(mode) << side;
      EXPECT_LT(std::abs(tip.tip_error_mm().z()), 3) << name_of(mode) << side;
      EXPECT_LT(tip.depth_sigma_mm(), 3) << name_of(mode) << side;
    }
  }
}

// In mode `joint` it is then a shape of the coils alone; `filter` goes on with what images have bent.
TEST(MirrorTest, WithoutImagesATipStaysAmbiguousWhereTheyHaveBentIt) {
  for (const EstimatorMode mode : {EstimatorMode::kJoint, EstimatorMode::kFilter}) {
    RoomDescription room = one_view_room();
    InstrumentDescription& instrument = room.instruments[0];
    instrument.rest_shape = RestShape::kStraight;
    instrument.coils.erase(instrument.coils.begin());  // mounted so, not lost
    for (CoilPlacement& coil : instrument.coils) --coil.sensor;
    LooseTip tip(mode, 1, room);
    for (int i = 0; i < 20; ++i) {
      tip.measure(1);
    }
    ASSERT_TRUE(tip.estimate->reasons.has(Reason::kAmbiguous)) << name_of(mode);
    tip.fluoroscopy_off = true;
    for (int i = 0; i < 10; ++i) {  // 250 ms; an image is old after 120
      tip.measure(0);
    }
    const bool is_filter = mode == EstimatorMode::kFilter;
    EXPECT_EQ(tip.estimate->reasons.has(Reason::kAmbiguous), is_filter) << name_of(mode);
    EXPECT_EQ(tip.estimate->validity, is_filter ? Validity::kQuestionable : Validity::kValid)
        << names_of(tip.estimate->reasons);
  }
}

// The other view looks past it.
TEST(MirrorTest, ATipThatOneOfTwoViewsShowsHasTwoSides) {
  for (const EstimatorMode mode : {EstimatorMode::kJoint, EstimatorMode::kFilter}) {
    RoomDescription room = two_view_room();
    std::swap(room.cameras[0], room.cameras[1]);
    room.cameras[0].cy += 300;
    LooseTip one_view(mode, 1);
    LooseTip tip(mode, 1, room);
    for (int i = 0; i < 20; ++i) {
      one_view.measure(1);
      tip.measure(2);
    }
    EXPECT_GT(tip.depth_sigma_mm(), 0.8 * one_view.depth_sigma_mm()) << name_of(mode);
    EXPECT_TRUE(tip.estimate->reasons.has(Reason::kAmbiguous)) << name_of(mode);
  }
}

TEST(MirrorTest, OnceItsCoilIsBackTheTipHasOneSide) {
  for (const EstimatorMode mode : {EstimatorMode::kJoint, EstimatorMode::kFilter}) {
    for (const double side : {-1.0, 1.0}) {
      LooseTip tip(mode, side);
      for (int i = 0; i < 20; ++i) {
        tip.measure();
      }
      ASSERT_GT(tip.depth_sigma_mm(), 10) << name_of(mode) << side;
      tip.has_tip_coil = true;
      for (int i = 0; i < 10; ++i) {
        tip.measure(0);
      }
      EXPECT_FALSE(tip.estimate->reasons.has(Reason::kAmbiguous)) << name_of(mode) << side;
      EXPECT_LT(std::abs(tip.tip_error_mm().z()), 7) << name_of(mode) << side;
      EXPECT_LT(tip.depth_sigma_mm(), 7) << name_of(mode) << side << ": no image was needed";
    }
  }
}

// So little of it that the image is said not to show it, but enough to solve with.
TEST(MirrorTest, AnImageThatDoesNotShowTheTubeHasNoMirrorImageOfIt) {
  LooseTip em(EstimatorMode::kEm, 1);
  LooseTip joint(EstimatorMode::kJoint, 1);
  joint.hidden = {95, 205};
  em.measure();
  joint.measure();
  ASSERT_TRUE(joint.estimate->reasons.has(Reason::kImageLostTube));
  ASSERT_GT(joint.estimate->image_inlier_ratio, 0.5F);
  EXPECT_NEAR(joint.depth_sigma_mm(), em.depth_sigma_mm(), 1e-3);
}

}  // namespace
}  // namespace tubed
