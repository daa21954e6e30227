#include "bench/accuracy/ct_scan.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "clients/evaluation/shape_error.hpp"
#include "drivers/laboratory/random/counter_random.hpp"
#include "drivers/laboratory/tracker/gaussian.hpp"

namespace tubed {

namespace {

constexpr std::int64_t kGridStream = 7501;
constexpr std::int64_t kNoiseStream = 7502;
constexpr int kBias = 1 << 15;  // makes the numbers of cubes positive, 16 bits each
constexpr double kTableStep_mm = 0.01;

int floor_div(int value, int by) { return value >= 0 ? value / by : -((-value + by - 1) / by); }

/// Values of blurred_disc() up to where nothing of the tube is left.
class RadialTable {
 public:
  RadialTable(double radius_mm, double blur_mm) : reach_mm_(radius_mm + 4 * blur_mm) {
    for (double d = 0; d <= reach_mm_ + 2 * kTableStep_mm; d += kTableStep_mm) {
      values_.push_back(blurred_disc(d, radius_mm, blur_mm));
    }
  }
  [[nodiscard]] double reach_mm() const { return reach_mm_; }
  [[nodiscard]] double at(double d_mm) const {
    if (d_mm >= reach_mm_) return 0;
    const double place = d_mm / kTableStep_mm;
    const auto left = static_cast<std::size_t>(place);
    return std::lerp(values_[left], values_[left + 1], place - static_cast<double>(left));
  }

 private:
  double reach_mm_;
  std::vector<double> values_;
};

double distance_to(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const Eigen::Vector3d edge = b - a;
  const double share = std::clamp((p - a).dot(edge) / edge.squaredNorm(), 0.0, 1.0);
  return (p - a - share * edge).norm();
}

/// The polyline that balls of the tube's radius run along: its round end reaches the catheter's tip.
Eigen::Matrix3Xd axis_of(const Eigen::Matrix3Xd& centreline_mm, double radius_mm) {
  SampledCentreline curve;
  double s_mm = 0;
  for (Eigen::Index i = 0; i < centreline_mm.cols(); ++i) {
    if (i > 0) s_mm += (centreline_mm.col(i) - centreline_mm.col(i - 1)).norm();
    curve.s_mm.push_back(s_mm);
  }
  curve.p_world_mm = centreline_mm;
  const auto first = std::upper_bound(curve.s_mm.begin(), curve.s_mm.end(), radius_mm) - curve.s_mm.begin();
  Eigen::Matrix3Xd axis_mm(3, centreline_mm.cols() - first + 1);
  axis_mm.col(0) = point_at(curve, radius_mm);
  axis_mm.rightCols(centreline_mm.cols() - first) = centreline_mm.rightCols(centreline_mm.cols() - first);
  return axis_mm;
}

/// Puts into each voxel near the segment the share of it that is tube, the greatest of all segments' so far.
void draw_segment(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const RadialTable& table,
                  CtScan& scan) {
  const Eigen::Array3d reach = Eigen::Array3d::Constant(table.reach_mm());
  const VoxelIndex low = scan.nearest(a.cwiseMin(b).array() - reach);
  const VoxelIndex high = scan.nearest(a.cwiseMax(b).array() + reach);
  for (int k = low[2]; k <= high[2]; ++k) {
    for (int j = low[1]; j <= high[1]; ++j) {
      for (int i = low[0]; i <= high[0]; ++i) {
        float& value = scan.place({i, j, k});
        value = std::max(value, static_cast<float>(table.at(distance_to(scan.centre_mm({i, j, k}), a, b))));
      }
    }
  }
}

}  // namespace

std::int64_t CtScan::cube_of(const VoxelIndex& voxel) {
  std::int64_t number = 0;
  for (const int i : voxel) number = (number << 16) | static_cast<std::int64_t>(floor_div(i, kCube) + kBias);
  return number;
}

std::size_t CtScan::place_in_cube(const VoxelIndex& voxel) {
  std::size_t place = 0;
  for (const int i : voxel) place = place * kCube + static_cast<std::size_t>(i - kCube * floor_div(i, kCube));
  return place;
}

float CtScan::at(const VoxelIndex& voxel) const {
  const auto cube = cubes_.find(cube_of(voxel));
  return cube == cubes_.end() ? background_ : cube->second[place_in_cube(voxel)];
}

double CtScan::at(const Eigen::Vector3d& p_mm) const {
  const Eigen::Vector3d place = (p_mm - origin_mm_) / voxel_mm_;
  const Eigen::Vector3i low = place.array().floor().cast<int>();
  const Eigen::Vector3d share = place - low.cast<double>();
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3i step(corner & 1, (corner >> 1) & 1, corner >> 2);
    double weight = 1;
    for (Eigen::Index axis = 0; axis < 3; ++axis) weight *= step[axis] == 1 ? share[axis] : 1 - share[axis];
    sum += weight * at(VoxelIndex{low.x() + step.x(), low.y() + step.y(), low.z() + step.z()});
  }
  return sum;
}

Eigen::Vector3d CtScan::centre_mm(const VoxelIndex& voxel) const {
  return origin_mm_ + voxel_mm_ * Eigen::Vector3d(voxel[0], voxel[1], voxel[2]);
}

VoxelIndex CtScan::nearest(const Eigen::Vector3d& p_mm) const {
  const Eigen::Vector3i i = ((p_mm - origin_mm_) / voxel_mm_).array().round().cast<int>();
  return {i.x(), i.y(), i.z()};
}

void CtScan::each(const std::function<void(const VoxelIndex&, float)>& visit) const {
  for (const std::int64_t number : order_) {
    VoxelIndex first{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      first[axis] = kCube * (static_cast<int>((number >> (16 * (2 - axis))) & 0xFFFF) - kBias);
    }
    const Cube& cube = cubes_.at(number);
    for (std::size_t place = 0; place < cube.size(); ++place) {
      const auto at = static_cast<int>(place);
      visit({first[0] + at / (kCube * kCube), first[1] + at / kCube % kCube, first[2] + at % kCube},
            cube[place]);
    }
  }
}

float& CtScan::place(const VoxelIndex& voxel) {
  const std::int64_t number = cube_of(voxel);
  const auto [cube, is_new] = cubes_.try_emplace(number);
  if (is_new) {
    cube->second.fill(background_);
    order_.push_back(number);
  }
  return cube->second[place_in_cube(voxel)];
}

double blurred_disc(double distance_mm, double radius_mm, double blur_mm) {
  const double variance = blur_mm * blur_mm;
  constexpr double kStepsPerBlur = 20;
  const int steps = std::max(200, static_cast<int>(std::ceil(kStepsPerBlur * radius_mm / blur_mm)));
  const double step = radius_mm / steps;
  double sum = 0;
  for (int i = 0; i < steps; ++i) {  // midpoint rule
    const double rho = (i + 0.5) * step;
    // exp(-(rho - d)^2 / 2 sigma^2) times I0(x) exp(-x), which stays small where I0 alone overflows.
    const double x = rho * distance_mm / variance;
    const double scaled_i0 = x < 500 ? std::cyl_bessel_i(0.0, x) * std::exp(-x) : 1 / std::sqrt(2 * M_PI * x);
    sum += rho * std::exp(-(rho - distance_mm) * (rho - distance_mm) / (2 * variance)) * scaled_i0;
  }
  return sum * step / variance;
}

CtScan simulated_ct(const Eigen::Matrix3Xd& centreline_mm, const CtSettings& settings, std::int64_t seed) {
  CounterRandom grid(seed, kGridStream, 0);
  const Eigen::Vector3d share(grid.unit(), grid.unit(), grid.unit());
  // Shares of tube first: their background is 0.
  CtScan shares(settings.voxel_mm, 0, settings.voxel_mm * share);
  const double radius_mm = settings.diameter_mm / 2;
  const RadialTable table(radius_mm, std::hypot(settings.blur_mm, settings.voxel_mm / std::sqrt(12.0)));
  const Eigen::Matrix3Xd axis_mm = axis_of(centreline_mm, radius_mm);
  for (Eigen::Index i = 1; i < axis_mm.cols(); ++i) {
    draw_segment(axis_mm.col(i - 1), axis_mm.col(i), table, shares);
  }
  CtScan scan(settings.voxel_mm, settings.background, settings.voxel_mm * share);
  std::int64_t count = 0;
  shares.each([&](const VoxelIndex& voxel, float tube) {
    CounterRandom random(seed, kNoiseStream, count++);
    const double value = settings.background + tube * (settings.shaft - settings.background);
    scan.place(voxel) =
        static_cast<float>(std::min(settings.greatest, value + settings.noise * gaussian(random)));
  });
  return scan;
}

}  // namespace tubed
