// A CT of a catheter, as far as its own voxels and those beside it go: what a truth is segmented from.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <unordered_map>
#include <vector>

namespace tubed {

/// Scanner and what it scans. Values are Hounsfield units.
struct CtSettings {
  double voxel_mm = 0.5;
  double blur_mm = 0.35;   ///< standard deviation of the scanner's point spread: 0.8 mm at half height
  double noise = 40;       ///< standard deviation of a voxel, independent
  double background = 0;   ///< water around the catheter
  double shaft = 3500;     ///< steel braid in the wall, all through; beyond what 12 bits hold
  double greatest = 3071;  ///< of 12 bits: what is above is cut
  double diameter_mm = 2.33;
};

/// Voxel (i, j, k), its centre at origin_mm + voxel_mm * (i, j, k).
using VoxelIndex = std::array<int, 3>;

/// Voxels of a regular grid, kept in cubes where the catheter is and around it; everywhere else is background
/// without noise, far below any threshold. Immutable after simulated_ct(); what is const may be called from
/// any thread.
class CtScan {
 public:
  static constexpr int kCube = 16;  ///< voxels along a cube's edge
  using Cube = std::array<float, kCube * kCube * kCube>;

  CtScan(double voxel_mm, double background, const Eigen::Vector3d& origin_mm)
      : voxel_mm_(voxel_mm), background_(static_cast<float>(background)), origin_mm_(origin_mm) {}

  [[nodiscard]] double voxel_mm() const { return voxel_mm_; }
  [[nodiscard]] float at(const VoxelIndex& voxel) const;
  /// Linear between the eight voxels around.
  [[nodiscard]] double at(const Eigen::Vector3d& p_mm) const;
  [[nodiscard]] Eigen::Vector3d centre_mm(const VoxelIndex& voxel) const;
  /// The voxel whose centre is nearest.
  [[nodiscard]] VoxelIndex nearest(const Eigen::Vector3d& p_mm) const;
  /// Every voxel that is kept, cubes in order.
  void each(const std::function<void(const VoxelIndex&, float)>& visit) const;

  /// The place of a voxel's value; its cube is made where it is not there yet.
  float& place(const VoxelIndex& voxel);

 private:
  [[nodiscard]] static std::int64_t cube_of(const VoxelIndex& voxel);
  [[nodiscard]] static std::size_t place_in_cube(const VoxelIndex& voxel);

  double voxel_mm_;
  float background_;
  Eigen::Vector3d origin_mm_;
  std::unordered_map<std::int64_t, Cube> cubes_;
  std::vector<std::int64_t> order_;  ///< as the cubes were made
};

/// How much of what is around a point `distance_mm` off the axis of a long straight tube a point spread of
/// `blur_mm` (standard deviation) finds inside it: a disc convolved with a normal distribution,
///   1 / sigma^2 int_0^r rho exp(-(rho^2 + d^2) / (2 sigma^2)) I0(rho d / sigma^2) drho.
double blurred_disc(double distance_mm, double radius_mm, double blur_mm);

/// The scan of a tube along `centreline_mm` (3 x n, tip first, about a millimetre apart) with a round end at
/// its first point, grid and noise drawn by `seed`. A voxel holds the mean over its volume (partial volume):
/// the box's own variance, voxel^2 / 12, adds to that of the point spread. The tube is taken for straight
/// within a few of its radii.
CtScan simulated_ct(const Eigen::Matrix3Xd& centreline_mm, const CtSettings& settings, std::int64_t seed);

}  // namespace tubed
