#include "daemon/estimator/tip/rest_hook.hpp"

#include <ceres/ceres.h>
#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "daemon/estimator/tube_map.hpp"
#include "tests/daemon/estimator/hooked_tube.hpp"

namespace tubed {
namespace {

const EstimatorSettings kSettings;

UniformCubicBSpline spline() { return {kSettings.coefficient_count, 380}; }

/// Coefficients whose curve is the tube, as nearly as a spline of this spacing can be.
Eigen::Matrix3Xd fitted(const HookedTube& tube) {
  constexpr int kPoints = 760;
  const UniformCubicBSpline of = spline();
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(kPoints, of.coefficient_count());
  Eigen::MatrixX3d points(kPoints, 3);
  for (int i = 0; i < kPoints; ++i) {
    const CubicBasis basis = of.basis(i * 0.5);
    for (int a = 0; a < 4; ++a) rows(i, basis.first + a) = basis.value[static_cast<std::size_t>(a)];
    points.row(i) = tube.point(i * 0.5).transpose();
  }
  return rows.householderQr().solve(points).transpose();
}

/// Every node as much as a millimetre of tube with this 1 / q does.
void weigh_all(double weight_per_mm, RestHook& hook) {
  hook.weigh(1 / weight_per_mm, Eigen::VectorXd::Ones(2 * hook.segment_count()));
}

TEST(RestHook, ItsCurvatureTurnsTheTubeByItsAngle) {
  for (const RestArc& arc : {RestArc{14, 8}, RestArc{30, 16}, RestArc{40, -30}}) {
    const RestHook hook(spline(), {{arc}});
    double turned_rad = 0;
    double length_mm = 0;
    for (const RestHook::Node& node : hook.nodes()) {
      turned_rad += node.length_mm * node.curvature_per_mm;
      length_mm += node.length_mm;
    }
    EXPECT_NEAR(turned_rad, arc.length_mm / arc.radius_mm, 0.05 * std::abs(turned_rad));
    EXPECT_NEAR(length_mm, hook.segment_count() * spline().spacing_mm(), 1e-9);
    EXPECT_GE(length_mm, arc.length_mm);
  }
}

TEST(RestHook, TheBinormalOfAShapeIsFoundFromAnywhere) {
  for (const double roll_rad : {0.0, 1.0, 2.5, 4.0, 5.5}) {
    const HookedTube tube{16, 30, roll_rad};
    const Eigen::Matrix3Xd C = fitted(tube);
    RestHook hook(spline(), RestCurve::hook(16, 30));
    weigh_all(1e4, hook);
    for (const Eigen::Vector3d& from : {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, -1, 0.2)}) {
      hook.set_binormal(from);
      hook.fit_binormal(C);
      EXPECT_GT(hook.binormal().normalized().dot(tube.binormal()), std::cos(0.05)) << roll_rad;
      EXPECT_NEAR(hook.binormal().norm(), 1, 0.1) << roll_rad;
    }
  }
}

TEST(RestHook, ItsLengthIsHowFarTheHookIsOpen) {
  const Eigen::Matrix3Xd C = fitted({16 / 0.7, 30, 1});  // of 70 % of the curvature that it was made with
  RestHook hook(spline(), RestCurve::hook(16, 30));
  weigh_all(1e6, hook);
  hook.fit_binormal(C);
  EXPECT_NEAR(hook.binormal().norm(), 0.7, 0.05);
}

/// Eq. (14) of coils, strain and bending from the rest shape, with the binormal as three more unknowns,
/// written once more: what Ceres minimises.
struct HookResiduals {
  CoilObservations coils;
  RestCurve shape;

  [[nodiscard]] int count() const {
    const int segments = RestHook(spline(), shape).segment_count();
    return 6 * coils.count + 2 * (spline().coefficient_count() - 3) +
           6 * (spline().coefficient_count() - 3 - segments) + 18 * segments + 2;
  }

  bool operator()(double const* const* parameters, double* r) const {
    const UniformCubicBSpline of = spline();
    const Eigen::Map<const Eigen::Matrix3Xd> C(parameters[0], 3, of.coefficient_count());
    const Eigen::Map<const Eigen::Vector3d> b(parameters[1]);
    const auto write = [&r](const Eigen::Vector3d& v) { r = std::copy_n(v.data(), 3, r); };
    const auto at = [&C](const CubicBasis& basis, const std::array<double, 4>& weights) {
      return Eigen::Vector3d(combine(C, basis.first, weights));
    };
    for (int i = 0; i < coils.count; ++i) {
      const CoilObservation& coil = coils.coils[static_cast<std::size_t>(i)];
      const CubicBasis basis = of.basis(coil.s_mm);
      write((at(basis, basis.value) - coil.p_world_mm) / kSettings.sigma_position_mm);
      write((-at(basis, basis.first_derivative).normalized() - coil.tangent_world) / kSettings.sigma_tangent);
    }
    const RestHook hook(of, shape);
    const double h = of.spacing_mm();
    for (int segment = 0; segment < of.coefficient_count() - 3; ++segment) {
      for (const double node : {0.5 - 0.5 / std::sqrt(3.0), 0.5 + 0.5 / std::sqrt(3.0)}) {
        const CubicBasis basis = of.basis((segment + node) * h);
        *r++ = (at(basis, basis.first_derivative).norm() - 1) * std::sqrt(h / 2) /
               kSettings.sigma_strain_sqrt_mm;
        if (segment >= hook.segment_count()) {
          write(at(basis, basis.second_derivative) * std::sqrt(h / 2 / kSettings.bending_q_per_mm));
        }
      }
    }
    for (const RestHook::Node& node : hook.nodes()) {
      const double q = kSettings.bending_q_per_mm * RestHook::kSoftness;
      write((at(node.basis, node.basis.second_derivative) -
             hook.curvature_per_mm(node.s_mm) * b.cross(at(node.basis, node.basis.first_derivative))) *
            std::sqrt(node.length_mm / q));
    }
    const CubicBasis begin = of.basis(shape.length_mm());
    *r++ = b.dot(at(begin, begin.first_derivative)) / RestHook::kSigmaOfPlane;
    *r++ = (b.norm() - 1) / RestHook::kSigmaOfOpening;
    return true;
  }
};

TEST(RestHook, TheMinimumIsTheOneCeresFindsWithTheBinormalAsAnUnknown) {
  const HookedTube tube{8, 14, 0.8};
  const RoomDescription room = room_with_first_coil(6);
  for (unsigned seed = 1; seed <= 4; ++seed) {
    const auto history = std::make_unique<EmHistory>();
    const EmFrame frame = measure_hooked(tube, room, from_ns(1), 1, 0.02, seed);
    const CoilObservations coils =
        observe_coils(&frame, *history, room.instruments.front(), room.T_world_em, 150'000'000);
    TubeMap map(kSettings, 380);
    RestHook hook(spline(), RestCurve::hook(8, 14));
    hook.set_binormal(tube.binormal());
    map.set_rest(&hook);
    Eigen::Matrix3Xd C(3, kSettings.coefficient_count);
    bool converged = false;
    ASSERT_TRUE(map.solve_linear(coils, C));
    Eigen::Matrix3Xd by_ceres = C;
    Eigen::Vector3d binormal = tube.binormal();
    map.refine(coils, {}, nullptr, 30, C, converged);
    EXPECT_TRUE(converged);

    const HookResiduals residuals{coils, RestCurve::hook(8, 14)};
    auto* function = new ceres::DynamicNumericDiffCostFunction<HookResiduals, ceres::CENTRAL>(
        new HookResiduals(residuals));
    function->AddParameterBlock(static_cast<int>(by_ceres.size()));
    function->AddParameterBlock(3);
    function->SetNumResiduals(residuals.count());
    ceres::Problem problem;
    problem.AddResidualBlock(function, nullptr, by_ceres.data(), binormal.data());
    ceres::Solver::Options options;
    options.max_num_iterations = 200;
    options.linear_solver_type = ceres::DENSE_QR;
    options.function_tolerance = 1e-14;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem, &summary);
    EXPECT_NEAR(map.cost(), 2 * summary.final_cost, 1e-4 * map.cost()) << seed;
    EXPECT_LT((C - by_ceres).colwise().norm().maxCoeff(), 0.1) << seed;
    EXPECT_LT((hook.binormal() - binormal).norm(), 0.02) << seed;
  }
}

TEST(RestHook, ItsCurvatureIsThatOfTheArcOneIsIn) {
  const RestHook hook(spline(), {{{8, 0}, {12, 10}, {6, 0}, {14, -20}, {9, 0}}});
  EXPECT_EQ(hook.length_mm(), 40) << "a straight piece behind the arcs belongs to the shaft";
  for (const auto& [s_mm, curvature] : std::vector<std::pair<double, double>>{{0, 0},
                                                                              {4, 0},
                                                                              {8, 0.05},
                                                                              {9, 0.1},
                                                                              {14, 0.1},
                                                                              {19, 0.1},
                                                                              {23, 0},
                                                                              {27, -0.05},
                                                                              {39, -0.05},
                                                                              {41, 0}}) {
    EXPECT_NEAR(hook.curvature_per_mm(s_mm), curvature, 1e-12) << s_mm;
  }
}

class RestHookOf : public testing::TestWithParam<HookedTube> {};

TEST_P(RestHookOf, AnyArcsWithACoilInThemLeadsToTheTip) {
  const HookedTube& tube = GetParam();
  const RoomDescription room = room_with_first_coil(6);
  const auto history = std::make_unique<EmHistory>();
  const EmFrame frame = measure_hooked(tube, room, from_ns(1), 0, 0, 1);
  const CoilObservations coils =
      observe_coils(&frame, *history, room.instruments.front(), room.T_world_em, 150'000'000);
  EstimatorSettings dense;
  dense.coefficient_count = 48;  // 8.4 mm apart
  TubeMap map(dense, 380);
  RestHook hook(map.spline(), tube.curve());
  hook.set_binormal(tube.binormal());
  const auto tip_error_mm = [&](RestHook* rest) {
    map.set_rest(rest);
    Eigen::Matrix3Xd C(3, dense.coefficient_count);
    bool converged = false;
    map.solve_linear(coils, C);
    map.refine(coils, {}, nullptr, 30, C, converged);
    const CubicBasis tip = map.spline().basis(0);
    return (combine(C, tip.first, tip.value) - tube.point(0)).norm();
  };
  const double straight_mm = tip_error_mm(nullptr);
  EXPECT_LT(tip_error_mm(&hook), 0.6 * straight_mm) << straight_mm;
  EXPECT_LT(tip_error_mm(&hook), 2);
}

INSTANTIATE_TEST_SUITE_P(Shapes, RestHookOf,
                         testing::Values(HookedTube{8, 14, 2}, HookedTube{0, 22, 2, {{8, 0}, {14, 9}}},
                                         HookedTube{0, 45, 1, {{20, 12}, {25, 30}}}));

}  // namespace
}  // namespace tubed
