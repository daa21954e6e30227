#include "clients/calibration/pivot_calibration.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>
#include <random>

#include "clients/calibration/formatted.hpp"
#include "clients/calibration/median.hpp"
#include "clients/calibration/tail_probability.hpp"

namespace tubed {

namespace {

constexpr std::size_t kMinPoses = 30;
constexpr double kMinTurn_deg = 10;
constexpr double kMaxOutliers = 0.3;
constexpr double kManyOutliers = 0.02;
constexpr double kMaxAcross_mm = 2;
constexpr double kMinTip_mm = 5;    // from the coil; nearer only in another unit
constexpr double kMinAway_mm = 40;  // of a field generator: an Aurora's volume begins at 50 mm
constexpr double kDeg = std::numbers::pi / 180;

using Poses = std::vector<ProbePose>;
using Indices = std::vector<std::size_t>;

/// Unknowns x: the tip offset (only its z for 5 DOF), then the pivot.
class PivotModel {
 public:
  PivotModel(const Poses& poses, ProbeFreedom freedom)
      : poses_(poses), offsets_(freedom == ProbeFreedom::kFive ? 1 : 3) {}

  [[nodiscard]] Eigen::Index unknowns() const { return offsets_ + 3; }
  [[nodiscard]] Eigen::Vector3d offset_mm(const Eigen::VectorXd& x) const {
    return offsets_ == 1 ? Eigen::Vector3d(0, 0, x(0)) : Eigen::Vector3d(x.head<3>());
  }
  [[nodiscard]] Eigen::Vector3d pivot_mm(const Eigen::VectorXd& x) const { return x.tail<3>(); }

  /// R_i^T (c - p_i) - o
  [[nodiscard]] Eigen::Vector3d residual_mm(const Eigen::VectorXd& x, std::size_t i) const {
    const ProbePose& pose = poses_[i];
    return pose.q_em_probe.conjugate() * (pivot_mm(x) - pose.p_em_mm) - offset_mm(x);
  }

  /// R_i o - c = -p_i of the poses named, by linear least squares.
  [[nodiscard]] Eigen::VectorXd solve(const Indices& used) const {
    const auto rows = static_cast<Eigen::Index>(3 * used.size());
    Eigen::MatrixXd A(rows, unknowns());
    Eigen::VectorXd b(rows);
    for (std::size_t k = 0; k < used.size(); ++k) {
      const ProbePose& pose = poses_[used[k]];
      const auto row = static_cast<Eigen::Index>(3 * k);
      A.block(row, 0, 3, offsets_) = pose.q_em_probe.toRotationMatrix().rightCols(offsets_);
      A.block(row, offsets_, 3, 3) = -Eigen::Matrix3d::Identity();
      b.segment<3>(row) = -pose.p_em_mm;
    }
    return A.colPivHouseholderQr().solve(b);
  }

 private:
  const Poses& poses_;
  Eigen::Index offsets_;
};

Indices all_of(const Poses& poses) {
  Indices all(poses.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  return all;
}

/// Least median of squares over random samples: Rousseeuw, "Least median of squares regression", JASA 79
/// (1984).
Eigen::VectorXd robust_start(const PivotModel& model, std::size_t count) {
  constexpr int kSamples = 200;
  constexpr std::size_t kSampleSize = 12;
  std::mt19937 random(1);  // fixed: the same file gives the same result
  Eigen::VectorXd best = Eigen::VectorXd::Zero(model.unknowns());
  double best_mm2 = std::numeric_limits<double>::infinity();
  for (int sample = 0; sample < kSamples; ++sample) {
    Indices used;
    for (std::size_t k = 0; k < kSampleSize; ++k) used.push_back(random() % count);
    const Eigen::VectorXd x = model.solve(used);
    std::vector<double> squared_mm2;
    for (std::size_t i = 0; i < count; ++i) squared_mm2.push_back(model.residual_mm(x, i).squaredNorm());
    const double median_mm2 = median_of(std::move(squared_mm2));
    if (median_mm2 < best_mm2) {
      best_mm2 = median_mm2;
      best = x;
    }
  }
  return best;
}

/// Poses whose residual is no larger than one in all of them is by chance (1 %), for the sigma that the
/// median says.
Indices inliers_of(const PivotModel& model, const Eigen::VectorXd& x, std::size_t count) {
  std::vector<double> squared_mm2;
  for (std::size_t i = 0; i < count; ++i) squared_mm2.push_back(model.residual_mm(x, i).squaredNorm());
  constexpr double kMinSigma_mm = 0.02;
  const double sigma2_mm2 =
      std::max(median_of(squared_mm2) / chi_square_quantile(0.5, 3), kMinSigma_mm * kMinSigma_mm);
  const double limit_mm2 = sigma2_mm2 * chi_square_quantile(1 - 0.01 / static_cast<double>(count), 3);
  Indices inliers;
  for (std::size_t i = 0; i < count; ++i) {
    if (squared_mm2[i] <= limit_mm2) inliers.push_back(i);
  }
  return inliers;
}

struct Noise {
  double position_mm = 0;
  double angle_rad = 0;
};

/// Both sigmas from the mean squares along and across o, for as many unknowns as were fitted.
Noise noise_of(const PivotModel& model, const Eigen::VectorXd& x, const Indices& used) {
  constexpr double kMinSigma_mm = 1e-3;
  const Eigen::Vector3d o_mm = model.offset_mm(x);
  const Eigen::Vector3d along = o_mm.normalized();
  double along_mm2 = 0;
  double across_mm2 = 0;
  for (const std::size_t i : used) {
    const Eigen::Vector3d r_mm = model.residual_mm(x, i);
    const double a_mm = r_mm.dot(along);
    along_mm2 += a_mm * a_mm;
    across_mm2 += r_mm.squaredNorm() - a_mm * a_mm;
  }
  const auto n = static_cast<double>(used.size());
  const double freed = 3 * n / (3 * n - static_cast<double>(model.unknowns()));
  const double along_variance = freed * along_mm2 / n;
  const double across_variance = freed * across_mm2 / (2 * n);
  if (across_variance <= along_variance || o_mm.norm() < 1) {
    return {std::max(std::sqrt((along_variance + 2 * across_variance) / 3), kMinSigma_mm), 0};
  }
  return {std::max(std::sqrt(along_variance), kMinSigma_mm),
          std::sqrt(across_variance - along_variance) / o_mm.norm()};
}

/// The whitened residuals of the poses used.
Eigen::VectorXd whitened(const PivotModel& model, const Eigen::VectorXd& x, const Indices& used,
                         const Noise& noise) {
  const Eigen::Vector3d o_mm = model.offset_mm(x);
  const Eigen::Vector3d along = o_mm.norm() < 1 ? Eigen::Vector3d(0, 0, 1) : o_mm.normalized().eval();
  const double across_mm = std::hypot(noise.position_mm, noise.angle_rad * o_mm.norm());
  Eigen::VectorXd f(static_cast<Eigen::Index>(3 * used.size()));
  for (std::size_t k = 0; k < used.size(); ++k) {
    const Eigen::Vector3d r_mm = model.residual_mm(x, used[k]);
    const Eigen::Vector3d a_mm = along * along.dot(r_mm);
    f.segment<3>(static_cast<Eigen::Index>(3 * k)) = a_mm / noise.position_mm + (r_mm - a_mm) / across_mm;
  }
  return f;
}

Eigen::MatrixXd jacobian(const PivotModel& model, const Eigen::VectorXd& x, const Indices& used,
                         const Noise& noise) {
  constexpr double kStep_mm = 1e-3;
  Eigen::MatrixXd J(static_cast<Eigen::Index>(3 * used.size()), model.unknowns());
  for (Eigen::Index k = 0; k < model.unknowns(); ++k) {
    const Eigen::VectorXd step = kStep_mm * Eigen::VectorXd::Unit(model.unknowns(), k);
    J.col(k) =
        (whitened(model, x + step, used, noise) - whitened(model, x - step, used, noise)) / (2 * kStep_mm);
  }
  return J;
}

struct Refined {
  Eigen::VectorXd x;
  Eigen::MatrixXd covariance;
  Noise noise;
};

/// Gauss-Newton with the noise estimated anew before each step; 20 steps at most, until none is above 1 um.
Refined refine(const PivotModel& model, Eigen::VectorXd x, const Indices& used) {
  Refined refined;
  for (int round = 0; round < 20; ++round) {
    refined.noise = noise_of(model, x, used);
    const Eigen::MatrixXd J = jacobian(model, x, used, refined.noise);
    const Eigen::MatrixXd normal = J.transpose() * J;
    const Eigen::VectorXd step =
        normal.ldlt().solve(-J.transpose() * whitened(model, x, used, refined.noise));
    refined.covariance = normal.inverse();
    if (!step.allFinite()) break;
    x += step;
    if (step.lpNorm<Eigen::Infinity>() < 1e-3) break;
  }
  refined.x = x;
  return refined;
}

/// For 6 DOF the axis that kept its direction best decides, for 5 DOF the coil's.
double turned_rad(const Poses& poses, const Indices& used, ProbeFreedom freedom) {
  Eigen::Matrix3d mean = Eigen::Matrix3d::Zero();
  for (const std::size_t i : used) mean += poses[i].q_em_probe.toRotationMatrix();
  mean /= static_cast<double>(used.size());
  // mean of |R d - mean(R) d|^2 for the direction d of the probe is d^T (I - M^T M) d
  const Eigen::Matrix3d spread = Eigen::Matrix3d::Identity() - mean.transpose() * mean;
  const double least =
      freedom == ProbeFreedom::kFive
          ? spread(2, 2)
          : Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread, Eigen::EigenvaluesOnly).eigenvalues()(0);
  return std::asin(std::sqrt(std::clamp(least, 0.0, 1.0)));
}

PivotCalibration fitted(const Poses& poses, ProbeFreedom freedom) {
  const PivotModel model(poses, freedom);
  Eigen::VectorXd x = robust_start(model, poses.size());
  Indices used = inliers_of(model, x, poses.size());
  for (int round = 0; round < 5; ++round) {
    x = model.solve(used);
    Indices again = inliers_of(model, x, poses.size());
    if (again == used) break;
    used = std::move(again);
  }
  const Refined refined = refine(model, x, used);
  PivotCalibration pivot;
  pivot.freedom = freedom;
  pivot.tip_offset_mm = model.offset_mm(refined.x);
  pivot.pivot_em_mm = model.pivot_mm(refined.x);
  const Eigen::Index offsets = model.unknowns() - 3;
  pivot.covariance_mm2.bottomRightCorner(offsets, offsets) =
      refined.covariance.topLeftCorner(offsets, offsets);
  pivot.sigma_position_mm = refined.noise.position_mm;
  pivot.sigma_angle_rad = refined.noise.angle_rad;
  pivot.turned_rad = turned_rad(poses, used, freedom);
  for (std::size_t i = 0; i < poses.size(); ++i)
    pivot.residuals_mm.push_back(model.residual_mm(refined.x, i));
  const Eigen::Vector3d along = pivot.tip_offset_mm.normalized();
  for (const std::size_t i : used) {
    const Eigen::Vector3d& r_mm = pivot.residuals_mm[i];
    pivot.residual_mm += r_mm.squaredNorm();
    pivot.across_mm += r_mm.squaredNorm() - std::pow(r_mm.dot(along), 2);
  }
  pivot.residual_mm = std::sqrt(pivot.residual_mm / static_cast<double>(used.size()));
  pivot.across_mm = std::sqrt(std::max(pivot.across_mm, 0.0) / static_cast<double>(used.size()));
  const Indices all = all_of(poses);
  std::set_difference(all.begin(), all.end(), used.begin(), used.end(), std::back_inserter(pivot.outliers));
  return pivot;
}

CalibrationFinding check_turn(const PivotCalibration& pivot) {
  const double turn_deg = pivot.turned_rad / kDeg;
  const std::string evidence = formatted("the probe was turned by %.1f degrees RMS", turn_deg);
  if (turn_deg < kMinTurn_deg) {
    return {"turn", ReportVerdict::kBad, evidence,
            pivot.freedom == ProbeFreedom::kFive
                ? "keep the tip in its hole and lean the probe 30 degrees and more to all sides"
                : "keep the tip in its hole, lean the probe 30 degrees and more to all sides, and spin it"};
  }
  return {"turn", ReportVerdict::kGood, evidence, ""};
}

/// Metres and inches put the probe nearer to the field generator than any tracker measures.
CalibrationFinding check_units(const PivotCalibration& pivot, const Poses& poses) {
  std::vector<double> away_mm;
  for (const ProbePose& pose : poses) away_mm.push_back(pose.p_em_mm.norm());
  const double usual_mm = median_of(away_mm);
  const double tip_mm = pivot.tip_offset_mm.norm();
  const std::string evidence = formatted(
      "the tip lies %.1f mm from the coil, the coil %.3g mm from the tracker's origin", tip_mm, usual_mm);
  if (tip_mm < kMinTip_mm && usual_mm < kMinAway_mm) {
    return {"units", ReportVerdict::kBad, evidence,
            "positions seem to be in metres or inches: write them in mm"};
  }
  return {"units", ReportVerdict::kGood, evidence, ""};
}

/// A coil of five degrees of freedom points along the probe, toward its tip.
CalibrationFinding check_direction(const PivotCalibration& pivot) {
  const double along_mm = pivot.tip_offset_mm.z();
  if (along_mm < 0) {
    return {"direction", ReportVerdict::kDoubtful,
            formatted("the tip lies %.1f mm behind the coil", -along_mm),
            "the coil's direction points away from the tip: right where it is mounted so and its directions "
            "are used as measured here, otherwise exchange their sign in the file"};
  }
  return {"direction", ReportVerdict::kGood, "the coil points toward the tip", ""};
}

CalibrationFinding check_outliers(const PivotCalibration& pivot) {
  const auto count = static_cast<double>(pivot.residuals_mm.size());
  const double share = static_cast<double>(pivot.outliers.size()) / count;
  if (pivot.outliers.empty()) return {"tip", ReportVerdict::kGood, "it stayed in its hole", ""};
  const std::string evidence =
      formatted("at %zu of %.0f measurements it was elsewhere, measurements %zu to %zu",
                pivot.outliers.size(), count, pivot.outliers.front() + 1, pivot.outliers.back() + 1);
  if (share > kMaxOutliers) {
    return {"tip", ReportVerdict::kBad, evidence,
            "the tip slid or was lifted, and nobody can tell which hole is meant: do it again with a deeper "
            "hole"};
  }
  if (share > kManyOutliers) {
    return {"tip", ReportVerdict::kDoubtful, evidence + "; these were left out",
            "was the probe lifted? End the recording before, or do it again"};
  }
  return {"tip", ReportVerdict::kGood, evidence + "; these were left out", ""};
}

CalibrationFinding check_sigma(const PivotCalibration& pivot, double max_sigma_mm) {
  const double sigma_mm = pivot.sigma_tip_mm();
  const std::string evidence = formatted("the tip is known to %.3f mm (one standard deviation)", sigma_mm);
  // a singular normal matrix gives no number
  if (!(sigma_mm <= max_sigma_mm)) {
    return {"sigma", ReportVerdict::kBad, evidence,
            formatted("more than %.2f mm: lean the probe further, to all sides, and longer", max_sigma_mm)};
  }
  return {"sigma", ReportVerdict::kGood, evidence, ""};
}

CalibrationFinding check_across(const PivotCalibration& pivot) {
  std::string evidence =
      formatted("residual %.2f mm RMS, of it %.2f mm across the axis", pivot.residual_mm, pivot.across_mm);
  if (pivot.freedom == ProbeFreedom::kFive) {
    evidence += formatted(
        ": directions that err by %.2f degrees, or a tip up to %.1f mm beside the axis (if the "
        "probe was spun)",
        pivot.sigma_angle_rad / kDeg, pivot.max_beside_axis_mm());
  }
  if (pivot.across_mm > kMaxAcross_mm) {
    return {"residual", ReportVerdict::kDoubtful, evidence,
            "the probe is bent, the coil sits askew, the hole is too wide, or metal is near"};
  }
  return {"residual", ReportVerdict::kGood, evidence, ""};
}

}  // namespace

double PivotCalibration::sigma_tip_mm() const { return std::sqrt(covariance_mm2.trace()); }

double PivotCalibration::max_beside_axis_mm() const {
  return std::sqrt(std::max(across_mm * across_mm - 2 * sigma_position_mm * sigma_position_mm, 0.0));
}

JudgedPivot calibrate_pivot(const std::vector<ProbePose>& poses, ProbeFreedom freedom, double max_sigma_mm) {
  JudgedPivot judged;
  judged.pivot.freedom = freedom;
  Poses seen;
  std::copy_if(poses.begin(), poses.end(), std::back_inserter(seen),
               [](const ProbePose& pose) { return pose.is_seen && pose.p_em_mm.allFinite(); });
  const std::string count = formatted("%zu measurements", seen.size());
  if (seen.size() < kMinPoses) {
    judged.findings.push_back({"count", ReportVerdict::kBad, count,
                               formatted("expected %zu at least: turn the probe for 20 s", kMinPoses)});
    return judged;
  }
  judged.findings.push_back({"count", ReportVerdict::kGood, count, ""});
  judged.pivot = fitted(seen, freedom);
  std::vector<CalibrationFinding> checks{check_turn(judged.pivot), check_units(judged.pivot, seen),
                                         check_outliers(judged.pivot),
                                         check_sigma(judged.pivot, max_sigma_mm), check_across(judged.pivot)};
  if (freedom == ProbeFreedom::kFive) checks.push_back(check_direction(judged.pivot));
  for (CalibrationFinding& finding : checks) {
    judged.findings.push_back(std::move(finding));
    if (judged.findings.back().verdict == ReportVerdict::kBad) break;
  }
  return judged;
}

}  // namespace tubed
