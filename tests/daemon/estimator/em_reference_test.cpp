#include "daemon/estimator/reference/em_reference.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "daemon/estimator/coils/em_history.hpp"
#include "tests/daemon/estimator/reference_bench.hpp"

namespace tubed {
namespace {

constexpr int kPeriod_ms = 25;

MonotonicTime at(std::int64_t ms) { return from_ns(1'000'000'000 + ms * 1'000'000); }

/// A reference that is told of what a generator measures, one measurement every 25 ms.
class Followed {
 public:
  explicit Followed(MovingGenerator generator)
      : generator_(std::move(generator)), reference_(generator_.room.reference) {}

  std::optional<EmPlacement> take(EmFrame frame) {
    ms_ += kPeriod_ms;
    return reference_.take(frame);
  }
  std::optional<EmPlacement> take() { return take(measure()); }
  void take(int times) {
    for (int i = 0; i < times; ++i) take();
  }
  /// The next one, to be spoilt.
  EmFrame measure() { return generator_.measure(ms_ + kPeriod_ms); }
  EmFrame measure_without_reference() {
    EmFrame frame = measure();
    frame.coils[5] = CoilSample{};
    return frame;
  }

  /// How far the coils are from where they are, mm, taken to the frame of the registration.
  double error_mm(const EmPlacement& placement) {
    const EmFrame frame = generator_.measure(ms_);
    double greatest = 0;
    for (const CoilPlacement& coil : generator_.room.instruments.front().coils) {
      const CoilSample& sample = frame.coils[static_cast<std::size_t>(coil.sensor - 1)];
      const Eigen::Vector3d p_mm = placement.T_registered_em * sample.p_em_mm;
      greatest = std::max(greatest, (p_mm - arc_point(coil.offset_from_tip_mm)).norm());
    }
    return greatest;
  }

  [[nodiscard]] ReferenceDoubt doubt(int later_ms = 0) const { return reference_.doubt(at(ms_ + later_ms)); }
  [[nodiscard]] std::string words(int later_ms = 0) const {
    std::array<char, 256> text{};
    reference_.describe(at(ms_ + later_ms), text);
    return text.data();
  }
  MovingGenerator& generator() { return generator_; }
  [[nodiscard]] std::int64_t ms() const { return ms_; }

 private:
  MovingGenerator generator_;
  EmReference reference_;
  std::int64_t ms_ = 0;
};

class EmReferenceOfEitherKind : public testing::TestWithParam<bool> {
 protected:
  Followed followed{GetParam() ? MovingGenerator::with_coils() : MovingGenerator::with_sensor()};
};
INSTANTIATE_TEST_SUITE_P(SensorOrCoils, EmReferenceOfEitherKind, testing::Bool());

TEST(EmReference, WithoutOneEveryMeasurementIsWhereItWasRegistered) {
  MovingGenerator generator;
  EmReference reference(std::nullopt);
  generator.room.reference = ReferenceDescription{};  // measure() wants one
  generator.room.reference->sensors = {6};
  const auto placement = reference.take(generator.measure(0));
  ASSERT_TRUE(placement);
  EXPECT_EQ(placement->T_registered_em.matrix(), Eigen::Matrix4d::Identity());
  EXPECT_EQ(placement->error.covariance_at({100, 0, 0}), Eigen::Matrix3d::Zero());
  EXPECT_EQ(reference.doubt(at(10'000)), ReferenceDoubt::kNone);
}

TEST_P(EmReferenceOfEitherKind, CoilsStayWhereTheyAreWhenTheGeneratorWasMovedBefore) {
  followed.generator().push(80, 20);
  followed.take(20);
  const auto placement = followed.take();
  ASSERT_TRUE(placement);
  EXPECT_LT(followed.error_mm(*placement), 1e-4);
  EXPECT_EQ(followed.doubt(), ReferenceDoubt::kNone);
  EXPECT_EQ(followed.words(), "");
}

TEST_P(EmReferenceOfEitherKind, TheBeginningIsConfirmedByASecondMeasurement) {
  EXPECT_EQ(followed.doubt(), ReferenceDoubt::kLost);
  EXPECT_EQ(followed.words(), "") << "nothing was measured";
  EXPECT_FALSE(followed.take());
  EXPECT_EQ(followed.doubt(), ReferenceDoubt::kLost);
  EXPECT_TRUE(followed.take());
  EXPECT_EQ(followed.doubt(), ReferenceDoubt::kNone);
}

TEST_P(EmReferenceOfEitherKind, ADriftIsFollowedAndWhatItIsBehindIsSaid) {
  followed.take(20);
  for (int i = 0; i < 200; ++i) {
    followed.generator().push(0.25, 0);  // 10 mm/s
    followed.take();
  }
  followed.generator().push(0.25, 0);
  const auto placement = followed.take();
  ASSERT_TRUE(placement);
  const double error_mm = followed.error_mm(*placement);
  EXPECT_NEAR(error_mm, 0.88, 0.05) << "10 mm/s times (1 - k) / k dt";
  const double said_mm = std::sqrt(placement->error.covariance_at({0, 0, 0}).trace());
  EXPECT_GT(said_mm, error_mm);
  EXPECT_EQ(followed.doubt(), ReferenceDoubt::kNone);
}

TEST_P(EmReferenceOfEitherKind, WhatMovesFasterThanTheFilterFollowsIsDoubtful) {
  followed.take(40);
  for (int i = 0; i < 40; ++i) {
    followed.generator().push(0.75, 0);  // 30 mm/s: no two measurements are a jump
    followed.take();
  }
  EXPECT_EQ(followed.doubt(), ReferenceDoubt::kDoubtful) << "2.6 mm behind";
  EXPECT_NE(followed.words().find("moves"), std::string::npos) << followed.words();
  followed.take(20);
  EXPECT_EQ(followed.doubt(), ReferenceDoubt::kNone) << followed.words();
}

TEST_P(EmReferenceOfEitherKind, AJumpPlacesNothingUntilItIsConfirmedAndIsSaidForASecond) {
  followed.take(40);
  followed.generator().push(25, 4);
  EXPECT_FALSE(followed.take());
  EXPECT_EQ(followed.doubt(), ReferenceDoubt::kDoubtful);
  EXPECT_NE(followed.words().find("jumps"), std::string::npos) << followed.words();
  const auto placement = followed.take();
  ASSERT_TRUE(placement);
  EXPECT_LT(followed.error_mm(*placement), 1e-4) << "at once: a jump is not filtered";
  EXPECT_EQ(followed.doubt(), ReferenceDoubt::kDoubtful);
  EXPECT_NE(followed.words().find("has jumped by"), std::string::npos) << followed.words();
  followed.take(38);
  EXPECT_EQ(followed.doubt(), ReferenceDoubt::kDoubtful);
  followed.take(3);
  EXPECT_EQ(followed.doubt(), ReferenceDoubt::kNone) << followed.words();
}

TEST_P(EmReferenceOfEitherKind, ASingleWrongMeasurementMovesNothing) {
  followed.take(40);
  EmFrame frame = followed.measure();
  for (std::size_t sensor : {5U, 6U}) frame.coils[sensor].p_em_mm.x() += 12;
  EXPECT_FALSE(followed.take(frame));
  EXPECT_EQ(followed.doubt(), ReferenceDoubt::kDoubtful);
  const auto placement = followed.take();
  ASSERT_TRUE(placement);
  EXPECT_LT(followed.error_mm(*placement), 1e-4);
  EXPECT_EQ(followed.doubt(), ReferenceDoubt::kNone);
}

TEST_P(EmReferenceOfEitherKind, AnAbsenceIsDoubtfulAtOnceAndLostAfterItsTimeout) {
  followed.take(40);
  const double known_mm2 = followed.take()->error.covariance_at({0, 0, 0}).trace();
  auto placement = followed.take(followed.measure_without_reference());
  ASSERT_TRUE(placement) << "the pose before fills in";
  EXPECT_LT(followed.error_mm(*placement), 1e-4);
  EXPECT_GT(placement->error.covariance_at({0, 0, 0}).trace(), known_mm2);
  EXPECT_EQ(followed.doubt(), ReferenceDoubt::kDoubtful);
  EXPECT_NE(followed.words().find("is missing"), std::string::npos) << followed.words();
  for (int i = 0; i < 19; ++i) placement = followed.take(followed.measure_without_reference());
  EXPECT_TRUE(placement) << "500 ms";
  EXPECT_EQ(followed.doubt(), ReferenceDoubt::kDoubtful);
  EXPECT_FALSE(followed.take(followed.measure_without_reference()));
  EXPECT_EQ(followed.doubt(), ReferenceDoubt::kLost);
}

TEST_P(EmReferenceOfEitherKind, ComesBackByItselfWhereverTheGeneratorIsThen) {
  followed.take(40);
  for (int i = 0; i < 60; ++i) followed.take(followed.measure_without_reference());
  followed.generator().push(60, 10);
  EXPECT_FALSE(followed.take());
  EXPECT_EQ(followed.doubt(), ReferenceDoubt::kLost);
  const auto placement = followed.take();
  ASSERT_TRUE(placement);
  EXPECT_LT(followed.error_mm(*placement), 1e-4);
  EXPECT_EQ(followed.doubt(), ReferenceDoubt::kNone) << followed.words();
}

TEST_P(EmReferenceOfEitherKind, IsLostWhenTheTrackerSendsNothing) {
  followed.take(40);
  EXPECT_EQ(followed.doubt(500), ReferenceDoubt::kNone) << "nothing is known to be wrong with it";
  EXPECT_EQ(followed.doubt(501), ReferenceDoubt::kLost);
  EXPECT_NE(followed.words(501).find("was not seen"), std::string::npos) << followed.words(501);
}

TEST_P(EmReferenceOfEitherKind, OutOfTheVolumeAndRepeatedValuesAreNoPose) {
  followed.take(40);
  EmFrame frame = followed.measure();
  frame.coils[5].status = CoilStatus::kOutOfVolume;
  followed.take(frame);
  EXPECT_NE(followed.words().find("outside the tracker's volume"), std::string::npos) << followed.words();
  followed.take(1);
  frame = followed.measure();
  const auto same = frame.coils;
  for (int i = 0; i < 7; ++i) {
    EXPECT_EQ(followed.doubt(), ReferenceDoubt::kNone) << i;
    frame = followed.measure();
    std::copy_n(same.begin() + 5, 2, frame.coils.begin() + 5);
    followed.take(frame);
  }
  EXPECT_EQ(followed.doubt(), ReferenceDoubt::kDoubtful);
  EXPECT_NE(followed.words().find("repeats"), std::string::npos) << followed.words();
}

TEST_P(EmReferenceOfEitherKind, ASensorThatComesOffThePatientIsToldFromAGeneratorThatMoves) {
  followed.take(40);
  const RigidTransform fixed = followed.generator().T_world_reference;
  followed.generator().T_world_reference = fixed * RigidTransform(Eigen::Translation3d(0, 15, 0));
  followed.take(200);
  EXPECT_EQ(followed.doubt(), ReferenceDoubt::kDoubtful)
      << "until it is back, and longer than a jump is said";
  EXPECT_NE(followed.words().find("come off the patient"), std::string::npos) << followed.words();
  followed.generator().T_world_reference = fixed;
  followed.take(60);
  EXPECT_EQ(followed.doubt(), ReferenceDoubt::kNone) << followed.words();
}

TEST(EmReference, ASensorWithoutOrientationIsNoReference) {
  Followed followed{MovingGenerator::with_sensor()};
  for (int i = 0; i < 5; ++i) {
    EmFrame frame = followed.measure();
    frame.coils[5].x_axis_em.setConstant(CoilSample::kNaN);
    EXPECT_FALSE(followed.take(frame));
  }
  EXPECT_NE(followed.words().find("6 degrees of freedom"), std::string::npos) << followed.words();
}

TEST(EmReference, TwoCoilsThatMoveAgainstEachOtherAreNoReference) {
  Followed followed{MovingGenerator::with_coils()};
  followed.take(40);
  EmFrame frame = followed.measure();
  frame.coils[6].p_em_mm.x() += 2.5;  // tolerance: 2 mm
  followed.take(frame);
  EXPECT_EQ(followed.doubt(), ReferenceDoubt::kDoubtful);
  EXPECT_NE(followed.words().find("not the body that was registered"), std::string::npos) << followed.words();
  frame = followed.measure();
  frame.coils[5].tangent_em = rotation_by({0.09, 0, 0}) * frame.coils[5].tangent_em;  // 5 deg, tolerance: 4
  followed.take(frame);
  EXPECT_EQ(followed.doubt(), ReferenceDoubt::kDoubtful);
  frame = followed.measure();
  frame.coils[6].p_em_mm.x() += 1.5;
  followed.take(frame);
  EXPECT_EQ(followed.doubt(), ReferenceDoubt::kNone) << followed.words();
}

TEST(ReferenceError, GrowsWithTheLeverArm) {
  ReferenceError error;
  error.pivot_mm = {10, 0, 0};
  error.covariance.diagonal() << 1e-4, 1e-4, 1e-4, 0.04, 0.04, 0.04;  // 0.01 rad, 0.2 mm
  EXPECT_NEAR(error.covariance_at({10, 0, 0})(1, 1), 0.04, 1e-12);
  const Eigen::Matrix3d far = error.covariance_at({310, 0, 0});
  EXPECT_NEAR(far(0, 0), 0.04, 1e-12) << "along the lever nothing is added";
  EXPECT_NEAR(far(1, 1), 0.04 + 9, 1e-9) << "across it (0.01 rad * 300 mm)^2";
}

TEST(ReferenceError, IsTheSpreadOfPlacements) {
  MovingGenerator generator = MovingGenerator::with_sensor();
  generator.push(40, 30);
  generator.noise_mm = 0.5;
  generator.room.reference->time_constant_ms = 0;
  EmReference reference(generator.room.reference);
  const Eigen::Vector3d p_rest_mm(-200, 100, 30);
  const Eigen::Vector3d p_em_mm = generator.T_rest_em.inverse() * p_rest_mm;
  std::mt19937 random(7);
  std::normal_distribution<double> turn(0, 0.3 * std::numbers::pi / 180);
  Eigen::Matrix3d found = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d said = Eigen::Matrix3d::Zero();
  constexpr int kDraws = 4000;
  for (int draw = 0; draw < kDraws; ++draw) {
    EmFrame frame = generator.measure(25 * draw);
    const Eigen::Matrix3d away = rotation_by({turn(random), turn(random), turn(random)});
    frame.coils[5].tangent_em = away * frame.coils[5].tangent_em;
    frame.coils[5].x_axis_em = away * frame.coils[5].x_axis_em;
    if (const auto placement = reference.take(frame)) {
      const Eigen::Vector3d error_mm = placement->T_registered_em * p_em_mm - p_rest_mm;
      found += error_mm * error_mm.transpose() / kDraws;
      said += placement->error.covariance_at(p_rest_mm) / kDraws;
    }
  }
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(std::sqrt(found(axis, axis) / said(axis, axis)), 1, 0.05) << "axis " << axis;
  }
  EXPECT_NEAR(found(0, 1) / said(0, 1), 1, 0.2) << "correlated as said";
}

TEST(ReferenceError, OfOneKnownErrorIsWhereItTakesAPoint) {
  const RigidTransform T_em_body(Eigen::Translation3d(30, -20, 50) *
                                 Eigen::AngleAxisd(0.5, Eigen::Vector3d(1, 1, 2).normalized()));
  PoseError w_and_v;
  w_and_v << 2e-5, -1e-5, 3e-5, 4e-3, 5e-3, -2e-3;
  const RigidTransform T_true = moved_by(w_and_v, T_em_body);
  const Eigen::Vector3d p_em_mm(-100, 150, 80);
  const Eigen::Vector3d away_mm = T_em_body * T_true.inverse() * p_em_mm - p_em_mm;
  const ReferenceError error{T_em_body.translation(), w_and_v * w_and_v.transpose()};
  EXPECT_LT((error.covariance_at(p_em_mm) - away_mm * away_mm.transpose()).norm(),
            1e-3 * away_mm.squaredNorm());
}

TEST(ReferenceError, InAnotherFrameIsTheSame) {
  ReferenceError error;
  error.pivot_mm = {10, 20, 30};
  error.covariance.diagonal() << 1e-4, 2e-4, 3e-4, 0.01, 0.02, 0.03;
  error.covariance(0, 4) = error.covariance(4, 0) = 5e-4;
  const RigidTransform T(Eigen::Translation3d(5, -7, 9) *
                         Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()));
  const Eigen::Vector3d p_mm(-50, 80, 120);
  const Eigen::Matrix3d there = T.linear() * error.covariance_at(p_mm) * T.linear().transpose();
  EXPECT_LT((error.in(T).covariance_at(T * p_mm) - there).norm(), 1e-10);
}

TEST(EmHistoryWithAReference, GivesEachMeasurementThePlacementOfItsOwnTime) {
  MovingGenerator generator = MovingGenerator::with_sensor();
  const auto history = std::make_unique<EmHistory>(generator.room.reference);
  for (int ms = 0; ms < 500; ms += kPeriod_ms) EXPECT_TRUE(history->add(generator.measure(ms)));
  const RigidTransform before = generator.T_rest_em;
  generator.push(50, 10);
  for (int ms = 500; ms < 800; ms += kPeriod_ms) EXPECT_TRUE(history->add(generator.measure(ms)));
  const auto away = [&](std::int64_t ms, const RigidTransform& T_rest_em) {
    const EmFrame* frame = history->newest_until(at(ms));
    return difference_of(T_rest_em, history->placement(frame).T_registered_em).norm();
  };
  EXPECT_LT(away(475, before), 1e-4);
  EXPECT_LT(away(775, generator.T_rest_em), 1e-4);
  EXPECT_EQ(history->newest_until(at(510))->measured, at(475)) << "what was not confirmed is not kept";
  EXPECT_FALSE(history->add(generator.measure(100))) << "time goes forward";
}

}  // namespace
}  // namespace tubed
