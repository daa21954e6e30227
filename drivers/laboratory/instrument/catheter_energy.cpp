// The energy of a catheter, its gradient and its second derivatives, term by term.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "drivers/laboratory/instrument/catheter.hpp"

namespace tubed {

namespace {

constexpr double kEdgeStiffness_N_per_mm = 2000;  ///< helps the multipliers; they carry the force in the end

Eigen::Vector3d edge_at(const Eigen::Matrix3Xd& nodes, Eigen::Index edge) {
  return nodes.col(edge) - nodes.col(edge + 1);
}

/// How much longer an edge is than it should be, mm; quadratic, so that its derivatives are simple.
double stretch_of(const Eigen::Vector3d& edge, double wanted_mm) {
  return (edge.squaredNorm() - wanted_mm * wanted_mm) / (2 * wanted_mm);
}

}  // namespace

/// Blocks of the second derivatives by two nodes. What held nodes would add is left out.
class Catheter::Blocks {
 public:
  Blocks(BandedCholesky<kBand>& hessian, Eigen::Index free_nodes)
      : hessian_(hessian), free_nodes_(free_nodes) {}

  /// Adds block to (a, b) and its transpose to (b, a); lower half only.
  void add(Eigen::Index a, Eigen::Index b, const Eigen::Matrix3d& block) {
    if (a >= free_nodes_ || b >= free_nodes_) {
      return;
    }
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        const Eigen::Index row = 3 * a + i;
        const Eigen::Index column = 3 * b + j;
        if (row >= column) {
          hessian_.add(row, column, block(i, j));
        } else if (a != b) {
          hessian_.add(column, row, block(i, j));
        }
      }
    }
  }

  /// The same of `value` times the identity.
  void add(Eigen::Index a, Eigen::Index b, double value) {
    if (a < free_nodes_ && b < free_nodes_) {
      for (int i = 0; i < 3; ++i) {
        hessian_.add(3 * std::max(a, b) + i, 3 * std::min(a, b) + i, value);
      }
    }
  }

 private:
  BandedCholesky<kBand>& hessian_;
  Eigen::Index free_nodes_;
};

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

double Catheter::energy(const Eigen::Matrix3Xd& nodes, Eigen::Matrix3Xd& gradient) const {
  gradient.setZero(3, nodes.cols());
  double energy = -tip_force_N_.dot(nodes.col(0));
  gradient.col(0) -= tip_force_N_;
  add_bending(nodes, energy, gradient);
  add_stretch(nodes, energy, gradient);
  add_wall(nodes, energy, gradient);
  if (bend_rad_ != 0) {
    carry_frames(nodes);
    add_actuation(nodes, energy, gradient);
    add_turning_of_frames(nodes, gradient);
  }
  return energy;
}

void Catheter::assemble(const Eigen::Matrix3Xd& nodes, BandedCholesky<kBand>& hessian) const {
  hessian.reset(3 * free_nodes_);
  Blocks blocks(hessian, free_nodes_);
  add_bending(blocks);
  add_stretch(nodes, blocks);
  add_wall(nodes, blocks);
  if (bend_rad_ != 0) {
    add_actuation(nodes, blocks);
  }
}

// Bending

void Catheter::add_bending(const Eigen::Matrix3Xd& nodes, double& energy, Eigen::Matrix3Xd& gradient) const {
  const double h = spacing_mm_;
  for (Eigen::Index node = 1; node <= free_nodes_; ++node) {
    // E = E I / 2 integral kappa^2 ds with kappa = |x_{i-1} - 2 x_i + x_{i+1}| / h^2: E I / (2 h^3) |...|^2 a
    // node.
    const Eigen::Vector3d bend = nodes.col(node - 1) - 2 * nodes.col(node) + nodes.col(node + 1);
    const double stiffness = bending_stiffness(node) / (h * h * h);
    energy += stiffness / 2 * bend.squaredNorm();
    gradient.col(node - 1) += stiffness * bend;
    gradient.col(node) -= 2 * stiffness * bend;
    gradient.col(node + 1) += stiffness * bend;
  }
}

void Catheter::add_bending(Blocks& blocks) const {
  const double h = spacing_mm_;
  for (Eigen::Index node = 1; node <= free_nodes_; ++node) {
    const double stiffness = bending_stiffness(node) / (h * h * h);
    blocks.add(node - 1, node - 1, stiffness);
    blocks.add(node, node, 4 * stiffness);
    blocks.add(node + 1, node + 1, stiffness);
    blocks.add(node, node - 1, -2 * stiffness);
    blocks.add(node + 1, node, -2 * stiffness);
    blocks.add(node + 1, node - 1, stiffness);
  }
}

// Edges that keep their lengths

void Catheter::add_stretch(const Eigen::Matrix3Xd& nodes, double& energy, Eigen::Matrix3Xd& gradient) const {
  for (Eigen::Index edge = 0; edge < free_nodes_; ++edge) {
    const Eigen::Vector3d e = edge_at(nodes, edge);
    const double l = edge_mm_[edge];
    const double stretch = stretch_of(e, l);
    energy += edge_force_N_[edge] * stretch + kEdgeStiffness_N_per_mm / 2 * stretch * stretch;
    // Augmented Lagrangian: lambda c + k / 2 c^2 with c = (|e|^2 - l^2) / (2 l), whose gradient by e is e /
    // l.
    const Eigen::Vector3d pull = (edge_force_N_[edge] + kEdgeStiffness_N_per_mm * stretch) / l * e;
    gradient.col(edge) += pull;
    gradient.col(edge + 1) -= pull;
  }
}

void Catheter::add_stretch(const Eigen::Matrix3Xd& nodes, Blocks& blocks) const {
  for (Eigen::Index edge = 0; edge < free_nodes_; ++edge) {
    const Eigen::Vector3d e = edge_at(nodes, edge);
    const double l = edge_mm_[edge];
    const double force = edge_force_N_[edge] + kEdgeStiffness_N_per_mm * stretch_of(e, l);
    // (lambda + k c) d^2c + k dc dc^T with dc = e / l and d^2c = I / l.
    const Eigen::Matrix3d block =
        kEdgeStiffness_N_per_mm / (l * l) * e * e.transpose() + force / l * Eigen::Matrix3d::Identity();
    blocks.add(edge, edge, block);
    blocks.add(edge + 1, edge + 1, block);
    blocks.add(edge + 1, edge, -block);
  }
}

double Catheter::take_up_stretch() {
  double greatest = 0;
  for (Eigen::Index edge = 0; edge < free_nodes_; ++edge) {
    const double stretch = stretch_of(edge_at(nodes_, edge), edge_mm_[edge]);
    // Multiplier update: lambda += k c.
    edge_force_N_[edge] += kEdgeStiffness_N_per_mm * stretch;
    greatest = std::max(greatest, std::abs(stretch) / edge_mm_[edge]);
  }
  return greatest;
}

// A wall that yields as a spring

void Catheter::add_wall(const Eigen::Matrix3Xd& nodes, double& energy, Eigen::Matrix3Xd& gradient) const {
  const double stiffness = properties_.wall_stiffness_N_mm2 * spacing_mm_;
  for (Eigen::Index node = 0; wall_ != nullptr && node < free_nodes_; ++node) {
    if (wall_->distance_mm(nodes.col(node)) < properties_.diameter_mm / 2) {
      const WallDistance wall = wall_->at(nodes.col(node));
      const double penetration = properties_.diameter_mm / 2 - wall.distance_mm;
      // E = k / 2 d^2, d the depth in the wall; d = radius - distance, so that grad d = -grad distance.
      energy += stiffness / 2 * penetration * penetration;
      gradient.col(node) -= stiffness * penetration * wall.gradient;
    }
  }
}

void Catheter::add_wall(const Eigen::Matrix3Xd& nodes, Blocks& blocks) const {
  const double stiffness = properties_.wall_stiffness_N_mm2 * spacing_mm_;
  for (Eigen::Index node = 0; wall_ != nullptr && node < free_nodes_; ++node) {
    const WallDistance wall = wall_->at(nodes.col(node));
    const double penetration = properties_.diameter_mm / 2 - wall.distance_mm;
    if (penetration > 0) {
      blocks.add(node, node,
                 stiffness * (wall.gradient * wall.gradient.transpose() - penetration * wall.hessian_per_mm));
    }
  }
}

// The actuated tip wants to turn toward d, carried with the catheter: - E I / h tan(rest) f.d / h.

double Catheter::actuation_at(Eigen::Index node) const {
  const double rest = std::tan(bend_rad_ / properties_.segments_in_tip);
  return bending_stiffness(node) / (spacing_mm_ * spacing_mm_) * rest;
}

/// d for an edge of direction t, where the frame has been carried to.
Eigen::Vector3d Catheter::actuation_direction(Eigen::Index node, const Eigen::Vector3d& t) const {
  return std::cos(tip_roll_rad_) * u_.col(node) +
         std::sin(tip_roll_rad_) * t.cross(Eigen::Vector3d(u_.col(node)));
}

void Catheter::add_actuation(const Eigen::Matrix3Xd& nodes, double& energy,
                             Eigen::Matrix3Xd& gradient) const {
  moment_.setZero(properties_.segments_in_tip + 1);
  for (Eigen::Index node = 1; in_bendable_tip(node); ++node) {
    const double share = actuation_at(node);
    const Eigen::Vector3d f = edge_at(nodes, node - 1);
    const Eigen::Vector3d e = edge_at(nodes, node);
    const Eigen::Vector3d t = e.normalized();
    const Eigen::Vector3d d = actuation_direction(node, t);
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
}

// Moving a node also turns the frames carried past it (Bergou 2008, gradient of the holonomy).
void Catheter::add_turning_of_frames(const Eigen::Matrix3Xd& nodes, Eigen::Matrix3Xd& gradient) const {
  double torque = 0;
  for (Eigen::Index node = 1; node <= free_nodes_; ++node) {
    if (node >= 2 && in_bendable_tip(node - 1)) {
      torque += moment_[node - 1];
    }
    const Eigen::Vector3d e = edge_at(nodes, node);
    const Eigen::Vector3d f = edge_at(nodes, node - 1);
    const Eigen::Vector3d binormal = 2 * e.cross(f) / (e.norm() * f.norm() + e.dot(f));
    const Eigen::Vector3d at_base = torque * binormal / (2 * e.norm());
    const Eigen::Vector3d at_tip = -torque * binormal / (2 * f.norm());
    gradient.col(node + 1) += at_base;
    gradient.col(node - 1) += at_tip;
    gradient.col(node) -= at_base + at_tip;
  }
}

void Catheter::add_actuation(const Eigen::Matrix3Xd& nodes, Blocks& blocks) const {
  for (Eigen::Index node = 1; in_bendable_tip(node); ++node) {
    const double share = actuation_at(node);
    const Eigen::Vector3d e = edge_at(nodes, node);
    const Eigen::Vector3d t = e.normalized();
    const Eigen::Vector3d d = actuation_direction(node, t);
    const Eigen::Matrix3d by_f_and_e = share / e.norm() * t * d.transpose();  // of f = node - 1 to node
    const Eigen::Matrix3d both = by_f_and_e + by_f_and_e.transpose();
    blocks.add(node - 1, node, by_f_and_e);
    blocks.add(node - 1, node + 1, -by_f_and_e);
    blocks.add(node, node, -both);
    blocks.add(node, node + 1, by_f_and_e);
    // Second order of d and t in e: without it a tip that turns as a whole would seem to store energy.
    const Eigen::Vector3d f = edge_at(nodes, node - 1);
    const Eigen::Vector3d aside = f - f.dot(t) * t;
    const Eigen::Matrix3d half = share / e.squaredNorm() * d * (aside / 2 - f.dot(t) * t).transpose();
    const Eigen::Matrix3d by_e = half + half.transpose();
    blocks.add(node, node, by_e);
    blocks.add(node + 1, node + 1, by_e);
    blocks.add(node + 1, node, -by_e);
  }
}

}  // namespace tubed
