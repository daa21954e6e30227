#include "drivers/simulation/catheter.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "drivers/simulation/counter_random.hpp"

namespace tubed {

namespace {

constexpr double kEdgeStiffness_N_per_mm = 2000;  ///< helps the multipliers; they carry the force in the end
constexpr double kGreatestForceLeft_N = 2e-6;
constexpr double kGreatestStrainLeft = 2e-6;
constexpr double kGreatestNodeStep_mm = 4;
constexpr int kMultiplierRounds = 6;
constexpr int kNewtonRounds = 400;
constexpr int kGreatestKicks = 3;
constexpr double kShake_mm = 0.02;
constexpr std::int64_t kShakeStream = 7002;
constexpr double kEnergyTolerance_N_mm = 1e-8;

double turn_at(const Eigen::Matrix3Xd& nodes, Eigen::Index node) {
  const Eigen::Vector3d tipward = nodes.col(node - 1) - nodes.col(node);
  const Eigen::Vector3d baseward = nodes.col(node) - nodes.col(node + 1);
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
  const double expected_mm =
      properties_.bendable_tip_mm * (std::abs(command.bend_rad) + std::abs(command.rotate_rad)) / 2;
  report.snapped = report.greatest_move_mm > kSnap_mm + expected_mm;
  return report;
}

CatheterShape Catheter::shape() const { return {nodes_, spacing_mm_}; }

bool Catheter::minimise(StepReport& report) {
  bool converged = settle(report);
  for (int kick = 0; kick < kGreatestKicks && converged && !report.stable; ++kick) {
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
    double greatest = 0;
    for (Eigen::Index edge = 0; edge < free_nodes_; ++edge) {
      const double l = edge_mm_[edge];
      const double stretch = ((nodes_.col(edge) - nodes_.col(edge + 1)).squaredNorm() - l * l) / (2 * l);
      edge_force_N_[edge] += kEdgeStiffness_N_per_mm * stretch;
      greatest = std::max(greatest, std::abs(stretch) / l);
    }
    if (greatest < kGreatestStrainLeft) {
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
    const double greatest_force = gradient_.leftCols(free_nodes_).colwise().norm().maxCoeff();
    assemble(nodes_, undamped);
    if (greatest_force < kGreatestForceLeft_N && std::abs(roll_change) < 1e-5) {
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
    const double greatest_move = moves.colwise().norm().maxCoeff();
    const double descent = step.dot(Eigen::Map<const Eigen::VectorXd>(gradient_.data(), 3 * free_nodes_));
    double share = std::min(1.0, kGreatestNodeStep_mm / std::max(greatest_move, 1e-12));
    bool fell = false;
    for (int halving = 0; halving < 30 && !fell; ++halving, share /= 2) {
      trial = nodes_;
      trial.leftCols(free_nodes_) -= share * moves;
      const double after = energy(trial, trial_gradient);
      fell = after <= before - 1e-4 * share * descent + 1e-13 * std::abs(before);
    }
    if (!fell) {
      return greatest_force < 100 * kGreatestForceLeft_N;
    }
    nodes_ = trial;
    damping = share * 2 < 0.3 ? std::max(4 * damping, 1e-5) : (damping < 1e-7 ? 0 : damping / 4);
  }
  return false;
}

void Catheter::carry_frames(const Eigen::Matrix3Xd& nodes) const {
  const Eigen::Index edges = free_nodes_ + 1;
  u_.resize(3, edges);
  u_.col(edges - 1) = introducer_.reference;
  Eigen::Vector3d from = introducer_.direction;
  for (Eigen::Index edge = edges - 2; edge >= 0; --edge) {
    const Eigen::Vector3d to = (nodes.col(edge) - nodes.col(edge + 1)).normalized();
    // Shortest rotation from -> to applied to u: u - (u.to) / (1 + from.to) (from + to), for u at right
    // angles to from.
    const Eigen::Vector3d u = u_.col(edge + 1);
    u_.col(edge) = u - u.dot(to) / (1 + from.dot(to)) * (from + to);
    from = to;
  }
}

double Catheter::solve_roll() {
  if (bend_rad_ == 0) {
    return 0;
  }
  carry_frames(nodes_);
  double p = 0;
  double q = 0;
  for (Eigen::Index node = 1; in_bendable_tip(node); ++node) {
    const double rest = std::tan(bend_rad_ / properties_.segments_in_tip);
    const double share = bending_stiffness(node) / (spacing_mm_ * spacing_mm_) * rest;
    const Eigen::Vector3d tipward = nodes_.col(node - 1) - nodes_.col(node);
    const Eigen::Vector3d t = (nodes_.col(node) - nodes_.col(node + 1)).normalized();
    p += share * tipward.dot(u_.col(node));
    q += share * tipward.dot(t.cross(Eigen::Vector3d(u_.col(node))));
  }
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

double Catheter::energy(const Eigen::Matrix3Xd& nodes, Eigen::Matrix3Xd& gradient) const {
  const double h = spacing_mm_;
  gradient.setZero(3, nodes.cols());
  double energy = -tip_force_N_.dot(nodes.col(0));
  gradient.col(0) -= tip_force_N_;

  for (Eigen::Index node = 1; node <= free_nodes_; ++node) {
    const Eigen::Vector3d bend = nodes.col(node - 1) - 2 * nodes.col(node) + nodes.col(node + 1);
    const double stiffness = bending_stiffness(node) / (h * h * h);
    energy += stiffness / 2 * bend.squaredNorm();
    gradient.col(node - 1) += stiffness * bend;
    gradient.col(node) -= 2 * stiffness * bend;
    gradient.col(node + 1) += stiffness * bend;
  }
  for (Eigen::Index edge = 0; edge < free_nodes_; ++edge) {
    const Eigen::Vector3d e = nodes.col(edge) - nodes.col(edge + 1);
    const double l = edge_mm_[edge];
    const double stretch = (e.squaredNorm() - l * l) / (2 * l);
    energy += edge_force_N_[edge] * stretch + kEdgeStiffness_N_per_mm / 2 * stretch * stretch;
    const Eigen::Vector3d pull = (edge_force_N_[edge] + kEdgeStiffness_N_per_mm * stretch) / l * e;
    gradient.col(edge) += pull;
    gradient.col(edge + 1) -= pull;
  }
  if (wall_ != nullptr) {
    const double stiffness = properties_.wall_stiffness_N_mm2 * h;
    for (Eigen::Index node = 0; node < free_nodes_; ++node) {
      if (wall_->distance_mm(nodes.col(node)) < properties_.diameter_mm / 2) {
        const WallDistance wall = wall_->at(nodes.col(node));
        const double penetration = properties_.diameter_mm / 2 - wall.distance_mm;
        energy += stiffness / 2 * penetration * penetration;
        gradient.col(node) -= stiffness * penetration * wall.gradient;
      }
    }
  }
  if (bend_rad_ == 0) {
    return energy;
  }

  // The actuated tip wants to turn toward d, carried with the catheter: - E I / h tan(rest) f.d / h.
  carry_frames(nodes);
  const double c = std::cos(tip_roll_rad_);
  const double s = std::sin(tip_roll_rad_);
  moment_.setZero(properties_.segments_in_tip + 1);
  for (Eigen::Index node = 1; in_bendable_tip(node); ++node) {
    const double rest = std::tan(bend_rad_ / properties_.segments_in_tip);
    const double share = bending_stiffness(node) / (h * h) * rest;
    const Eigen::Vector3d f = nodes.col(node - 1) - nodes.col(node);
    const Eigen::Vector3d e = nodes.col(node) - nodes.col(node + 1);
    const Eigen::Vector3d t = e.normalized();
    const Eigen::Vector3d d = c * u_.col(node) + s * t.cross(Eigen::Vector3d(u_.col(node)));
    energy -= share * f.dot(d);
    gradient.col(node - 1) -= share * d;
    gradient.col(node) += share * d;
    const Eigen::Vector3d by_e = share * f.dot(t) / e.norm() * d;
    gradient.col(node) += by_e;
    gradient.col(node + 1) -= by_e;
    moment_[node] = -share * f.dot(t.cross(d));
  }
  const double k = properties_.torsional_stiffness_N_mm2 / (insertion_mm_ - properties_.bendable_tip_mm);
  energy += k / 2 * (tip_roll_rad_ - base_roll_rad_) * (tip_roll_rad_ - base_roll_rad_);

  // Moving a node also turns the frames carried past it (Bergou 2008, gradient of the holonomy).
  double torque = 0;
  for (Eigen::Index node = 1; node <= free_nodes_; ++node) {
    if (node >= 2 && in_bendable_tip(node - 1)) {
      torque += moment_[node - 1];
    }
    const Eigen::Vector3d e = nodes.col(node) - nodes.col(node + 1);
    const Eigen::Vector3d f = nodes.col(node - 1) - nodes.col(node);
    const Eigen::Vector3d binormal = 2 * e.cross(f) / (e.norm() * f.norm() + e.dot(f));
    const Eigen::Vector3d at_base = torque * binormal / (2 * e.norm());
    const Eigen::Vector3d at_tip = -torque * binormal / (2 * f.norm());
    gradient.col(node + 1) += at_base;
    gradient.col(node - 1) += at_tip;
    gradient.col(node) -= at_base + at_tip;
  }
  return energy;
}

void Catheter::assemble(const Eigen::Matrix3Xd& nodes, BandedCholesky<kBand>& hessian) const {
  const double h = spacing_mm_;
  hessian.reset(3 * free_nodes_);
  const auto add = [&](Eigen::Index a, Eigen::Index b, const Eigen::Matrix3d& block) {
    // Adds block to (a, b) and its transpose to (b, a); lower half only.
    if (a >= free_nodes_ || b >= free_nodes_) {
      return;
    }
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        const Eigen::Index row = 3 * a + i;
        const Eigen::Index column = 3 * b + j;
        if (row >= column) {
          hessian.add(row, column, block(i, j));
        } else if (a != b) {
          hessian.add(column, row, block(i, j));
        }
      }
    }
  };
  const auto add_scalar = [&](Eigen::Index a, Eigen::Index b, double value) {
    if (a < free_nodes_ && b < free_nodes_) {
      for (int i = 0; i < 3; ++i) {
        hessian.add(3 * std::max(a, b) + i, 3 * std::min(a, b) + i, value);
      }
    }
  };
  for (Eigen::Index node = 1; node <= free_nodes_; ++node) {
    const double stiffness = bending_stiffness(node) / (h * h * h);
    add_scalar(node - 1, node - 1, stiffness);
    add_scalar(node, node, 4 * stiffness);
    add_scalar(node + 1, node + 1, stiffness);
    add_scalar(node, node - 1, -2 * stiffness);
    add_scalar(node + 1, node, -2 * stiffness);
    add_scalar(node + 1, node - 1, stiffness);
  }
  for (Eigen::Index edge = 0; edge < free_nodes_; ++edge) {
    const Eigen::Vector3d e = nodes.col(edge) - nodes.col(edge + 1);
    const double l = edge_mm_[edge];
    const double stretch = (e.squaredNorm() - l * l) / (2 * l);
    const double force = edge_force_N_[edge] + kEdgeStiffness_N_per_mm * stretch;
    const Eigen::Matrix3d block =
        kEdgeStiffness_N_per_mm / (l * l) * e * e.transpose() + force / l * Eigen::Matrix3d::Identity();
    add(edge, edge, block);
    add(edge + 1, edge + 1, block);
    add(edge + 1, edge, -block);
  }
  if (wall_ != nullptr) {
    const double stiffness = properties_.wall_stiffness_N_mm2 * h;
    for (Eigen::Index node = 0; node < free_nodes_; ++node) {
      const WallDistance wall = wall_->at(nodes.col(node));
      const double penetration = properties_.diameter_mm / 2 - wall.distance_mm;
      if (penetration > 0) {
        add(node, node,
            stiffness * (wall.gradient * wall.gradient.transpose() - penetration * wall.hessian_per_mm));
      }
    }
  }
  if (bend_rad_ == 0) {
    return;
  }
  const double c = std::cos(tip_roll_rad_);
  const double s = std::sin(tip_roll_rad_);
  for (Eigen::Index node = 1; in_bendable_tip(node); ++node) {
    const double rest = std::tan(bend_rad_ / properties_.segments_in_tip);
    const double share = bending_stiffness(node) / (h * h) * rest;
    const Eigen::Vector3d e = nodes.col(node) - nodes.col(node + 1);
    const Eigen::Vector3d t = e.normalized();
    const Eigen::Vector3d d = c * u_.col(node) + s * t.cross(Eigen::Vector3d(u_.col(node)));
    const Eigen::Matrix3d by_f_and_e = share / e.norm() * t * d.transpose();  // of f = node - 1 to node
    const Eigen::Matrix3d both = by_f_and_e + by_f_and_e.transpose();
    add(node - 1, node, by_f_and_e);
    add(node - 1, node + 1, -by_f_and_e);
    add(node, node, -both);
    add(node, node + 1, by_f_and_e);
    // Second order of d and t in e: without it a tip that turns as a whole would seem to store energy.
    const Eigen::Vector3d f = nodes.col(node - 1) - nodes.col(node);
    const Eigen::Vector3d aside = f - f.dot(t) * t;
    const Eigen::Matrix3d half = share / e.squaredNorm() * d * (aside / 2 - f.dot(t) * t).transpose();
    const Eigen::Matrix3d by_e = half + half.transpose();
    add(node, node, by_e);
    add(node + 1, node + 1, by_e);
    add(node + 1, node, -by_e);
  }
}

void Catheter::measure(const Eigen::Matrix3Xd& predicted, StepReport& report) const {
  std::vector<double> penetrations;
  double length = 0;
  double wanted = 0;
  for (Eigen::Index node = 0; node < free_nodes_; ++node) {
    const double edge = (nodes_.col(node) - nodes_.col(node + 1)).norm();
    length += edge;
    wanted += edge_mm_[node];
    report.greatest_length_error =
        std::max(report.greatest_length_error, std::abs(edge / edge_mm_[node] - 1));
    report.greatest_move_mm =
        std::max(report.greatest_move_mm, (nodes_.col(node) - predicted.col(node)).norm());
    if (wall_ != nullptr) {
      const double penetration = properties_.diameter_mm / 2 - wall_->distance_mm(nodes_.col(node));
      if (penetration > 0) {
        penetrations.push_back(penetration);
      }
    }
  }
  report.length_error = std::abs(length / wanted - 1);
  if (!penetrations.empty()) {
    report.greatest_penetration_mm = *std::max_element(penetrations.begin(), penetrations.end());
    const auto middle = penetrations.begin() + static_cast<std::ptrdiff_t>(penetrations.size() / 2);
    std::nth_element(penetrations.begin(), middle, penetrations.end());
    report.median_penetration_mm = *middle;
  }
}

}  // namespace tubed
