#include "drivers/laboratory/instrument/catheter.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "drivers/laboratory/random/counter_random.hpp"

namespace tubed {

namespace {

constexpr double kMaxForceLeft_N = 2e-6;
constexpr double kMaxStrainLeft = 2e-6;
constexpr double kMaxNodeStep_mm = 4;
constexpr int kMultiplierRounds = 6;
constexpr int kNewtonRounds = 400;
constexpr int kMaxKicks = 3;
constexpr double kShake_mm = 0.02;
constexpr std::int64_t kShakeStream = 7002;
constexpr double kEnergyTolerance_N_mm = 1e-8;

double turn_at(const Eigen::Matrix3Xd& nodes, Eigen::Index node) {
  const Eigen::Vector3d tipward = nodes.col(node - 1) - nodes.col(node);
  const Eigen::Vector3d baseward = nodes.col(node) - nodes.col(node + 1);
  // Angle between neighbouring edges; atan2 is exact for small angles as well, acos is not.
  return std::atan2(tipward.cross(baseward).norm(), tipward.dot(baseward));
}

/// The point at arc length `s_mm` of a polygon with edges of `spacing_mm`; straight on beyond its ends.
Eigen::Vector3d along_polygon(const Eigen::Matrix3Xd& nodes, double spacing_mm, double s_mm) {
  const double place = s_mm / spacing_mm;
  const auto edge =
      std::clamp<Eigen::Index>(static_cast<Eigen::Index>(std::floor(place)), 0, nodes.cols() - 2);
  const double part = place - static_cast<double>(edge);
  return (1 - part) * nodes.col(edge) + part * nodes.col(edge + 1);
}

std::vector<VesselStation> straight_route(const Introducer& introducer, double length_mm) {
  return {{introducer.p_world_mm, 1}, {introducer.p_world_mm + length_mm * introducer.direction, 1}};
}

Eigen::Vector3d along_route(const std::vector<VesselStation>& route, double u_mm) {
  double left = u_mm;
  for (std::size_t i = 1; i < route.size(); ++i) {
    const Eigen::Vector3d piece = route[i].p_world_mm - route[i - 1].p_world_mm;
    if (left <= piece.norm() || i + 1 == route.size()) {
      return route[i - 1].p_world_mm + left * piece.normalized();
    }
    left -= piece.norm();
  }
  return route.front().p_world_mm;
}

}  // namespace

Catheter::Catheter(const CatheterProperties& properties, const Introducer& introducer, const WallField* wall,
                   const std::vector<VesselStation>& route, double insertion_mm, double roll_rad)
    : properties_(properties),
      introducer_(introducer),
      wall_(wall),
      spacing_mm_(properties.bendable_tip_mm / properties.segments_in_tip),
      insertion_mm_(insertion_mm),
      base_roll_rad_(roll_rad),
      tip_roll_rad_(roll_rad) {
  if (!(insertion_mm > properties.bendable_tip_mm)) {
    throw std::invalid_argument("the catheter has to be inserted by more than its bendable tip");
  }
  if (properties.hook.length_mm() > properties.bendable_tip_mm - spacing_mm_) {
    throw std::invalid_argument("a hook has to be shorter than the bendable tip");
  }
  const auto way = route.size() < 2 ? straight_route(introducer, insertion_mm) : route;
  place_held_nodes();
  for (Eigen::Index node = 0; node < free_nodes_; ++node) {
    nodes_.col(node) = along_route(way, insertion_mm - spacing_mm_ * static_cast<double>(node));
  }
  StepReport settling;
  minimise(settling);
}

void Catheter::place_held_nodes() {
  free_nodes_ = static_cast<Eigen::Index>(std::ceil(insertion_mm_ / spacing_mm_ - 1e-9));
  const Eigen::Index count = free_nodes_ + 2;
  nodes_.conservativeResize(Eigen::NoChange, count);
  const Eigen::Index known = edge_force_N_.size();
  edge_force_N_.conservativeResize(count - 1);
  edge_force_N_.tail(std::max<Eigen::Index>(0, count - 1 - known)).setZero();
  edge_mm_.setConstant(count - 1, spacing_mm_);
  for (Eigen::Index node = free_nodes_; node < count; ++node) {
    const double outside_mm = spacing_mm_ * static_cast<double>(node) - insertion_mm_;
    nodes_.col(node) = introducer_.p_world_mm - outside_mm * introducer_.direction;
  }
}

void Catheter::follow_itself(double advance_mm) {
  const Eigen::Matrix3Xd before = nodes_;
  insertion_mm_ += advance_mm;
  place_held_nodes();
  for (Eigen::Index node = 0; node < free_nodes_; ++node) {
    nodes_.col(node) =
        along_polygon(before, spacing_mm_, spacing_mm_ * static_cast<double>(node) - advance_mm);
  }
}

bool Catheter::in_bendable_tip(Eigen::Index node) const {
  return node >= 1 && node <= properties_.segments_in_tip;
}

double Catheter::bending_stiffness(Eigen::Index node) const {
  const double stiffness = node < properties_.segments_in_tip ? properties_.tip_bending_stiffness_N_mm2
                                                              : properties_.bending_stiffness_N_mm2;
  return node == free_nodes_ ? 2 * stiffness : stiffness;  // half of its length is held by the introducer
}

void Catheter::set_edge_lengths() {
  const auto half = [&](Eigen::Index node) {
    const bool turns = node >= 1 && node <= free_nodes_;
    return CatheterShape::half_edge_mm(turns ? turn_at(nodes_, node) : 0.0, spacing_mm_);
  };
  for (Eigen::Index edge = 0; edge < edge_mm_.size(); ++edge) {
    edge_mm_[edge] = half(edge) + half(edge + 1);
  }
}

StepReport Catheter::apply(const CatheterCommand& command) {
  if (insertion_mm_ + command.insert_mm <= properties_.bendable_tip_mm) {
    throw std::invalid_argument(
        "the catheter cannot be retracted into the introducer up to its bendable tip");
  }
  StepReport report;
  const Eigen::Vector3d tip_before = nodes_.col(0);
  base_roll_rad_ += command.rotate_rad;
  tip_roll_rad_ += command.rotate_rad;
  bend_rad_ += command.bend_rad;
  follow_itself(command.insert_mm);
  const Eigen::Matrix3Xd predicted = nodes_;
  report.converged = minimise(report);
  report.tip_move_mm = (nodes_.col(0) - tip_before).norm();
  measure(predicted, report);
  // A tip of length l that bends or turns by an angle moves by about l / 2 times that angle.
  const double expected_mm =
      properties_.bendable_tip_mm * (std::abs(command.bend_rad) + std::abs(command.rotate_rad)) / 2;
  report.snapped = report.max_move_mm > kSnap_mm + expected_mm;
  return report;
}

CatheterShape Catheter::shape() const {
  if (!properties_.hook.is_there()) {
    return {nodes_, spacing_mm_};
  }
  carry_frames(nodes_);
  Eigen::Matrix3Xd toward = u_;
  const double roll_rad = tip_roll_rad_ + properties_.hook.roll_rad;
  for (Eigen::Index edge = 0; edge < toward.cols(); ++edge) {
    const Eigen::Vector3d u = u_.col(edge);
    const Eigen::Vector3d t = (nodes_.col(edge) - nodes_.col(edge + 1)).normalized();
    toward.col(edge) = std::cos(roll_rad) * u + std::sin(roll_rad) * t.cross(u);
  }
  return {with_hook(nodes_, spacing_mm_, properties_.hook, toward), spacing_mm_};
}

bool Catheter::minimise(StepReport& report) {
  bool converged = settle(report);
  for (int kick = 0; kick < kMaxKicks && converged && !report.stable; ++kick) {
    // Shaken from a saddle: what falls lower had not been a minimum.
    const double before = energy(nodes_, gradient_);
    shake(kick);
    converged = settle(report);
    // The matrix leaves out how the frames turn: what falls back to the same energy was a minimum after all.
    report.stable = report.stable || energy(nodes_, gradient_) > before - kEnergyTolerance_N_mm;
  }
  return converged;
}

void Catheter::shake(int kick) {
  for (Eigen::Index node = 0; node < free_nodes_; ++node) {
    CounterRandom random(kick, kShakeStream, node);
    nodes_.col(node) +=
        kShake_mm * Eigen::Vector3d(random.signed_unit(), random.signed_unit(), random.signed_unit());
  }
}

bool Catheter::settle(StepReport& report) {
  for (int round = 0; round < kMultiplierRounds; ++round) {
    set_edge_lengths();
    if (!balance(report)) {
      return false;
    }
    if (take_up_stretch() < kMaxStrainLeft) {
      return true;
    }
  }
  return true;
}

bool Catheter::balance(StepReport& report) {
  double damping = 0;
  BandedCholesky<kBand> undamped;
  Eigen::Matrix3Xd trial;
  Eigen::Matrix3Xd trial_gradient;
  for (int round = 0; round < kNewtonRounds; ++round) {
    const double roll_change = solve_roll();
    const double before = energy(nodes_, gradient_);
    const double max_force = gradient_.leftCols(free_nodes_).colwise().norm().maxCoeff();
    assemble(nodes_, undamped);
    if (max_force < kMaxForceLeft_N && std::abs(roll_change) < 1e-5) {
      report.stable = undamped.factorise();
      return true;
    }
    ++report.iterations;
    Eigen::VectorXd step;
    for (;;) {
      hessian_ = undamped;
      hessian_.add_to_diagonal(damping);
      if (hessian_.factorise()) {
        break;
      }
      damping = std::max(4 * damping, 1e-4);
    }
    step = Eigen::Map<const Eigen::VectorXd>(gradient_.data(), 3 * free_nodes_);
    hessian_.solve(step);
    const Eigen::Map<const Eigen::Matrix3Xd> moves(step.data(), 3, free_nodes_);
    const double max_move = moves.colwise().norm().maxCoeff();
    const double descent = step.dot(Eigen::Map<const Eigen::VectorXd>(gradient_.data(), 3 * free_nodes_));
    // Newton's step with Armijo's rule: E(x - a d) <= E(x) - 1e-4 a d . grad E, a halved until it holds.
    double share = std::min(1.0, kMaxNodeStep_mm / std::max(max_move, 1e-12));
    bool fell = false;
    for (int halving = 0; halving < 30 && !fell; ++halving, share /= 2) {
      trial = nodes_;
      trial.leftCols(free_nodes_) -= share * moves;
      const double after = energy(trial, trial_gradient);
      fell = after <= before - 1e-4 * share * descent + 1e-13 * std::abs(before);
    }
    if (!fell) {
      return max_force < 100 * kMaxForceLeft_N;
    }
    nodes_ = trial;
    damping = share * 2 < 0.3 ? std::max(4 * damping, 1e-5) : (damping < 1e-7 ? 0 : damping / 4);
  }
  return false;
}

double Catheter::solve_roll() {
  if (bend_rad_ == 0) {
    return 0;
  }
  carry_frames(nodes_);
  double p = 0;
  double q = 0;
  for (Eigen::Index node = 1; in_bendable_tip(node); ++node) {
    const double share = actuation_at(node);
    const Eigen::Vector3d tipward = nodes_.col(node - 1) - nodes_.col(node);
    const Eigen::Vector3d t = (nodes_.col(node) - nodes_.col(node + 1)).normalized();
    p += share * tipward.dot(u_.col(node));
    q += share * tipward.dot(t.cross(Eigen::Vector3d(u_.col(node))));
  }
  // E(theta) = -p cos(theta) - q sin(theta) + k / 2 (theta - theta_base)^2: the actuated tip's moment against
  // the torsion of the shaft, k = G J / length. Newton's method in one variable.
  const double k = properties_.torsional_stiffness_N_mm2 / (insertion_mm_ - properties_.bendable_tip_mm);
  const double before = tip_roll_rad_;
  for (int round = 0; round < 20; ++round) {
    const double c = std::cos(tip_roll_rad_);
    const double s = std::sin(tip_roll_rad_);
    const double slope = p * s - q * c + k * (tip_roll_rad_ - base_roll_rad_);
    const double curvature = p * c + q * s + k;
    const double step = curvature > 0 ? -slope / curvature : -std::copysign(0.1, slope);
    tip_roll_rad_ += std::clamp(step, -0.1, 0.1);
    if (std::abs(step) < 1e-9) {
      break;
    }
  }
  tip_roll_rad_ = std::clamp(tip_roll_rad_, before - 0.2, before + 0.2);
  return tip_roll_rad_ - before;
}

void Catheter::measure(const Eigen::Matrix3Xd& predicted, StepReport& report) const {
  std::vector<double> penetrations;
  double length = 0;
  double wanted = 0;
  for (Eigen::Index node = 0; node < free_nodes_; ++node) {
    const double edge = (nodes_.col(node) - nodes_.col(node + 1)).norm();
    length += edge;
    wanted += edge_mm_[node];
    report.max_length_error = std::max(report.max_length_error, std::abs(edge / edge_mm_[node] - 1));
    report.max_move_mm = std::max(report.max_move_mm, (nodes_.col(node) - predicted.col(node)).norm());
    if (wall_ != nullptr) {
      const double penetration = properties_.diameter_mm / 2 - wall_->distance_mm(nodes_.col(node));
      if (penetration > 0) {
        penetrations.push_back(penetration);
      }
    }
  }
  report.length_error = std::abs(length / wanted - 1);
  if (!penetrations.empty()) {
    report.max_penetration_mm = *std::max_element(penetrations.begin(), penetrations.end());
    const auto middle = penetrations.begin() + static_cast<std::ptrdiff_t>(penetrations.size() / 2);
    std::nth_element(penetrations.begin(), middle, penetrations.end());
    report.median_penetration_mm = *middle;
  }
}

}  // namespace tubed
