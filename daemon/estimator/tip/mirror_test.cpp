#include "daemon/estimator/tip/mirror_test.hpp"

#include <algorithm>
#include <cmath>

namespace tubed {

namespace {

// chi^2 that a mirrored shape has to save. By less it is noise that decides, and a tip that goes from one
// side to the other and back is worse than one that stays.
constexpr double kMargin = 3;
// Probability of another shape beside the one that is chosen. One image's evidence comes again with the next
// one: what is less likely by noise at one of them is likelier at another.
constexpr double kMayBe = 0.05;
constexpr double kApart_mm = 5;       // of their tips
constexpr double kMaxLoose_mm = 100;  // of a tip of which one view may be enough
constexpr double kStep_mm = 4;
constexpr double kShortest_mm = 8;       // of a piece whose mirror image is another shape
constexpr double kLeaning = 0.45;        // depth a length at the tip of a start that leans
constexpr double kNearestDepth_mm = 10;  // what is nearer to the camera's centre stays where it is

// Along its ray.
Eigen::Vector3d moved_to_depth(double depth_mm, const Eigen::Vector3d& p_camera_mm) {
  const double z_mm = p_camera_mm.z();
  return z_mm > kNearestDepth_mm && depth_mm > kNearestDepth_mm ? p_camera_mm * (depth_mm / z_mm)
                                                                : p_camera_mm;
}

// Where the tube is for which coefficient k stands, nearly.
double place_mm(Eigen::Index k, const UniformCubicBSpline& spline) {
  return static_cast<double>(k - 1) * spline.spacing_mm();
}

}  // namespace

MirrorTest::MirrorTest(Eigen::Index coefficient_count)
    : rival_(Eigen::Matrix3Xd::Zero(3, coefficient_count)) {
  shapes_.fill(rival_);
}

std::span<const double> MirrorTest::find_turns(const LooseShape& shape, const Eigen::Matrix3Xd& C) {
  const Eigen::RowVector3d depth_world = shape.camera.calibration().T_camera_world.linear().row(2);
  const auto steepness = [&](double s_mm) {
    const CubicBasis basis = shape.spline.basis(s_mm);
    return std::abs(depth_world * combine(C, basis.first, basis.first_derivative));
  };
  std::size_t count = 0;
  turns_[count++] = shape.loose_mm;
  double behind = steepness(shape.loose_mm);
  double here = steepness(shape.loose_mm - kStep_mm);
  for (double s_mm = shape.loose_mm - kStep_mm; s_mm > kShortest_mm && count < kMaxTurns; s_mm -= kStep_mm) {
    const double before = steepness(s_mm - kStep_mm);
    if (here < behind && here <= before) {
      turns_[count++] = s_mm;
    }
    behind = here;
    here = before;
  }
  return {turns_.data(), count};
}

void MirrorTest::mirror_before(double turn_mm, const LooseShape& shape, const Eigen::Matrix3Xd& C,
                               Eigen::Matrix3Xd& mirrored) {
  const RigidTransform& T_camera_world = shape.camera.calibration().T_camera_world;
  const RigidTransform T_world_camera = T_camera_world.inverse();
  const CubicBasis basis = shape.spline.basis(turn_mm);
  const double turn_depth_mm = (T_camera_world * combine(C, basis.first, basis.value)).z();
  mirrored = C;
  for (Eigen::Index k = 0; place_mm(k, shape.spline) < turn_mm; ++k) {
    const Eigen::Vector3d p_camera_mm = T_camera_world * C.col(k);
    mirrored.col(k) = T_world_camera * moved_to_depth(2 * turn_depth_mm - p_camera_mm.z(), p_camera_mm);
  }
}

void MirrorTest::lean(double side, const LooseShape& shape, const Eigen::Matrix3Xd& C,
                      Eigen::Matrix3Xd& leant) {
  const RigidTransform& T_camera_world = shape.camera.calibration().T_camera_world;
  const RigidTransform T_world_camera = T_camera_world.inverse();
  leant = C;
  for (Eigen::Index k = 0; place_mm(k, shape.spline) < shape.loose_mm; ++k) {
    const double loose_mm = shape.loose_mm - place_mm(k, shape.spline);
    const double way_mm = side * kLeaning * loose_mm * loose_mm / (2 * shape.loose_mm);
    const Eigen::Vector3d p_camera_mm = T_camera_world * C.col(k);
    leant.col(k) = T_world_camera * moved_to_depth(p_camera_mm.z() + way_mm, p_camera_mm);
  }
}

std::size_t MirrorTest::find_starts(const LooseShape& shape, const Eigen::Matrix3Xd& C) {
  std::size_t starts = 0;
  costs_[starts] = shape.cost;
  shapes_[starts++] = C;
  for (const double turn_mm : find_turns(shape, C)) {
    mirror_before(turn_mm, shape, C, shapes_[starts++]);
  }
  for (const double side : {-1.0, 1.0}) {
    lean(side, shape, C, shapes_[starts++]);
  }
  return starts;
}

// Of two shapes, the one that is chosen and one other: most starts lead to the same.
void MirrorTest::choose(std::size_t starts, const LooseShape& shape, Eigen::Matrix3Xd& C) {
  std::size_t chosen = 0;
  for (std::size_t i = 1; i < starts; ++i) {
    if (costs_[i] < std::min(costs_[chosen], costs_[0] - kMargin)) {
      chosen = i;
    }
  }
  C = shapes_[chosen];
  rival_.setZero();
  is_ambiguous_ = shape.loose_mm > kMaxLoose_mm && !shape.is_seen_from_two_sides;
  const CubicBasis tip = shape.spline.basis(0);
  double widest_mm2 = 0;
  for (std::size_t i = 0; i < starts; ++i) {
    const double probability = 1 / (1 + std::exp((costs_[i] - costs_[chosen]) / 2));
    const double apart_mm = combine(shapes_[i] - C, tip.first, tip.value).norm();
    const double square_mm2 = probability * apart_mm * apart_mm;
    is_ambiguous_ = is_ambiguous_ || (probability >= kMayBe && apart_mm >= kApart_mm);
    if (square_mm2 > widest_mm2) {
      widest_mm2 = square_mm2;
      rival_ = std::sqrt(probability) * (shapes_[i] - C);
    }
  }
}

}  // namespace tubed
