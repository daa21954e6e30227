// A catheter in a vessel by minimum energy: where it lies after every command.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "drivers/laboratory/instrument/banded_cholesky.hpp"
#include "drivers/laboratory/instrument/catheter_shape.hpp"
#include "drivers/laboratory/instrument/hook.hpp"
#include "drivers/laboratory/vessel/vessel.hpp"

namespace tubed {

/// What the catheter is made of. Stiffnesses of a 7 Fr catheter are not in the paper; these are the order of
/// magnitude of a tube of 2.33 / 1.5 mm and 60 MPa. Shapes depend on their ratios only.
struct CatheterProperties {
  double diameter_mm = 2.33;            ///< 7 Fr
  double bendable_tip_mm = 50;          ///< Sec. 3.1
  double bending_stiffness_N_mm2 = 70;  ///< E I
  double tip_bending_stiffness_N_mm2 = 35;
  double torsional_stiffness_N_mm2 = 70;  ///< G J
  double wall_stiffness_N_mm2 = 0.2;      ///< force a mm of penetration, of each mm of catheter
  int segments_in_tip = 16;               ///< the catheter's nodes are bendable_tip_mm / segments apart
  Hook hook{};  ///< that shape() has beside what the mechanics make of a straight tip
};

/// One positioning command, Sec. 3.1: insertion (negative: retraction), rotation about the own axis at the
/// introducer, bending of the tip: the angle by which the unloaded tip turns, more or less.
struct CatheterCommand {
  double insert_mm = 0;
  double rotate_rad = 0;
  double bend_rad = 0;
};

/// How a step ended. Lengths in mm over the part in the vessel.
struct StepReport {
  double max_penetration_mm = 0;     ///< of the catheter's surface into the wall
  double median_penetration_mm = 0;  ///< over the nodes in contact; 0 without any
  double max_length_error = 0;       ///< of a segment, as a share of its length
  double length_error = 0;           ///< of the whole, as a share
  double tip_move_mm = 0;
  double max_move_mm = 0;  ///< of a node, beyond following the catheter's own path
  int iterations = 0;
  bool snapped = false;    ///< max_move_mm above kSnap_mm: it jumped into another equilibrium
  bool converged = false;  ///< the forces are in balance
  bool stable = false;     ///< and the energy is least there, not only stationary
};

/// An inextensible elastic rod with an actuated tip, clamped in the introducer, pressed against a wall that
/// yields as a spring. After every command it lies where its energy (bending + torsion + wall) is least,
/// found by Newton's method from where it lay before; no friction, no inertia. Torsion is uniform along the
/// passive part (its equilibrium) and known by one angle; frames are carried along the curve without twist,
/// after Bergou et al., "Discrete elastic rods" (2008). Deterministic. One thread.
class Catheter {
 public:
  static constexpr double kSnap_mm = 3;

  /// Lies along the vessel's route, `insertion_mm` from introducer to tip, and is let go. Throws
  /// std::invalid_argument for an insertion shorter than the bendable tip and for a hook longer than it.
  /// `wall` may be nullptr (nothing to touch: the rod starts straight) and has to outlive the catheter.
  Catheter(const CatheterProperties& properties, const Introducer& introducer, const WallField* wall,
           const std::vector<VesselStation>& route, double insertion_mm, double roll_rad = 0);

  StepReport apply(const CatheterCommand& command);

  /// A force at the tip, N, world frame: what the closed forms of tests are about.
  void pull_tip(const Eigen::Vector3d& force_N) { tip_force_N_ = force_N; }

  [[nodiscard]] CatheterShape shape() const;
  [[nodiscard]] double insertion_mm() const { return insertion_mm_; }
  [[nodiscard]] double spacing_mm() const { return spacing_mm_; }
  /// Roll of the tip against the frame that is carried along from the introducer.
  [[nodiscard]] double tip_roll_rad() const { return tip_roll_rad_; }
  /// Energy of a state of nodes (3 x n, tip first, as many as the catheter has) in N mm, with its gradient:
  /// for tests by finite differences.
  double energy(const Eigen::Matrix3Xd& nodes_world_mm, Eigen::Matrix3Xd& gradient_N) const;
  [[nodiscard]] const Eigen::Matrix3Xd& nodes_world_mm() const { return nodes_; }
  /// Nodes 0 .. free_nodes() - 1 move, the others are held by the introducer.
  [[nodiscard]] Eigen::Index free_nodes() const { return free_nodes_; }

 private:
  static constexpr int kBand = 8;  ///< bending couples a node with its two neighbours to either side

  class Blocks;

  void place_held_nodes();
  void follow_itself(double advance_mm);
  void set_edge_lengths();
  bool minimise(StepReport& report);
  bool settle(StepReport& report);
  void shake(int kick);
  bool balance(StepReport& report);
  double solve_roll();
  void carry_frames(const Eigen::Matrix3Xd& nodes) const;
  /// Corrects the multipliers; the greatest share by which an edge was stretched.
  double take_up_stretch();
  void assemble(const Eigen::Matrix3Xd& nodes, BandedCholesky<kBand>& hessian) const;
  // Terms of energy() and, with the same names, of assemble().
  void add_bending(const Eigen::Matrix3Xd& nodes, double& energy, Eigen::Matrix3Xd& gradient) const;
  void add_bending(Blocks& blocks) const;
  void add_stretch(const Eigen::Matrix3Xd& nodes, double& energy, Eigen::Matrix3Xd& gradient) const;
  void add_stretch(const Eigen::Matrix3Xd& nodes, Blocks& blocks) const;
  void add_wall(const Eigen::Matrix3Xd& nodes, double& energy, Eigen::Matrix3Xd& gradient) const;
  void add_wall(const Eigen::Matrix3Xd& nodes, Blocks& blocks) const;
  void add_actuation(const Eigen::Matrix3Xd& nodes, double& energy, Eigen::Matrix3Xd& gradient) const;
  void add_actuation(const Eigen::Matrix3Xd& nodes, Blocks& blocks) const;
  void add_turning_of_frames(const Eigen::Matrix3Xd& nodes, Eigen::Matrix3Xd& gradient) const;
  [[nodiscard]] double actuation_at(Eigen::Index node) const;
  [[nodiscard]] Eigen::Vector3d actuation_direction(Eigen::Index node, const Eigen::Vector3d& t) const;
  void measure(const Eigen::Matrix3Xd& predicted, StepReport& report) const;
  [[nodiscard]] double bending_stiffness(Eigen::Index node) const;
  [[nodiscard]] bool in_bendable_tip(Eigen::Index node) const;

  CatheterProperties properties_;
  Introducer introducer_;
  const WallField* wall_;
  double spacing_mm_;
  double insertion_mm_;
  double bend_rad_ = 0;
  double base_roll_rad_;
  double tip_roll_rad_;
  Eigen::Index free_nodes_ = 0;
  Eigen::Vector3d tip_force_N_ = Eigen::Vector3d::Zero();
  Eigen::Matrix3Xd nodes_;          ///< tip first; the last ones stand in a row before the introducer
  Eigen::VectorXd edge_mm_;         ///< length that the edge i, i + 1 has to have
  Eigen::VectorXd edge_force_N_;    ///< multiplier of that: tension
  mutable Eigen::Matrix3Xd u_;      ///< carried normal of edge i, i + 1
  mutable Eigen::VectorXd moment_;  ///< torque of the actuated tip at node i
  Eigen::Matrix3Xd gradient_;
  BandedCholesky<kBand> hessian_;
};

}  // namespace tubed
