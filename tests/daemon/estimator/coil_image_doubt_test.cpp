// What CoilImageAgreement adds to the covariance of a shape.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <numbers>

#include "daemon/estimator/agreement/room_errors.hpp"
#include "tests/daemon/estimator/agreement_bench.hpp"

namespace tubed {
namespace {

RoomDescription registered_to(double sigma_mm) {
  RoomDescription room = one_view_room();
  room.registration_residual_mm = sigma_mm * std::numbers::sqrt3;
  return room;
}

// One view sees nothing of its own depth: where it is wrong across, it may be as wrong there.
TEST(CoilImageDoubt, WhatIsWrongAcrossIsDoubtedInDepth) {
  AgreementBench bench;
  EXPECT_LT(bench.sigma_mm(200).z(), 1.1 * RoomErrors().unchecked_shift_mm);
  bench.watch(5, registered_wrong({5, 3, 0}, 0));
  EXPECT_GT(bench.sigma_mm(200).z(), 1.6 * RoomErrors().unchecked_shift_mm);
}

// Which of the two is wrong nobody has said.
TEST(CoilImageDoubt, WhatLiesBetweenCoilsAndImagesMayBeThePosesError) {
  AgreementBench bench;
  EXPECT_LT(bench.watch(5, as_it_is).verdict().shift_mm.norm(), 0.5);
  const Eigen::Vector2d fits_mm = bench.sigma_mm(kMiddle_mm).head<2>();
  EXPECT_LT(fits_mm.maxCoeff(), 1.2);
  for (const Eigen::Vector3d& shift_mm : {Eigen::Vector3d(5, 3, 0), Eigen::Vector3d(0, -4, 0)}) {
    AgreementBench wrong;
    wrong.watch(5, registered_wrong(shift_mm, 0));
    const Eigen::Vector2d sigma_mm = wrong.sigma_mm(kMiddle_mm).head<2>();
    for (int axis = 0; axis < 2; ++axis) {
      const double seen_mm = std::abs(shift_mm[axis]);
      EXPECT_GT(sigma_mm[axis], 0.6 * seen_mm) << shift_mm.transpose() << ", axis " << axis;
      EXPECT_LT(sigma_mm[axis], 0.85 * seen_mm + fits_mm[axis] + 0.3)
          << shift_mm.transpose() << ", axis " << axis;
    }
  }
}

TEST(CoilImageDoubt, APoseThatIsStatedToBeGoodHoldsTheShapeAcross) {
  AgreementBench bench(well_posed(one_view_room()));
  bench.watch(5, registered_wrong({5, 3, 0}, 0));
  EXPECT_LT(bench.sigma_mm(kMiddle_mm).head<2>().maxCoeff(), 1.2);
  EXPECT_GT(bench.sigma_mm(kMiddle_mm).z(), 3);
}

TEST(CoilImageDoubt, ARegistrationThatIsStatedToBeGoodLeavesAllOfItToThePose) {
  AgreementBench bench(registered_to(0.3));
  bench.watch(5, registered_wrong({5, 3, 0}, 0));
  EXPECT_NEAR(bench.sigma_mm(kMiddle_mm).x(), 5, 1);
}

TEST(CoilImageDoubt, BeforeAnythingWasSeenARegistrationIsDoubtedAsWhatWasNeverChecked) {
  const double usual_mm = RoomErrors().unchecked_shift_mm;
  EXPECT_GT(usual_mm, RoomErrors().shift_mm);
  EXPECT_TRUE(AgreementBench().sigma_mm(100).isApprox(Eigen::Vector3d::Constant(usual_mm), 1e-9));
  EXPECT_TRUE(
      AgreementBench(registered_to(0.4)).sigma_mm(100).isApprox(Eigen::Vector3d::Constant(0.4), 1e-9));
}

/// How far that point of the arc lies from where the camera looks, across the view.
double from_axis_mm(double s_mm) {
  return lateral_mm(Camera(one_view_room().cameras.front()), arc_point(s_mm)).norm();
}

// A registration that is off in depth alone looks like this.
TEST(CoilImageDoubt, ThatAllIsRightAcrossSaysNothingOfTheDepth) {
  for (const double lasting_mm : {0.5, 4.0}) {
    AgreementBench bench;
    bench.noise_mm = 0.1;
    bench.lasting_mm = lasting_mm;
    EXPECT_FALSE(bench.watch(5, as_it_is).disagree());
    EXPECT_GT(bench.sigma_mm(kMiddle_mm).z(), 0.85 * RoomErrors().unchecked_shift_mm) << lasting_mm;
    // Which the image holds, up to its scale.
    EXPECT_LT(bench.sigma_mm(kMiddle_mm).head<2>().maxCoeff(),
              std::hypot(0.3, RoomErrors().unchecked_magnification * from_axis_mm(kMiddle_mm)));
  }
}

TEST(CoilImageDoubt, WhatACalibrationStatesOfARegistrationIsBelievedInDepth) {
  AgreementBench bench(registered_to(0.4));
  EXPECT_FALSE(bench.watch(5, as_it_is).disagree());
  EXPECT_LT(bench.sigma_mm(kMiddle_mm).z(), 0.5);
}

// Also after no image holds the tube any more.
TEST(CoilImageDoubt, ASecondViewChecksTheDepthOfTheRegistration) {
  AgreementBench bench(two_views());
  const CoilImageAgreement& agreement = bench.watch(5, as_it_is);
  const Eigen::Matrix3d later =
      agreement.doubt({kMiddle_mm, arc_point(kMiddle_mm), -arc_tangent_to_tip(kMiddle_mm)},
                      bench.now() + std::chrono::milliseconds(1100));
  EXPECT_LT(std::sqrt(later.diagonal().maxCoeff()), 0.6 * RoomErrors().unchecked_shift_mm);
}

// An end of the tube is as far off as the registration's turn about the middle makes it.
TEST(CoilImageDoubt, TheEndsOfTheTubeAreDoubtedMoreThanItsMiddle) {
  AgreementBench bench;
  bench.lasting_mm = 4;
  bench.watch(5, as_it_is);
  EXPECT_GT(bench.sigma_mm(0).z(), 1.2 * bench.sigma_mm(190).z());
}

TEST(CoilImageDoubt, WhatNoImageHasHeldForASecondIsDoubtedAcross) {
  AgreementBench bench;
  const CoilImageAgreement& agreement = bench.watch(5, registered_wrong({5, 3, 0}, 0));
  const Eigen::Matrix3d later = agreement.doubt({200, arc_point(200), -arc_tangent_to_tip(200)},
                                                bench.now() + std::chrono::milliseconds(1100));
  EXPECT_GT(std::sqrt(later.diagonal().head<2>().sum()), 5);
}

// All coils have gone elsewhere since.
TEST(CoilImageDoubt, WhatImagesHeldBeforeIsDoubtedOnceItIsForgotten) {
  AgreementBench bench;
  bench.watch(5, registered_wrong({5, 3, 0}, 0));
  const double held_mm = bench.sigma_mm(kMiddle_mm).head<2>().norm();
  bench.forget_held();
  EXPECT_GT(bench.sigma_mm(kMiddle_mm).head<2>().norm(), held_mm + 1);
  bench.watch(0.2, registered_wrong({5, 3, 0}, 0));
  EXPECT_NEAR(bench.sigma_mm(kMiddle_mm).head<2>().norm(), held_mm, 0.3);
}

// An image holds the shape across itself, whatever coils say, and not in depth.
TEST(CoilImageDoubt, WhatElseIsOffOfCoilsAddsWhereNoImageHoldsTheShape) {
  AgreementBench bench;
  const CoilImageAgreement& agreement = bench.watch(5, as_it_is);
  const auto sigma_mm = [&](const Eigen::Vector3d& off_mm) -> Eigen::Vector3d {
    const CoilImageAgreement::Place place{kMiddle_mm, arc_point(kMiddle_mm), -arc_tangent_to_tip(kMiddle_mm),
                                          off_mm * off_mm.transpose()};
    return agreement.doubt(place, bench.now()).diagonal().cwiseSqrt();
  };
  const Eigen::Vector3d without_mm = sigma_mm({0, 0, 0});
  EXPECT_GT(sigma_mm({0, 0, 6}).z(), 0.9 * std::hypot(6, without_mm.z()));
  EXPECT_LT((sigma_mm({6, 0, 0}) - without_mm).norm(), 0.5);
}

// Where it is too dark to see the tube its shape goes with the coils, wherever they are.
TEST(CoilImageDoubt, WhatAnImageIsTooDarkToShowIsDoubtedAcross) {
  RoomDescription room = well_posed(one_view_room());
  room.cameras.front().focal_sigma = 0.002;  // so that the sides are as good as the image
  AgreementBench bright(room);
  AgreementBench dark(room);
  dark.dark_from_mm = 130;
  bright.watch(5, registered_wrong({5, 3, 0}, 0));
  dark.watch(5, registered_wrong({5, 3, 0}, 0));
  const auto across_mm = [](const AgreementBench& bench, double s_mm) {
    return bench.sigma_mm(s_mm).head<2>().maxCoeff();
  };
  EXPECT_GT(across_mm(dark, 300), 2 * across_mm(bright, 300));
  EXPECT_NEAR(across_mm(dark, 60), across_mm(bright, 60), 0.3);
}

TEST(CoilImageDoubt, AnEndThatLiesElsewhereIsDoubtedAlongTheTube) {
  AgreementBench bench;
  bench.end_mm = 3;
  bench.watch(5, as_it_is);
  const Eigen::Vector3d along = arc_tangent_to_tip(200);
  EXPECT_NEAR(bench.sigma_mm(200).dot(along.cwiseAbs()), 3, 1.5);
}

double sigma_across_mm(const AgreementBench& bench, double s_mm) {
  return bench.sigma_mm(s_mm).head<2>().norm();  // the camera looks along z
}

TEST(CoilImageDoubt, SigmaAcrossHasAFocalLengthThatIsOffByWhatIsStated) {
  AgreementBench bench;
  bench.image_scale = 1 / 1.01;
  bench.shows_end = false;
  EXPECT_FALSE(bench.watch(1, as_it_is).disagree());
  EXPECT_GT(sigma_across_mm(bench, 0), 0.7 * 0.01 * from_axis_mm(0)) << from_axis_mm(0);
}

TEST(CoilImageDoubt, SigmaAcrossOfARoomThatFitsIsNoMoreThanWhatIsStated) {
  AgreementBench bench;
  bench.watch(20, as_it_is);
  EXPECT_LT(sigma_across_mm(bench, 0), 0.01 * from_axis_mm(0));
}

// Where what coils may be off by hides most of it.
TEST(CoilImageDoubt, SigmaAcrossHasAFocalLengthOfWhichNothingIsStatedOrChecked) {
  RoomDescription stated = one_view_room();
  stated.cameras.front().focal_sigma = 0.004;
  const auto across_mm = [](const RoomDescription& room) {
    AgreementBench bench(room);
    bench.lasting_mm = 8;
    EXPECT_FALSE(bench.watch(5, as_it_is).disagree());
    return sigma_across_mm(bench, 0);
  };
  EXPECT_GT(across_mm(one_view_room()), 1.2 * RoomErrors().magnification * from_axis_mm(0));
  EXPECT_LT(across_mm(stated), 0.6 * across_mm(one_view_room()));
}

}  // namespace
}  // namespace tubed
