// How far coils are off a prediction, against sums written out.
#include "daemon/estimator/coils/coil_innovations.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <memory>
#include <vector>

#include "tests/daemon/estimator/simulated_tube.hpp"

namespace tubed {
namespace {

CoilInnovations with_chi_squared(const std::vector<double>& each) {
  CoilInnovations all(static_cast<int>(each.size()));
  all.count = static_cast<int>(each.size());
  all.covariance_mm2.diagonal().setConstant(4);
  for (int k = 0; k < all.count; ++k) {
    all.coil[static_cast<std::size_t>(k)] = k;
    all.innovation_mm(3 * k + k % 3) = 2 * std::sqrt(each[static_cast<std::size_t>(k)]);
  }
  return all;
}

TEST(CoilInnovations, AreOfTheUsedCoilsWithNoiseAndWhatTheyShare) {
  const RoomDescription room = one_view_room();
  const TubeMap map(EstimatorSettings{}, 380, 5, 1);
  TubeGaussian tube(map.columns().count());
  std::srand(3);
  const Eigen::MatrixXd A = Eigen::MatrixXd::Random(tube.P.rows(), tube.P.rows());
  tube.P = A * A.transpose();
  tube.C.setRandom();
  const auto history = std::make_unique<EmHistory>();
  const EmFrame frame = measure_coils(room, from_ns(1), 2, 3);
  CoilObservations coils =
      observe_coils(&frame, *history, room.instruments.front(), room.T_world_em, 150'000'000);
  coils.coils[1].state = CoilState::kMissing;

  CoilInnovations all(5);
  all.measure(coils, map, tube, 1.5);

  ASSERT_EQ(all.count, 4);
  EXPECT_EQ(all.coil[1], 2);
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(12, tube.P.rows());
  for (int k = 0; k < 4; ++k) {
    const int coil = all.coil[static_cast<std::size_t>(k)];
    const CoilObservation& observed = coils.coils[static_cast<std::size_t>(coil)];
    const CubicBasis basis = map.spline().basis(observed.s_mm);
    for (int a = 0; a < 4; ++a) {
      H.block<3, 3>(3 * k, 3 * (basis.first + a)) =
          basis.value[static_cast<std::size_t>(a)] * Eigen::Matrix3d::Identity();
    }
    H.block<3, 3>(3 * k, 3 * map.columns().position_error(coil)).setIdentity();
    const Eigen::Vector3d off = observed.p_world_mm - H.middleRows<3>(3 * k) * tube.C.reshaped();
    EXPECT_LT((all.innovation_mm.segment<3>(3 * k) - off).norm(), 1e-9);
  }
  const Eigen::MatrixXd S = H * tube.P * H.transpose() + 2.25 * Eigen::MatrixXd::Identity(12, 12);
  EXPECT_LT((all.covariance_mm2.topLeftCorner(12, 12) - S).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(CoilInnovations, SurpriseIsTheMeanWithoutTheCoilThatIsFurthestOff) {
  EXPECT_DOUBLE_EQ(with_chi_squared({3, 6, 100, 9}).surprise(), (3.0 + 6 + 9) / (3 * 3));
  EXPECT_DOUBLE_EQ(with_chi_squared({3, 60}).surprise(), 0);  // too few to say
}

TEST(CoilInnovations, OthersAreCalmBelowOneInAHundred) {
  EXPECT_TRUE(with_chi_squared({1, 40, 11}).others_are_calm(1));
  EXPECT_FALSE(with_chi_squared({1, 40, 12}).others_are_calm(1));
}

}  // namespace
}  // namespace tubed
