#include "drivers/laboratory/fluoroscope/ray_caster.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/drivers/laboratory/fluoroscope/small_patient.hpp"

namespace tubed {
namespace {

constexpr float kMu = 0.02F;

TEST(RayCaster, ARayAlongAnAxisSumsAttenuationTimesTheWayThroughTheVoxels) {
  const AttenuationVolume volume = cube_of(41, 2, kMu);
  const RayCaster caster(volume);

  // 41 planes stand for 41 voxels of 2 mm.
  for (int number = 0; number < 3; ++number) {
    const Eigen::Vector3d axis = Eigen::Vector3d::Unit(number);
    const Eigen::Vector3d source =
        -500 * axis + Eigen::Vector3d(3.1, -2.7, 4.3).cwiseProduct(Eigen::Vector3d::Ones() - axis);
    EXPECT_NEAR(caster.line_integral(source, axis), 82 * kMu, 1e-5) << axis.transpose();
    EXPECT_NEAR(caster.line_integral(-source, -axis), 82 * kMu, 1e-5);
  }
}

TEST(RayCaster, AnObliqueRayThroughABallHasItsChordWhateverItsDirection) {
  constexpr double kRadius_mm = 30;
  AttenuationVolume volume = cube_of(81, 1, 0);
  for (int k = 0; k < 81; ++k) {
    for (int j = 0; j < 81; ++j) {
      for (int i = 0; i < 81; ++i) {
        const double outside = Eigen::Vector3d(i - 40, j - 40, k - 40).norm() - kRadius_mm;
        volume.set(i, j, k, kMu * static_cast<float>(std::clamp(0.5 - outside, 0.0, 1.0)));
      }
    }
  }
  const RayCaster caster(volume);
  for (int turn = 0; turn < 12; ++turn) {
    const Eigen::Vector3d direction =
        Eigen::Vector3d(std::cos(turn), std::sin(turn), 0.3 * std::cos(3.0 * turn)).normalized();
    for (const double distance : {0.0, 12.0, 25.0}) {
      const Eigen::Vector3d source = -400 * direction + distance * direction.unitOrthogonal();
      const double chord = 2 * std::sqrt(kRadius_mm * kRadius_mm - distance * distance);
      EXPECT_NEAR(caster.line_integral(source, direction), kMu * chord, 0.012 * kMu * chord)
          << turn << ' ' << distance;
    }
  }
}

TEST(RayCaster, AVolumeThatIsTurnedAndShiftedIsSeenTurnedAndShifted) {
  AttenuationVolume upright = cube_of(21, 3, kMu);
  RigidTransform T_room_volume(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()));
  T_room_volume.translation() = Eigen::Vector3d(40, -70, 15);
  AttenuationVolume turned(upright.size(), upright.spacing_mm(), T_room_volume * upright.T_room_volume());
  for (int k = 0; k < 21; ++k) {
    for (int j = 0; j < 21; ++j) {
      for (int i = 0; i < 21; ++i) {
        turned.set(i, j, k, upright.at(i, j, k));
      }
    }
  }
  const Eigen::Vector3d source(-300, 20, 10);
  const Eigen::Vector3d direction(1, -0.05, -0.02);

  EXPECT_NEAR(RayCaster(turned).line_integral(T_room_volume * source, T_room_volume.linear() * direction),
              RayCaster(upright).line_integral(source, direction), 1e-5);
}

TEST(RayCaster, ARayBesideOrBehindTheVolumeSeesNothing) {
  const AttenuationVolume volume = cube_of(21, 2, kMu);
  const RayCaster caster(volume);

  EXPECT_EQ(caster.line_integral({-100, 30, 0}, {1, 0, 0}), 0);
  EXPECT_EQ(caster.line_integral({-100, 0, 0}, {-1, 0, 0}), 0);
  EXPECT_EQ(caster.line_integral({-100, 0, 0}, {0, 0, 1}), 0);
}

TEST(RayCaster, MovedTissueIsSeenWhereItWent) {
  // Attenuation grows along z: what moves toward the feet brings the denser tissue from above down.
  AttenuationVolume volume = cube_of(61, 4, 0);
  for (int k = 0; k < 61; ++k) {
    for (int j = 0; j < 61; ++j) {
      for (int i = 0; i < 61; ++i) {
        volume.set(i, j, k, 1e-4F * static_cast<float>(k));
      }
    }
  }
  MotionSettings settings;
  settings.heart_centre_room_mm.setZero();
  settings.breathing_phases = 1;
  const BodyMotion motion(settings);
  const Eigen::Vector3d source(1, -900, -100);
  const Eigen::Vector3d direction(0.001, 1, 0.002);
  std::vector<float> changes(4);

  RayCaster(volume).changes(source, direction, motion, {0, 1}, changes);

  // 1e-4 / mm a voxel of 4 mm, times how far each of the tissue's places came down, along the ray.
  double expected = 0;
  for (double y = -120; y <= 120; y += 0.5) {
    const Eigen::Vector3d p = source + (y + 900) * direction;
    expected -= 0.5 * 1e-4 / 4 * motion.displacement(p.cast<float>(), {0, 1}).z();
  }
  ASSERT_GT(expected, 0.004);
  EXPECT_NEAR(changes[3], expected, 0.02 * expected);
  EXPECT_NEAR(changes[0], expected / 4, 0.02 * expected);
}

TEST(RayCaster, ARayFarFromTheHeartDoesNotFeelItsBeat) {
  const AttenuationVolume volume = cube_of(61, 4, kMu);
  const BodyMotion motion{MotionSettings()};
  std::vector<float> changes(2, 1.0F);
  RayCaster(volume).changes({-100, -900, 100}, {0, 1, 0}, motion, {1, 0}, changes);
  EXPECT_EQ(changes, std::vector<float>(2));
}

}  // namespace
}  // namespace tubed
