#include "daemon/estimator/paper/paper_em_map.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "tests/daemon/estimator/simulated_tube.hpp"

namespace tubed {
namespace {

constexpr double kLength_mm = 380;

CoilObservations coils_of(const RoomDescription& room, double amplitude_mm, unsigned seed) {
  const auto history = std::make_unique<EmHistory>();
  const EmFrame frame = measure_coils(room, from_ns(1), amplitude_mm, seed);
  return observe_coils(&frame, *history, room.instruments.front(), room.T_world_em, 150'000'000);
}

/// Catheters of Sec. 3.1 (simulation) and Sec. 3.2 (experiment: 8 mm, then 86, 80 and 100 mm further).
RoomDescription room_with(const std::vector<double>& offsets_mm) {
  RoomDescription room = one_view_room();
  room.instruments.front().coils.clear();
  for (const double offset_mm : offsets_mm) {
    room.instruments.front().coils.push_back(
        {static_cast<int>(room.instruments.front().coils.size()) + 1, offset_mm, false});
  }
  return room;
}

double rms_to_arc(const PaperEmShape& shape, double from_mm, double to_mm) {
  double sum = 0;
  int count = 0;
  for (double s = from_mm; s <= to_mm; s += 1, ++count) {
    const GapBasis at = shape.cubics.basis(s);
    sum += (combine(shape.nodes, at, at.value) - arc_point(s)).squaredNorm();
  }
  return std::sqrt(sum / count);
}

TEST(PaperEmMap, WithoutNoiseFiveCoilsFollowAWideArc) {
  const auto shape = solve_paper_em_map(EstimatorSettings{}, kLength_mm, coils_of(one_view_room(), 0, 1));
  ASSERT_TRUE(shape);
  EXPECT_TRUE(shape->converged);
  EXPECT_LT(rms_to_arc(*shape, 10, 370), 0.5);
}

TEST(PaperEmMap, FourCoilsOfTheExperimentWorkToo) {
  const RoomDescription room = room_with({8, 94, 174, 274});
  const auto shape = solve_paper_em_map(EstimatorSettings{}, kLength_mm, coils_of(room, 0, 1));
  ASSERT_TRUE(shape);
  EXPECT_TRUE(shape->converged);
  EXPECT_LT(rms_to_arc(*shape, 8, 274), 1)
      << "straight beyond the last coil: bending is all that is known there";
}

TEST(PaperEmMap, AMissingCoilIsAWiderGap) {
  CoilObservations coils = coils_of(one_view_room(), 0, 1);
  coils.coils[2].state = CoilState::kMissing;
  const auto shape = solve_paper_em_map(EstimatorSettings{}, kLength_mm, coils);
  ASSERT_TRUE(shape);
  EXPECT_EQ(shape->cubics.node_count(), 4);
  EXPECT_LT(rms_to_arc(*shape, 10, 370), 4);
}

TEST(PaperEmMap, OneCoilIsNotEnough) {
  CoilObservations coils = coils_of(one_view_room(), 0, 1);
  for (std::size_t i = 1; i < 5; ++i) coils.coils[i].state = CoilState::kMissing;
  EXPECT_FALSE(solve_paper_em_map(EstimatorSettings{}, kLength_mm, coils));
}

/// Sum of squares of Eq. (14) with the whitening of EstimatorSettings, written from the paper.
double equation_14(const EstimatorSettings& settings, const CoilObservations& coils,
                   const PaperEmShape& shape, const Eigen::Matrix3Xd& nodes) {
  const auto at = [&](double s) { return shape.cubics.basis(s); };
  const auto length = [&](double from, double to) {
    double sum = 0;
    constexpr int kSteps = 2000;
    for (int i = 0; i < kSteps; ++i) {
      const GapBasis basis = at(from + (to - from) * (i + 0.5) / kSteps);
      sum += combine(nodes, basis, basis.first_derivative).norm() * (to - from) / kSteps;
    }
    return sum;
  };
  double cost = 0;
  for (int i = 0; i < coils.count; ++i) {
    const CoilObservation& coil = coils.coils[static_cast<std::size_t>(i)];
    const GapBasis basis = at(coil.s_mm);
    cost += (combine(nodes, basis, basis.value) - coil.p_world_mm).squaredNorm() /
            std::pow(settings.sigma_position_mm, 2);
    cost += (-combine(nodes, basis, basis.first_derivative).normalized() - coil.tangent_world).squaredNorm() /
            std::pow(settings.sigma_tangent, 2);
    for (int k = 0; k < i; ++k) {
      const double from = coils.coils[static_cast<std::size_t>(k)].s_mm;
      cost += std::pow((length(from, coil.s_mm) - (coil.s_mm - from)) / settings.paper.sigma_length_mm, 2);
    }
  }
  constexpr int kSteps = 20000;
  for (int i = 0; i < kSteps; ++i) {
    const GapBasis basis = at(kLength_mm * (i + 0.5) / kSteps);
    cost += combine(nodes, basis, basis.second_derivative).squaredNorm() * kLength_mm / kSteps /
            settings.bending_q_per_mm;
  }
  return cost;
}

TEST(PaperEmMap, NothingNearTheSolutionExplainsTheCoilsBetter) {
  const EstimatorSettings settings;
  for (unsigned seed = 1; seed <= 2; ++seed) {
    const CoilObservations coils = coils_of(one_view_room(), 4, seed);
    const auto shape = solve_paper_em_map(settings, kLength_mm, coils);
    ASSERT_TRUE(shape && shape->converged);
    const double best = equation_14(settings, coils, *shape, shape->nodes);
    for (Eigen::Index i = 0; i < shape->nodes.size(); ++i) {
      for (const double step : {-1.0, 1.0}) {
        Eigen::Matrix3Xd nodes = shape->nodes;
        nodes(i) += step * ((i / 3) % 2 == 0 ? 0.02 : 0.0005);  // mm of a point, mm/mm of a derivative
        EXPECT_GE(equation_14(settings, coils, *shape, nodes), best - 1e-4)
            << "seed " << seed << ", node " << i;
      }
    }
  }
}

TEST(PaperEmMap, PrintedWeightsBuckleAndConsistentOnesDoNot) {
  EstimatorSettings printed;
  printed.paper.weights = PaperWeights::kPrinted;
  double with_printed = 0;
  double with_consistent = 0;
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const CoilObservations coils = coils_of(one_view_room(), 4, seed);
    with_printed += rms_to_arc(*solve_paper_em_map(printed, kLength_mm, coils), 10, 370) / 20;
    with_consistent += rms_to_arc(*solve_paper_em_map(EstimatorSettings{}, kLength_mm, coils), 10, 370) / 20;
  }
  EXPECT_GT(with_printed, 1.2 * with_consistent);
}

TEST(PaperDepthMap, HoldsTheProjectionAndFindsTheDepthOfTheCoils) {
  const CoilObservations coils = coils_of(one_view_room(), 0, 1);
  const PointAtDepth on_rays = [](double s_mm, double depth_mm) -> Eigen::Vector3d {
    const Eigen::Vector3d p_camera = arc_point(s_mm) + Eigen::Vector3d(0, 0, 1200);
    return p_camera * (depth_mm / p_camera.z()) - Eigen::Vector3d(0, 0, 1200);
  };
  const Eigen::RowVectorXd start = Eigen::RowVectorXd::Constant(10, 1250).array() *
                                   Eigen::RowVectorXd::LinSpaced(10, 0, 9).array().unaryExpr(
                                       [](double i) { return static_cast<int>(i) % 2 == 0 ? 1.0 : 0.0; });
  const auto depths = solve_paper_depth_map(EstimatorSettings{}, kLength_mm, coils, on_rays, start);
  ASSERT_TRUE(depths);
  EXPECT_TRUE(depths->converged);
  for (double s = 10; s <= 370; s += 10) {
    const GapBasis at = depths->cubics.basis(s);
    const double depth_mm = combine(depths->nodes, at, at.value)(0);
    EXPECT_LT((on_rays(s, depth_mm) - arc_point(s)).norm(), 0.5) << s;
  }
}

TEST(PaperDepthMap, AStartForOtherCoilsIsRefused) {
  const CoilObservations coils = coils_of(one_view_room(), 0, 1);
  const PointAtDepth nowhere = [](double, double) { return Eigen::Vector3d::Zero().eval(); };
  EXPECT_FALSE(
      solve_paper_depth_map(EstimatorSettings{}, kLength_mm, coils, nowhere, Eigen::RowVectorXd::Zero(8)));
}

}  // namespace
}  // namespace tubed
