// What coils share, against shifts and turns written out.
#include "daemon/estimator/coils/shared_coil_errors.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <vector>

#include "tests/daemon/estimator/simulated_tube.hpp"

namespace tubed {
namespace {

constexpr double kShared = 0.9;
constexpr std::array<double, 5> kOwn{0.5, 0.5, 0.5, 0.5, 0.5};
constexpr std::array<double, 5> kDifferent{0.5, 0.6, 0.2, 0.3, 0.4};

std::vector<Eigen::Vector3d> places() {
  const RoomDescription room = one_view_room();
  std::vector<Eigen::Vector3d> places_mm;
  for (const CoilPlacement& coil : room.instruments.front().coils) {
    places_mm.push_back(arc_point(coil.offset_from_tip_mm));
  }
  return places_mm;
}

/// The errors that a registration makes which is off by a shift and a turn.
Eigen::VectorXd rigid(const std::vector<Eigen::Vector3d>& places_mm, const Eigen::Vector3d& shift_mm,
                      const Eigen::Vector3d& turn_rad) {
  Eigen::VectorXd errors(3 * static_cast<Eigen::Index>(places_mm.size()));
  for (std::size_t i = 0; i < places_mm.size(); ++i) {
    errors.segment<3>(3 * static_cast<Eigen::Index>(i)) = shift_mm + turn_rad.cross(places_mm[i]);
  }
  return errors;
}

Eigen::VectorXd aged(const std::vector<Eigen::Vector3d>& places_mm, std::span<const double> own,
                     Eigen::VectorXd errors) {
  Eigen::MatrixXd scratch(6, 1);
  SharedCoilErrors(places_mm).age(kShared, own, errors, scratch);
  return errors;
}

TEST(SharedCoilErrors, AShiftAndATurnAreKeptAsWhatAllShare) {
  const Eigen::VectorXd errors = rigid(places(), {1, -2, 3}, {0.01, 0.02, -0.005});
  EXPECT_LT((aged(places(), kOwn, errors) - kShared * errors).norm(), 1e-9);
  EXPECT_LT((aged(places(), kDifferent, errors) - kShared * errors).norm(), 1e-9);
}

TEST(SharedCoilErrors, WhatIsNeitherIsKeptAsEachCoilsOwn) {
  const SharedCoilErrors shared(places());
  Eigen::VectorXd errors = Eigen::VectorXd::Zero(15);
  errors[7] = 4;  // one coil alone
  errors -= shared.J() * (shared.J().transpose() * errors);
  EXPECT_GT(errors.norm(), 2);
  EXPECT_LT((aged(places(), kOwn, errors) - 0.5 * errors).norm(), 1e-9);
}

TEST(SharedCoilErrors, ItIsTheMatrixThatIsPromised) {
  const SharedCoilErrors shared(places());
  const Eigen::MatrixXd R = shared.J() * shared.J().transpose();
  const Eigen::MatrixXd I = Eigen::MatrixXd::Identity(15, 15);
  Eigen::MatrixXd D = Eigen::MatrixXd::Zero(15, 15);
  for (Eigen::Index i = 0; i < 5; ++i) {
    D.diagonal().segment<3>(3 * i).setConstant(kDifferent[static_cast<std::size_t>(i)]);
  }
  Eigen::MatrixXd A = I;
  Eigen::MatrixXd scratch(6, 15);
  shared.age(kShared, kDifferent, A, scratch);
  EXPECT_LT((A - (kShared * R + (I - R) * D * (I - R))).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_LT((shared.J().transpose() * shared.J() - Eigen::MatrixXd::Identity(6, 6)).cwiseAbs().maxCoeff(),
            1e-12);
}

// A turn about the line moves nothing: there are five columns, and the sixth is zero.
TEST(SharedCoilErrors, CoilsOnALineShareFiveNumbers) {
  const std::vector<Eigen::Vector3d> line{{0, 0, 10}, {0, 0, 90}, {0, 0, 170}};
  const Eigen::VectorXd errors = rigid(line, {1, 2, 3}, {0.02, -0.01, 0});
  const std::array<double, 3> own{0.5, 0.5, 0.5};
  EXPECT_LT((aged(line, own, errors) - kShared * errors).norm(), 1e-9);
  EXPECT_NEAR(SharedCoilErrors(line).J().squaredNorm(), 5, 1e-9);
}

TEST(SharedCoilErrors, OneCoilSharesAShiftWithItself) {
  const std::vector<Eigen::Vector3d> one{{5, 6, 7}};
  const std::array<double, 1> own{0.5};
  EXPECT_LT((aged(one, own, Eigen::Vector3d(1, 2, 3)) - kShared * Eigen::Vector3d(1, 2, 3)).norm(), 1e-12);
}

}  // namespace
}  // namespace tubed
