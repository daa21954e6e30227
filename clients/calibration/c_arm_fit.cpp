#include "clients/calibration/c_arm_fit.hpp"

#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "idl/geometry/degree.hpp"

namespace tubed {

namespace {

Eigen::Vector3d rotation_vector(const Eigen::Matrix3d& R) {
  const Eigen::AngleAxisd turn(R);
  return turn.angle() * turn.axis();
}

/// Frame c_arm's rotation alone.
Eigen::Matrix3d R_camera_c_arm(const GantryAngles& angles) {
  CArm arm;
  arm.primary_angle_deg = angles.primary_deg;
  arm.secondary_angle_deg = angles.secondary_deg;
  return pose_of(arm).linear();
}

/// The rotation nearest to the mean of several.
Eigen::Matrix3d mean_rotation(const std::vector<Eigen::Matrix3d>& rotations) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const Eigen::Matrix3d& R : rotations) sum += R;
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d R = svd.matrixU() * svd.matrixV().transpose();
  if (R.determinant() < 0) {
    Eigen::Matrix3d U = svd.matrixU();
    U.col(2) *= -1;
    R = U * svd.matrixV().transpose();
  }
  return R;
}

/// Given R_c_arm_world: translation of T_camera_world = R_camera_c_arm t + (0, 0, isocentre), linear in both.
struct Place {
  Eigen::Vector3d t_c_arm_world_mm;
  double isocentre_mm;
  double isocentre_sigma_mm;
};

std::optional<Place> place_of(const CameraFit& fit, const std::vector<GantryAngles>& angles,
                              const std::optional<double>& isocentre_mm) {
  const auto rows = static_cast<Eigen::Index>(3 * angles.size());
  Eigen::MatrixXd A(rows, 4);
  Eigen::VectorXd b(rows);
  for (std::size_t i = 0; i < angles.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(3 * i);
    A.block<3, 3>(row, 0) = R_camera_c_arm(angles[i]);
    A.block<3, 1>(row, 3) = Eigen::Vector3d::UnitZ();
    b.segment<3>(row) = fit.views[i].T_camera_world.translation();
  }
  if (isocentre_mm) {
    const Eigen::VectorXd rest = b - A.col(3) * *isocentre_mm;
    const Eigen::Vector3d t = A.leftCols<3>().colPivHouseholderQr().solve(rest);
    return Place{t, *isocentre_mm, 0};
  }
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(A, Eigen::ComputeThinU | Eigen::ComputeThinV);
  if (svd.singularValues()[3] < 0.1 * svd.singularValues()[0]) return std::nullopt;
  const Eigen::Vector4d x = svd.solve(b);
  const double left = (A * x - b).squaredNorm() / std::max<double>(1, static_cast<double>(rows) - 4);
  const double sigma = std::sqrt(left * (A.transpose() * A).inverse()(3, 3));
  return Place{x.head<3>(), x[3], sigma};
}

bool are_apart(const std::vector<GantryAngles>& angles) {
  constexpr double kMinApart_deg = 10;
  for (const GantryAngles& a : angles) {
    const Eigen::Matrix3d turn = R_camera_c_arm(angles.front()).transpose() * R_camera_c_arm(a);
    if (Eigen::AngleAxisd(turn).angle() > kMinApart_deg * kDegree) return true;
  }
  return false;
}

ExplainedView explained(const CArm& c_arm, const GantryAngles& angles, const FittedView& view) {
  CArm arm = c_arm;
  arm.primary_angle_deg = angles.primary_deg;
  arm.secondary_angle_deg = angles.secondary_deg;
  const RigidTransform off = view.T_camera_world * pose_of(arm).inverse();
  const Eigen::Vector3d isocentre(0, 0, c_arm.source_isocentre_mm);
  return {angles, rotation_vector(off.linear()) / kDegree, off * isocentre - isocentre};
}

}  // namespace

std::optional<CArmFit> fit_c_arm(const CameraFit& fit, const std::vector<GantryAngles>& angles,
                                 const CArmPrior& prior) {
  if (angles.size() != fit.views.size() || angles.empty()) return std::nullopt;
  if (!prior.source_isocentre_mm && (angles.size() < 2 || !are_apart(angles))) return std::nullopt;
  std::vector<Eigen::Matrix3d> turns;
  for (std::size_t i = 0; i < angles.size(); ++i) {
    turns.emplace_back(R_camera_c_arm(angles[i]).transpose() * fit.views[i].T_camera_world.linear());
  }
  const auto place = place_of(fit, angles, prior.source_isocentre_mm);
  if (!place) return std::nullopt;
  CArmFit result;
  result.c_arm.pixel_pitch_mm = prior.pixel_pitch_mm;
  result.c_arm.source_detector_mm = fit.intrinsics.fx * prior.pixel_pitch_mm;
  result.c_arm.source_isocentre_mm = place->isocentre_mm;
  result.c_arm.primary_angle_deg = angles.front().primary_deg;
  result.c_arm.secondary_angle_deg = angles.front().secondary_deg;
  result.c_arm.T_c_arm_world.linear() = mean_rotation(turns);
  result.c_arm.T_c_arm_world.translation() = place->t_c_arm_world_mm;
  result.isocentre_sigma_mm = place->isocentre_sigma_mm;
  result.is_isocentre_known = !prior.source_isocentre_mm;
  double turn2 = 0;
  double shift2 = 0;
  for (std::size_t i = 0; i < angles.size(); ++i) {
    result.views.push_back(explained(result.c_arm, angles[i], fit.views[i]));
    turn2 += result.views.back().turn_deg.squaredNorm();
    shift2 += result.views.back().shift_mm.squaredNorm();
  }
  result.rms_turn_deg = std::sqrt(turn2 / static_cast<double>(angles.size()));
  result.rms_shift_mm = std::sqrt(shift2 / static_cast<double>(angles.size()));
  return result;
}

const std::vector<AngleReading>& other_readings() {
  static const std::vector<AngleReading> readings{
      {"the primary angle with the other sign (LAO and RAO exchanged)",
       [](const GantryAngles& a) {
         return GantryAngles{-a.primary_deg, a.secondary_deg};
       }},
      {"the secondary angle with the other sign (cranial and caudal exchanged)",
       [](const GantryAngles& a) {
         return GantryAngles{a.primary_deg, -a.secondary_deg};
       }},
      {"both angles with the other sign",
       [](const GantryAngles& a) {
         return GantryAngles{-a.primary_deg, -a.secondary_deg};
       }},
      {"primary and secondary exchanged",
       [](const GantryAngles& a) {
         return GantryAngles{a.secondary_deg, a.primary_deg};
       }},
      {"radians taken for degrees", [](const GantryAngles& a) {
         return GantryAngles{a.primary_deg / kDegree, a.secondary_deg / kDegree};
       }}};
  return readings;
}

}  // namespace tubed
