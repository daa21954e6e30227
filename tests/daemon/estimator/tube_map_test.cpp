#include "daemon/estimator/tube_map.hpp"

#include <ceres/ceres.h>
#include <gtest/gtest.h>

#include <memory>

#include "tests/daemon/estimator/simulated_tube.hpp"

namespace tubed {
namespace {

CoilObservations coils_of(const RoomDescription& room, double amplitude_mm, unsigned seed) {
  const auto history = std::make_unique<EmHistory>();
  const EmFrame frame = measure_coils(room, from_ns(1), amplitude_mm, seed);
  return observe_coils(&frame, *history, room.instruments.front(), room.T_world_em, 150'000'000);
}

/// Eq. (14) with the whitened weights, written once more from the paper and without any of the solver's code
/// but the basis functions: what Ceres minimises by automatic... here numeric differentiation.
struct WhitenedResiduals {
  EstimatorSettings settings;
  UniformCubicBSpline spline;
  CoilObservations coils;
  const Camera* camera;
  std::vector<LineConstraint> lines;
  Eigen::VectorXd bending;  ///< multiplies bending_q_per_mm at the nodes

  [[nodiscard]] int count() const {
    return 6 * coils.count + 8 * (spline.coefficient_count() - 3) + static_cast<int>(lines.size());
  }

  bool operator()(double const* const* parameters, double* r) const {
    const Eigen::Map<const Eigen::Matrix3Xd> C(parameters[0], 3, spline.coefficient_count());
    for (int i = 0; i < coils.count; ++i) {
      const CoilObservation& coil = coils.coils[static_cast<std::size_t>(i)];
      const CubicBasis basis = spline.basis(coil.s_mm);
      const Eigen::Vector3d position =
          (combine(C, basis.first, basis.value) - coil.p_world_mm) / settings.sigma_position_mm;
      const Eigen::Vector3d tangent =
          (-combine(C, basis.first, basis.first_derivative).normalized() - coil.tangent_world) /
          settings.sigma_tangent;
      for (int axis = 0; axis < 3; ++axis) {
        *r++ = position[axis];
        *r++ = tangent[axis];
      }
    }
    const double h = spline.spacing_mm();
    const double offset = 0.5 / std::sqrt(3.0);  // two-point Gauss-Legendre
    Eigen::Index next = 0;
    for (int segment = 0; segment < spline.coefficient_count() - 3; ++segment) {
      for (const double node : {0.5 - offset, 0.5 + offset}) {
        const CubicBasis basis = spline.basis((segment + node) * h);
        const Eigen::Vector3d second = combine(C, basis.first, basis.second_derivative) *
                                       std::sqrt(h / 2 / (settings.bending_q_per_mm * bending[next++]));
        for (int axis = 0; axis < 3; ++axis) {
          *r++ = second[axis];
        }
        *r++ = (combine(C, basis.first, basis.first_derivative).norm() - 1) * std::sqrt(h / 2) /
               settings.sigma_strain_sqrt_mm;
      }
    }
    for (const LineConstraint& line : lines) {
      const CubicBasis basis = spline.basis(line.s_mm);
      const auto projection = camera->project(combine(C, basis.first, basis.value));
      *r++ = projection
                 ? line.normal.dot(projection->p_image_px - line.target_px) / std::sqrt(line.variance_px2)
                 : 0.0;
    }
    return true;
  }
};

Eigen::Matrix3Xd solve_with_ceres(const WhitenedResiduals& residuals, const Eigen::Matrix3Xd& start,
                                  double& cost) {
  Eigen::Matrix3Xd C = start;
  ceres::Problem problem;
  auto* function = new ceres::DynamicNumericDiffCostFunction<WhitenedResiduals, ceres::CENTRAL>(
      new WhitenedResiduals(residuals));
  function->AddParameterBlock(static_cast<int>(C.size()));
  function->SetNumResiduals(residuals.count());
  problem.AddResidualBlock(function, nullptr, C.data());
  ceres::Solver::Options options;
  options.max_num_iterations = 200;
  options.linear_solver_type = ceres::DENSE_QR;
  options.function_tolerance = 1e-14;
  options.gradient_tolerance = 1e-12;
  options.parameter_tolerance = 1e-12;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  cost = 2 * summary.final_cost;
  return C;
}

std::vector<LineConstraint> lines_on_arc(const Camera& camera) {
  std::vector<LineConstraint> lines;
  for (double s = 0; s <= 380; s += 5) {
    const auto p = camera.project(arc_point(s));
    if (p && camera.contains(p->p_image_px)) {
      const Eigen::Vector2d along = (p->J_image_world * arc_tangent_to_tip(s)).normalized();
      lines.push_back({s, p->p_image_px, {-along.y(), along.x()}, 2.0});
    }
  }
  return lines;
}

TEST(TubeMap, WithoutNoiseTheArcIsFoundWithinATenthOfAMillimetre) {
  const RoomDescription room = one_view_room();
  TubeMap map(EstimatorSettings{}, 380);
  const CoilObservations coils = coils_of(room, 0, 1);
  Eigen::Matrix3Xd C(3, EstimatorSettings{}.coefficient_count);
  bool converged = false;
  ASSERT_TRUE(map.solve_linear(coils, C));
  map.refine(coils, {}, nullptr, 20, C, converged);
  EXPECT_TRUE(converged);
  for (double s = 10; s <= 370; s += 10) {
    const CubicBasis basis = map.spline().basis(s);
    EXPECT_LT((combine(C, basis.first, basis.value) - arc_point(s)).norm(), 0.5) << s;
  }
}

TEST(TubeMap, MinimumIsTheOneCeresFindsOnTheSameResiduals) {
  const RoomDescription room = one_view_room();
  const Camera camera(room.cameras.front());
  const std::vector<LineConstraint> lines = lines_on_arc(camera);
  ASSERT_GT(lines.size(), 20U);
  for (unsigned seed = 1; seed <= 5; ++seed) {
    TubeMap map(EstimatorSettings{}, 380);
    // Softer and softer from the base to the tip; the first seed as the settings say.
    const Eigen::VectorXd bending =
        Eigen::VectorXd::LinSpaced(map.bending_node_count(), static_cast<double>(seed), 1 / (2.0 * seed - 1));
    map.set_bending(bending);
    const CoilObservations coils = coils_of(room, 4, seed);
    Eigen::Matrix3Xd C(3, EstimatorSettings{}.coefficient_count);
    bool converged = false;
    ASSERT_TRUE(map.solve_linear(coils, C));
    const ViewConstraints view{&camera, lines.data(), static_cast<int>(lines.size())};
    const Eigen::Matrix3Xd start = C;
    map.refine(coils, {&view, 1}, nullptr, EstimatorSettings{}.iterations, C, converged);
    EXPECT_TRUE(converged);
    double ceres_cost = 0;
    const WhitenedResiduals residuals{EstimatorSettings{}, map.spline(), coils, &camera, lines, bending};
    const Eigen::Matrix3Xd by_ceres = solve_with_ceres(residuals, start, ceres_cost);
    std::vector<double> r(static_cast<std::size_t>(residuals.count()));
    const double* parameters = C.data();
    residuals(&parameters, r.data());
    double cost = 0;
    for (const double value : r) {
      cost += value * value;
    }
    EXPECT_NEAR(cost, ceres_cost, 1e-6 * ceres_cost) << "seed " << seed;
    EXPECT_LT((C - by_ceres).colwise().norm().maxCoeff(), 0.05) << "seed " << seed;
  }
}

// Eq. (13) is the energy of bending: a piece that is half as stiff is as one whose q is twice as large.
TEST(TubeMap, StiffnessDividesTheVarianceOfBending) {
  const CoilObservations coils = coils_of(one_view_room(), 4, 3);
  const auto solve = [&](TubeMap& map) {
    Eigen::Matrix3Xd C(3, EstimatorSettings{}.coefficient_count);
    bool converged = false;
    EXPECT_TRUE(map.solve_linear(coils, C));
    map.refine(coils, {}, nullptr, 20, C, converged);
    return C;
  };
  TubeMap made(EstimatorSettings{}, 380);
  made.set_stiffness(StiffnessProfile::from_pairs({60, 0.25, 80, 2}));
  Eigen::VectorXd factors(made.bending_node_count());
  for (Eigen::Index i = 0; i < factors.size(); ++i) {
    const double s_mm = (static_cast<double>(i / 2) + (i % 2 == 0 ? 0.2113248654 : 0.7886751346)) *
                        made.spline().spacing_mm();
    factors[i] = s_mm < 60 ? 4 : (s_mm < 140 ? 0.5 : 1);
  }
  TubeMap told(EstimatorSettings{}, 380);
  told.set_bending(factors);
  const Eigen::Matrix3Xd C = solve(made);
  EXPECT_LT((C - solve(told)).cwiseAbs().maxCoeff(), 1e-9);
  TubeMap uniform(EstimatorSettings{}, 380);
  EXPECT_GT((C - solve(uniform)).cwiseAbs().maxCoeff(), 0.05);
}

// What is learnt comes beside it: where a tube bends as its stiffness has it nothing is left to be learnt.
TEST(TubeMap, WhatIsExpectedOfBendingIsBesideTheStiffness) {
  const CoilObservations coils = coils_of(one_view_room(), 4, 3);
  Eigen::Matrix3Xd C(3, EstimatorSettings{}.coefficient_count);
  bool converged = false;
  TubeMap made(EstimatorSettings{}, 380);
  made.set_stiffness(StiffnessProfile::from_pairs({140, 0.25}));
  TubeMap told(EstimatorSettings{}, 380);
  Eigen::VectorXd factors = Eigen::VectorXd::Ones(made.bending_node_count());
  factors.head(17).setConstant(4);  // eight segments and a half of 16.5 mm
  told.set_bending(factors);
  ASSERT_TRUE(made.solve_linear(coils, C));
  made.refine(coils, {}, nullptr, 20, C, converged);
  ASSERT_TRUE(made.invert_at(coils, {}, nullptr, C));
  ASSERT_TRUE(told.invert_at(coils, {}, nullptr, C));
  Eigen::VectorXd expected_made(factors.size());
  Eigen::VectorXd expected_told(factors.size());
  made.expect_bending(C, expected_made);
  told.expect_bending(C, expected_told);
  EXPECT_LT((expected_made.cwiseProduct(factors) - expected_told).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(TubeMap, OneCoilIsNotEnough) {
  const RoomDescription room = one_view_room();
  CoilObservations coils = coils_of(room, 0, 1);
  for (std::size_t i = 1; i < 5; ++i) {
    coils.coils[i].state = CoilState::kMissing;
  }
  TubeMap map(EstimatorSettings{}, 380);
  Eigen::Matrix3Xd C(3, EstimatorSettings{}.coefficient_count);
  EXPECT_FALSE(map.solve_linear(coils, C));
}

TEST(TubeMap, WhatIsNotMeasuredHasTheLargerVariance) {
  const RoomDescription room = one_view_room();
  TubeMap map(EstimatorSettings{}, 380);
  const CoilObservations coils = coils_of(room, 0, 1);
  Eigen::Matrix3Xd C(3, EstimatorSettings{}.coefficient_count);
  bool converged = false;
  map.solve_linear(coils, C);
  map.refine(coils, {}, nullptr, 20, C, converged);
  ASSERT_TRUE(map.invert_at(coils, {}, nullptr, C));
  EXPECT_GT(map.covariance(220).trace(), map.covariance(270).trace()) << "between two coils more than at one";
  EXPECT_GT(map.covariance(0).trace(), map.covariance(10).trace()) << "beyond the first coil more than at it";
}

}  // namespace
}  // namespace tubed
