#include "daemon/estimator/paper/paper_image_mle.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/daemon/estimator/simulated_tube.hpp"

namespace tubed {
namespace {

/// The arc dark on noise, with the vesselness of a perfect filter.
ImageMeasurement noisy_image(const RoomDescription& room) {
  ImageMeasurement image = image_of_arc(room, from_ns(1));
  std::mt19937 random(3);
  std::normal_distribution<float> noise(0, 6);
  for (std::size_t i = 0; i < image.grey.size(); ++i) {
    image.grey[i] = 120 - 40 * image.vesselness[i] + noise(random);
  }
  return image;
}

struct Bench {
  explicit Bench(PaperSettings paper = {}) { settings.paper = paper; }
  Eigen::Matrix3Xd true_knot_points() const {
    Eigen::Matrix3Xd K(3, curve.count());
    for (int i = 0; i < curve.count(); ++i) K.col(i) = arc_point(curve.knot_point_s_mm(i));
    return K;
  }
  /// Greatest distance in the image between the curve and the arc, where both are well inside it, px.
  double worst_px(const Eigen::Matrix3Xd& K) const {
    const Camera camera(room.cameras.front());
    double worst = 0;
    for (double s = 5; s <= 375; s += 5) {
      const auto truth = camera.project(arc_point(s));
      const auto found = camera.project(K * curve.weights(s));
      const Eigen::Vector2d along = (truth->J_image_world * arc_tangent_to_tip(s)).normalized();
      if (camera.contains(truth->p_image_px, 20)) {
        worst = std::max(
            worst,
            std::abs((found->p_image_px - truth->p_image_px).dot(Eigen::Vector2d(-along.y(), along.x()))));
      }
    }
    return worst;
  }
  RoomDescription room = one_view_room();
  EstimatorSettings settings;
  KnotCurve curve{20, 380};
  ImageMeasurement image = noisy_image(room);
};

TEST(PaperImageMle, BringsADisplacedShapeOntoItsImage) {
  Bench bench;
  PaperImageMle mle(bench.settings, bench.room.instruments.front(), bench.room.cameras.front(), bench.curve);
  const Eigen::Matrix3Xd K_em = bench.true_knot_points().colwise() + Eigen::Vector3d(2, -1.5, 1);
  Eigen::Matrix3Xd K = K_em;
  ASSERT_GT(bench.worst_px(K), 3);
  const PaperMleOutcome outcome = mle.search(bench.image, K_em, true, K);
  EXPECT_TRUE(outcome.looked);
  EXPECT_GT(outcome.agreeing_ratio, 0.95);
  EXPECT_LT(bench.worst_px(K), 0.5);
}

TEST(PaperImageMle, FromTheProjectionOfTheCoilsItComesAsFarWhenThatIsNear) {
  PaperSettings as_printed;
  as_printed.mle_start = PaperMleStart::kEm;
  as_printed.mle_prior = PaperMlePrior::kNone;
  Bench bench(as_printed);
  PaperImageMle mle(bench.settings, bench.room.instruments.front(), bench.room.cameras.front(), bench.curve);
  const Eigen::Matrix3Xd K_em = bench.true_knot_points().colwise() + Eigen::Vector3d(0.6, -0.4, 1);
  Eigen::Matrix3Xd K = K_em;
  mle.search(bench.image, K_em, true, K);
  EXPECT_LT(bench.worst_px(K), 1.5);
}

TEST(PaperImageMle, KnotPointsKeepTheirDepth) {
  Bench bench;
  PaperImageMle mle(bench.settings, bench.room.instruments.front(), bench.room.cameras.front(), bench.curve);
  const Eigen::Matrix3Xd K_em = bench.true_knot_points().colwise() + Eigen::Vector3d(2, -1.5, 1);
  Eigen::Matrix3Xd K = K_em;
  mle.search(bench.image, K_em, true, K);
  EXPECT_LT((K - K_em).row(2).cwiseAbs().maxCoeff(), 1e-9) << "the camera looks along z";
}

TEST(PaperImageMle, WhatTheImageDoesNotShowStaysWithTheCoils) {
  Bench bench;
  bench.room.cameras.front().T_camera_world.translation().x() = 130;  // most of the arc leaves the image
  bench.image = noisy_image(bench.room);
  PaperImageMle mle(bench.settings, bench.room.instruments.front(), bench.room.cameras.front(), bench.curve);
  const Camera camera(bench.room.cameras.front());
  const Eigen::Matrix3Xd K_em = bench.true_knot_points().colwise() + Eigen::Vector3d(1, 1, 0);
  Eigen::Matrix3Xd K = K_em;
  const PaperMleOutcome outcome = mle.search(bench.image, K_em, true, K);
  ASSERT_TRUE(outcome.looked);
  EXPECT_LT(outcome.in_view_ratio, 0.8);
  int far_outside = 0;
  for (int i = 0; i < bench.curve.count(); ++i) {
    if (!camera.contains(camera.project(K_em.col(i))->p_image_px, -100)) {
      ++far_outside;
      EXPECT_LT((K.col(i) - K_em.col(i)).norm(), 0.5) << "knot point " << i;
    }
  }
  EXPECT_GT(far_outside, 0);
}

TEST(PaperImageMle, OutsideTheImageThereIsNothingToLookAt) {
  Bench bench;
  PaperImageMle mle(bench.settings, bench.room.instruments.front(), bench.room.cameras.front(), bench.curve);
  const Eigen::Matrix3Xd K_em = bench.true_knot_points().colwise() + Eigen::Vector3d(900, 0, 0);
  Eigen::Matrix3Xd K = K_em;
  EXPECT_FALSE(mle.search(bench.image, K_em, true, K).looked);
  EXPECT_EQ(K, K_em);
}

TEST(PaperImageMle, AnEmptyImageDoesNotAgree) {
  Bench bench;
  std::mt19937 random(5);
  std::normal_distribution<float> noise(0, 6);
  std::uniform_real_distribution<float> speckle(0, 0.1F);
  for (std::size_t i = 0; i < bench.image.grey.size(); ++i) {
    bench.image.grey[i] = 120 + noise(random);
    bench.image.vesselness[i] = random() % 8 == 0 ? speckle(random) : 0;
  }
  PaperImageMle mle(bench.settings, bench.room.instruments.front(), bench.room.cameras.front(), bench.curve);
  const Eigen::Matrix3Xd K_em = bench.true_knot_points();
  Eigen::Matrix3Xd K = K_em;
  EXPECT_LT(mle.search(bench.image, K_em, true, K).agreeing_ratio, 0.8);
}

}  // namespace
}  // namespace tubed
