#include "clients/calibration/rigid_correction.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <utility>

#include "daemon/estimator/algebra/linear_evidence.hpp"
#include "idl/geometry/squared.hpp"

namespace tubed {

namespace {

constexpr double kAnyShift_mm = 50;
constexpr double kAnyTurn_rad = 0.3;
constexpr double kMinLocal_mm = 0.1;
constexpr double kMaxLocal_mm = 6;
constexpr double kStep = 1.33;
constexpr double kMaxCorrelation = 0.95;  // of a coil's neighbouring sightings
constexpr double kMinNoise_mm = 0.1;
constexpr double kMaxResidual = 4;  // standard deviations
constexpr std::size_t kMinCoils = 3;
constexpr int kRounds = 3;

/// The linear model of some sightings. Unknowns: w, v, and three numbers a coil and place.
class Model {
 public:
  explicit Model(std::span<const SeenBesideCoil> seen) {
    for (const SeenBesideCoil& one : seen) {
      centre_mm_ += one.p_world_mm / static_cast<double>(seen.size());
      columns_.try_emplace({one.coil, one.place}, 6 + 3 * static_cast<Eigen::Index>(columns_.size()));
    }
  }

  [[nodiscard]] const Eigen::Vector3d& centre_mm() const { return centre_mm_; }
  [[nodiscard]] Eigen::Index unknowns() const { return 6 + 3 * static_cast<Eigen::Index>(columns_.size()); }

  // side . (w x r) = w . (r x side)
  [[nodiscard]] Eigen::VectorXd row(const SeenBesideCoil& one) const {
    Eigen::VectorXd row = Eigen::VectorXd::Zero(unknowns());
    row.head<3>() = (one.p_world_mm - centre_mm_).cross(one.side_world);
    row.segment<3>(3) = one.side_world;
    row.segment<3>(columns_.at({one.coil, one.place})) = one.side_world;
    return row;
  }

  [[nodiscard]] Eigen::VectorXd prior(double local_mm) const {
    Eigen::VectorXd D = Eigen::VectorXd::Constant(unknowns(), local_mm);
    D.head<3>().setConstant(kAnyTurn_rad);
    D.segment<3>(3).setConstant(kAnyShift_mm);
    return D;
  }

 private:
  Eigen::Vector3d centre_mm_ = Eigen::Vector3d::Zero();
  std::map<std::pair<std::size_t, std::size_t>, Eigen::Index> columns_;
};

/// A mixture over how large what is local may be.
struct Solution {
  double local_mm = 0;   ///< mean
  Eigen::VectorXd mean;  ///< of all unknowns
  RegistrationCovariance covariance = RegistrationCovariance::Zero();
};

/// Each size of what is local, as likely as any other before, counts by its evidence.
std::optional<Solution> solve(const Model& model, std::span<const SeenBesideCoil> seen, double variance_mm2) {
  LinearEvidence evidence(model.unknowns());
  for (const SeenBesideCoil& one : seen) evidence.add(model.row(one), one.off_mm, variance_mm2);
  evidence.freeze();
  double best = -std::numeric_limits<double>::infinity();
  for (double local_mm = kMinLocal_mm; local_mm < kMaxLocal_mm; local_mm *= kStep) {
    best = std::max(best, evidence.explain(model.prior(local_mm)));
  }
  if (!std::isfinite(best)) return std::nullopt;
  Solution solution;
  solution.mean = Eigen::VectorXd::Zero(model.unknowns());
  RegistrationCovariance squares = RegistrationCovariance::Zero();
  double weights = 0;
  for (double local_mm = kMinLocal_mm; local_mm < kMaxLocal_mm; local_mm *= kStep) {
    // A step is as wide as what it stands for is large.
    const double weight = local_mm * std::exp(evidence.explain(model.prior(local_mm)) - best);
    if (!(weight > 0) || !evidence.take_as_base()) continue;
    const std::array<LinearEvidence::Widened, 1> nothing{};  // the base itself, with its covariance
    evidence.widened(nothing);
    const Eigen::VectorXd& mean = evidence.mean();
    weights += weight;
    solution.local_mm += weight * local_mm;
    solution.mean += weight * mean;
    squares += weight * (evidence.covariance_of_first() + mean.head<6>() * mean.head<6>().transpose());
  }
  if (!(weights > 0)) return std::nullopt;
  solution.local_mm /= weights;
  solution.mean /= weights;
  solution.covariance = squares / weights - solution.mean.head<6>() * solution.mean.head<6>().transpose();
  return solution;
}

/// How many sightings of a coil, one after the other, bring as much as one: (1 + r) / (1 - r) with the
/// correlation r of neighbours. Coils' noise is new with each, an image's error is not.
double alike(std::span<const SeenBesideCoil> seen, const std::vector<double>& residuals) {
  std::map<std::size_t, double> before;
  double products = 0;
  double squares = 0;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const auto [entry, is_first] = before.try_emplace(seen[i].coil, residuals[i]);
    if (!is_first) {
      products += entry->second * residuals[i];
      squares += (squared(entry->second) + squared(residuals[i])) / 2;
      entry->second = residuals[i];
    }
  }
  const double r = squares > 0 ? std::clamp(products / squares, 0.0, kMaxCorrelation) : 0;
  return (1 + r) / (1 - r);
}

/// 1.48 times the median of magnitudes: a standard deviation that outliers do not move.
double robust_sigma(std::vector<double> residuals) {
  if (residuals.empty()) return 0;
  for (double& residual : residuals) residual = std::abs(residual);
  const auto middle = residuals.begin() + static_cast<std::ptrdiff_t>(residuals.size() / 2);
  std::nth_element(residuals.begin(), middle, residuals.end());
  return 1.4826 * *middle;
}

std::vector<double> residuals_of(const Model& model, std::span<const SeenBesideCoil> seen,
                                 const Eigen::VectorXd& mean) {
  std::vector<double> residuals;
  residuals.reserve(seen.size());
  for (const SeenBesideCoil& one : seen) residuals.push_back(one.off_mm - model.row(one).dot(mean));
  return residuals;
}

double root_mean_square(std::span<const double> numbers) {
  double sum = 0;
  for (const double number : numbers) sum += squared(number);
  return numbers.empty() ? 0 : std::sqrt(sum / static_cast<double>(numbers.size()));
}

Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes_of(const RegistrationCovariance& covariance) {
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(covariance.bottomRightCorner<3, 3>());
}

void keep_agreeing(const std::vector<double>& residuals, double limit_mm, std::vector<SeenBesideCoil>& seen) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    if (std::abs(residuals[i]) < limit_mm) seen[kept++] = seen[i];
  }
  seen.resize(kept);
}

}  // namespace

double RigidCorrection::worst_shift_mm() const {
  return std::sqrt(std::max(0.0, axes_of(covariance).eigenvalues()[2]));
}

Eigen::Vector3d RigidCorrection::worst_direction() const { return axes_of(covariance).eigenvectors().col(2); }

std::optional<RigidCorrection> find_rigid_correction(std::span<const SeenBesideCoil> seen) {
  std::set<std::size_t> coils;
  for (const SeenBesideCoil& one : seen) coils.insert(one.coil);
  if (seen.size() < kMinSightings || coils.size() < kMinCoils) {
    return std::nullopt;
  }
  std::vector<SeenBesideCoil> kept(seen.begin(), seen.end());
  std::optional<Solution> solution;
  double variance_mm2 = 1;
  for (int round = 0; round < kRounds; ++round) {
    if (kept.size() < kMinSightings) return std::nullopt;
    const Model model(kept);
    solution = solve(model, kept, variance_mm2);
    if (!solution) return std::nullopt;
    if (round + 1 == kRounds) break;
    const std::vector<double> residuals = residuals_of(model, kept, solution->mean);
    const double noise_mm = std::max(kMinNoise_mm, robust_sigma(residuals));
    variance_mm2 = squared(noise_mm) * alike(kept, residuals);
    keep_agreeing(residuals, kMaxResidual * noise_mm, kept);
  }
  const Model model(kept);
  RigidCorrection found;
  found.centre_world_mm = model.centre_mm();
  found.turn_rad = solution->mean.head<3>();
  found.shift_mm = solution->mean.segment<3>(3);
  found.covariance = solution->covariance;
  found.local_mm = solution->local_mm;
  std::vector<double> before;
  std::vector<double> after;
  for (const SeenBesideCoil& one : kept) {
    before.push_back(one.off_mm);
    after.push_back(one.off_mm - model.row(one).head<6>().dot(solution->mean.head<6>()));
  }
  found.rms_before_mm = root_mean_square(before);
  found.rms_after_mm = root_mean_square(after);
  found.left_out = seen.size() - kept.size();
  return found;
}

}  // namespace tubed
