// Where the tip of a probe is in its sensor's frame, from turning the probe about a tip that rests in a fixed
// hole.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "clients/calibration/probe_pose.hpp"
#include "clients/calibration/registration_findings.hpp"

namespace tubed {

/// What a pivot calibration found. Residuals are those of poses that are no outliers: of the pivot, seen from
/// the tip, c - p_i - R_i o.
struct PivotCalibration {
  ProbeFreedom freedom = ProbeFreedom::kFive;
  Eigen::Vector3d tip_offset_mm = Eigen::Vector3d::Zero();  ///< o, in the probe's frame; (0, 0, l) for 5 DOF
  Eigen::Vector3d pivot_em_mm = Eigen::Vector3d::Zero();    ///< c
  /// Of the tip offset; of 5 DOF only zz is known, the others are 0.
  Eigen::Matrix3d covariance_mm2 = Eigen::Matrix3d::Zero();
  double sigma_position_mm = 0;  ///< of one measured position along an axis, from the residuals along o
  double sigma_angle_rad = 0;    ///< of one measured direction about an axis, from what is left across o
  double residual_mm = 0;        ///< RMS of the lengths
  double across_mm = 0;          ///< RMS of their parts across o, both axes together
  double turned_rad = 0;  ///< RMS turn of the probe from its mean attitude, about the axis that turned least
  std::vector<Eigen::Vector3d> residuals_mm;  ///< of all poses, probe frame: across, across, along for 5 DOF
  std::vector<std::size_t> outliers;          ///< poses at which the tip was not in the hole

  /// Standard deviation of the tip, RMS of its length, mm.
  [[nodiscard]] double sigma_tip_mm() const;
  /// How far the tip may lie beside the axis of a 5-DOF coil: what scatters across the axis beyond what
  /// positions scatter along it, if all of that were the tip going round while the probe was spun; mm.
  [[nodiscard]] double max_beside_axis_mm() const;
};

/// A calibration and what is to be said of it; when a finding is bad it must not be used.
struct JudgedPivot {
  PivotCalibration pivot;
  std::vector<CalibrationFinding> findings;
};

/// p_i + R_i o = c for all poses: R_i o - c = -p_i by linear least squares is the start ("algebraic one-step
/// method" of Yaniv, "Which pivot calibration?", Proc. SPIE 9415 (2015) 941527; for 5 DOF with o = (0, 0, l),
/// of which nothing else can be known), on the best of 200 random samples of poses, without outliers. Then
/// the whitened residuals
///   along o:  r_a / s_p,    across o:  r_c / sqrt(s_p^2 + s_a^2 |o|^2)
/// are minimised over o and c, with s_p and s_a from the residuals: linear least squares takes directions as
/// exact, and finds |o| too small by about s_a^2 over the squared turn. The covariance is the inverse of the
/// normal matrix, for measurements that err independently. Bad: fewer than 30 poses; a turn of less than 10
/// degrees RMS; more than 30 % outliers (the tip slid, or was lifted); sigma_tip_mm() > `max_sigma_mm`.
/// Doubtful: more than 2 % outliers; a residual across of more than 2 mm.
JudgedPivot calibrate_pivot(const std::vector<ProbePose>& poses, ProbeFreedom freedom,
                            double max_sigma_mm = 0.5);

}  // namespace tubed
