#include "idl/geometry/rigid_transform.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <limits>
#include <numbers>
#include <random>
#include <string>

namespace tubed {
namespace {

Eigen::Matrix4d some_rigid_matrix() {
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  matrix.topLeftCorner<3, 3>() =
      Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
  matrix.topRightCorner<3, 1>() << 10, -20, 1200;
  return matrix;
}

/// The refusal of a matrix, or "accepted".
std::string refusal(const Eigen::Matrix4d& matrix) {
  std::string why;
  return rigid_from_matrix(matrix, 1e-3, why) ? "accepted" : why;
}

bool says(const std::string& text, const std::string& words) { return text.find(words) != std::string::npos; }

TEST(RigidFromMatrix, AWellWrittenMatrixIsTakenAsItIs) {
  std::string why = "left over";
  const auto transform = rigid_from_matrix(some_rigid_matrix(), 1e-3, why);

  ASSERT_TRUE(transform) << why;
  EXPECT_TRUE(transform->matrix().isApprox(some_rigid_matrix(), 1e-14));
  EXPECT_EQ(why, "");
}

TEST(RigidFromMatrix, ARotationRoundedToFourDigitsIsMadeExactlyOrthonormal) {
  Eigen::Matrix4d rounded = some_rigid_matrix();
  rounded.topLeftCorner<3, 3>() = (rounded.topLeftCorner<3, 3>() * 1e4).array().round().matrix() / 1e4;
  std::string why;

  const auto transform = rigid_from_matrix(rounded, 1e-3, why);

  ASSERT_TRUE(transform) << why;
  const Eigen::Matrix3d R = transform->linear();
  EXPECT_LT((R.transpose() * R - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff(), 1e-15 * 4);
  EXPECT_NEAR(R.determinant(), 1, 1e-14);
  EXPECT_LT((R - some_rigid_matrix().topLeftCorner<3, 3>()).cwiseAbs().maxCoeff(), 1e-4);
}

TEST(RigidFromMatrix, AReflectionIsRefusedByName) {
  Eigen::Matrix4d mirrored = some_rigid_matrix();
  mirrored.col(0) *= -1;

  EXPECT_TRUE(says(refusal(mirrored), "reflection")) << refusal(mirrored);
}

TEST(RigidFromMatrix, AScaledRotationIsRefusedWithTheSizeOfTheError) {
  Eigen::Matrix4d scaled = some_rigid_matrix();
  scaled.topLeftCorner<3, 3>() *= 1.1;  // R^T R = 1.21 I

  EXPECT_TRUE(says(refusal(scaled), "not orthonormal")) << refusal(scaled);
  EXPECT_TRUE(says(refusal(scaled), "0.21")) << refusal(scaled);
}

TEST(RigidFromMatrix, ATransposedMatrixIsRefusedForItsLastRow) {
  const Eigen::Matrix4d transposed = some_rigid_matrix().transpose();

  EXPECT_TRUE(says(refusal(transposed), "last row")) << refusal(transposed);
}

TEST(RigidFromMatrix, ANumberThatIsNotOneIsRefusedWhereverItStands) {
  for (int element = 0; element < 16; ++element) {
    for (const double bad :
         {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
      Eigen::Matrix4d matrix = some_rigid_matrix();
      matrix(element) = bad;

      EXPECT_TRUE(says(refusal(matrix), "not a finite number")) << element << ": " << refusal(matrix);
    }
  }
}

TEST(RotationFromZTo, TurnsZOntoAnyDirectionWithoutTurningAboutIt) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  for (int round = 0; round < 1000; ++round) {
    const Eigen::Vector3d direction(normal(random), normal(random), normal(random));

    const Eigen::Quaterniond rotation = rotation_from_z_to(direction);

    EXPECT_NEAR(rotation.norm(), 1, 1e-14);
    EXPECT_LT((rotation * Eigen::Vector3d::UnitZ() - direction.normalized()).norm(), 1e-14);
    EXPECT_NEAR(rotation.z(), 0, 1e-14);  // the shortest: the axis is normal to z
  }
}

TEST(RotationFromZTo, HasAnAnswerAtBothPoles) {
  EXPECT_TRUE(rotation_from_z_to({0, 0, 5}).isApprox(Eigen::Quaterniond::Identity(), 1e-15));

  const Eigen::Quaterniond half_turn = rotation_from_z_to({0, 0, -2});
  EXPECT_NEAR(std::abs(half_turn.x()), 1, 1e-15);
  EXPECT_LT((half_turn * Eigen::Vector3d::UnitZ() + Eigen::Vector3d::UnitZ()).norm(), 1e-15);
}

TEST(RotationFromZTo, StaysExactRightBesideThePoles) {
  for (const double sideways : {1e-3, 1e-8, 1e-12, 1e-200}) {
    for (const double z : {1.0, -1.0}) {
      const Eigen::Vector3d direction(sideways, -2 * sideways, z);

      const Eigen::Vector3d turned = rotation_from_z_to(direction) * Eigen::Vector3d::UnitZ();

      EXPECT_LT((turned - direction.normalized()).norm(), 1e-15) << sideways << " beside " << z;
    }
  }
}

}  // namespace
}  // namespace tubed
