#include "bench/accuracy/ct_segmentation.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <queue>
#include <stdexcept>
#include <utility>
#include <vector>

namespace tubed {

namespace {

constexpr std::size_t kMinPoints = 8;

/// Voxels above a threshold that hang together, with their places.
using Component = std::vector<VoxelIndex>;

double half_height(const CtScan& scan) {
  std::vector<float> values;
  scan.each([&](const VoxelIndex&, float value) { values.push_back(value); });
  if (values.empty()) throw std::runtime_error("CT: no voxel at all");
  const auto at = [&](double share) {
    const auto place =
        values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), place, values.end());
    return static_cast<double>(*place);
  };
  const double background = at(0.5);
  return (background + at(0.998)) / 2;
}

template <typename Visit>
void each_neighbour(const VoxelIndex& voxel, const Visit& visit) {
  for (int n = 0; n < 27; ++n) {
    const std::array<int, 3> step{n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1};
    if (n != 13) visit(VoxelIndex{voxel[0] + step[0], voxel[1] + step[1], voxel[2] + step[2]}, step);
  }
}

Component largest_component(const CtScan& scan, double threshold) {
  std::map<VoxelIndex, bool> above;  // whether it was reached
  scan.each([&](const VoxelIndex& voxel, float value) {
    if (value >= threshold) above.emplace(voxel, false);
  });
  Component largest;
  for (auto& [seed, reached] : above) {
    if (reached) continue;
    reached = true;
    Component component{seed};
    for (std::size_t i = 0; i < component.size(); ++i) {
      const VoxelIndex voxel = component[i];
      each_neighbour(voxel, [&](const VoxelIndex& next, const auto&) {
        const auto found = above.find(next);
        if (found == above.end() || found->second) return;
        found->second = true;
        component.push_back(next);
      });
    }
    if (component.size() > largest.size()) largest = std::move(component);
  }
  return largest;
}

/// Way through the component from one of its voxels to each, mm: Dijkstra over faces, edges and corners.
std::map<VoxelIndex, double> geodesic_mm(const Component& component, const VoxelIndex& from,
                                         double voxel_mm) {
  std::map<VoxelIndex, double> way_mm;
  for (const VoxelIndex& voxel : component) way_mm.emplace(voxel, std::numeric_limits<double>::infinity());
  using Entry = std::pair<double, VoxelIndex>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> next;
  way_mm.at(from) = 0;
  next.emplace(0, from);
  while (!next.empty()) {
    const auto [here_mm, voxel] = next.top();
    next.pop();
    if (here_mm > way_mm.at(voxel)) continue;
    each_neighbour(voxel, [&, here = here_mm](const VoxelIndex& other, const std::array<int, 3>& step) {
      const auto found = way_mm.find(other);
      if (found == way_mm.end()) return;
      const double there_mm = here + voxel_mm * std::hypot(step[0], step[1], step[2]);
      if (there_mm >= found->second) return;
      found->second = there_mm;
      next.emplace(there_mm, other);
    });
  }
  return way_mm;
}

VoxelIndex farthest(const std::map<VoxelIndex, double>& way_mm) {
  return std::max_element(way_mm.begin(), way_mm.end(),
                          [](const auto& a, const auto& b) { return a.second < b.second; })
      ->first;
}

/// Sum of weights and of weighted places.
struct Moments {
  double weight = 0;
  Eigen::Vector3d sum_mm = Eigen::Vector3d::Zero();
  void add(double w, const Eigen::Vector3d& p_mm) {
    weight += w;
    sum_mm += w * p_mm;
  }
  [[nodiscard]] Eigen::Vector3d mean_mm() const { return sum_mm / weight; }
};

std::vector<Eigen::Vector3d> ordered_moments(const CtScan& scan, const Component& component, double threshold,
                                             const Eigen::Vector3d& near_tip_mm, double layer_mm) {
  const double voxel_mm = scan.voxel_mm();
  const VoxelIndex one_end = farthest(geodesic_mm(component, component.front(), voxel_mm));
  const VoxelIndex other_end = farthest(geodesic_mm(component, one_end, voxel_mm));
  const bool one_is_tip =
      (scan.centre_mm(one_end) - near_tip_mm).norm() < (scan.centre_mm(other_end) - near_tip_mm).norm();
  std::map<int, Moments> layers;
  for (const auto& [voxel, way_mm] : geodesic_mm(component, one_is_tip ? one_end : other_end, voxel_mm)) {
    layers[static_cast<int>(way_mm / layer_mm)].add(scan.at(voxel) - threshold + 1, scan.centre_mm(voxel));
  }
  std::vector<Eigen::Vector3d> points_mm;
  for (const auto& [layer, moments] : layers) points_mm.push_back(moments.mean_mm());
  return points_mm;
}

Eigen::Vector3d tangent_at(const std::vector<Eigen::Vector3d>& points_mm, std::size_t i) {
  const std::size_t before = i == 0 ? 0 : i - 1;
  const std::size_t after = std::min(i + 1, points_mm.size() - 1);
  return (points_mm[after] - points_mm[before]).normalized();
}

/// The point moved to the middle of what is above the threshold in the slab across it.
Eigen::Vector3d centred(const CtScan& scan, double threshold, const Eigen::Vector3d& p_mm,
                        const Eigen::Vector3d& tangent, const SegmentationSettings& settings) {
  const Eigen::Array3d reach = Eigen::Array3d::Constant(std::hypot(settings.slab_mm, settings.across_mm));
  const VoxelIndex low = scan.nearest(p_mm.array() - reach);
  const VoxelIndex high = scan.nearest(p_mm.array() + reach);
  Moments moments;
  for (int i = low[0]; i <= high[0]; ++i) {
    for (int j = low[1]; j <= high[1]; ++j) {
      for (int k = low[2]; k <= high[2]; ++k) {
        const float value = scan.at(VoxelIndex{i, j, k});
        if (value < threshold) continue;
        const Eigen::Vector3d off_mm = scan.centre_mm({i, j, k}) - p_mm;
        const double along_mm = off_mm.dot(tangent);
        const Eigen::Vector3d across_mm = off_mm - along_mm * tangent;
        if (std::abs(along_mm) > settings.slab_mm || across_mm.norm() > settings.across_mm) continue;
        moments.add(value - threshold + 1, across_mm);
      }
    }
  }
  return moments.weight > 0 ? Eigen::Vector3d(p_mm + moments.mean_mm()) : p_mm;
}

std::vector<Eigen::Vector3d> centred_all(const CtScan& scan, double threshold,
                                         const std::vector<Eigen::Vector3d>& points_mm,
                                         const SegmentationSettings& settings) {
  std::vector<Eigen::Vector3d> moved_mm;
  for (std::size_t i = 0; i < points_mm.size(); ++i) {
    moved_mm.push_back(centred(scan, threshold, points_mm[i], tangent_at(points_mm, i), settings));
  }
  return moved_mm;
}

/// From the first point outward to where the catheter ends.
Eigen::Vector3d found_tip(const CtScan& scan, double threshold,
                          const std::vector<Eigen::Vector3d>& points_mm) {
  constexpr double kStep_mm = 0.02;
  constexpr double kMax_mm = 10;
  const Eigen::Vector3d outward = (points_mm[0] - points_mm[2]).normalized();
  double way_mm = 0;
  while (way_mm < kMax_mm && scan.at(Eigen::Vector3d(points_mm[0] + way_mm * outward)) >= threshold) {
    way_mm += kStep_mm;
  }
  return points_mm[0] + way_mm * outward;
}

/// The four cubic B-splines that are not zero at u (in knot spacings), for the coefficients floor(u) .. + 3.
Eigen::RowVector4d basis_at(double u, Eigen::Index pieces, Eigen::Index& first) {
  first = std::clamp<Eigen::Index>(static_cast<Eigen::Index>(std::floor(u)), 0, pieces - 1);
  const double t = u - static_cast<double>(first);
  const double r = 1 - t;
  return Eigen::RowVector4d(r * r * r, 3 * t * t * t - 6 * t * t + 4, 3 * r * r * r - 6 * r * r + 4,
                            t * t * t) /
         6;
}

/// A spline of least squares through points at given arc lengths; as points `step_mm` of that apart.
Eigen::Matrix3Xd smoothed(const std::vector<Eigen::Vector3d>& points_mm, double knot_spacing_mm,
                          double step_mm) {
  std::vector<double> s_mm{0};
  for (std::size_t i = 1; i < points_mm.size(); ++i) {
    s_mm.push_back(s_mm.back() + (points_mm[i] - points_mm[i - 1]).norm());
  }
  const auto pieces = std::max<Eigen::Index>(1, std::lround(s_mm.back() / knot_spacing_mm));
  const double spacing_mm = s_mm.back() / static_cast<double>(pieces);
  const auto count = static_cast<Eigen::Index>(points_mm.size());
  Eigen::MatrixXd basis = Eigen::MatrixXd::Zero(count, pieces + 3);
  Eigen::MatrixX3d wanted(count, 3);
  Eigen::Index first = 0;
  for (Eigen::Index i = 0; i < count; ++i) {
    const auto point = static_cast<std::size_t>(i);
    const Eigen::RowVector4d row = basis_at(s_mm[point] / spacing_mm, pieces, first);
    basis.block<1, 4>(i, first) = row;
    wanted.row(i) = points_mm[point].transpose();
  }
  const Eigen::MatrixX3d coefficients = basis.completeOrthogonalDecomposition().solve(wanted);
  const auto samples = static_cast<Eigen::Index>(std::floor(s_mm.back() / step_mm)) + 1;
  Eigen::Matrix3Xd curve_mm(3, samples);
  for (Eigen::Index i = 0; i < samples; ++i) {
    const Eigen::RowVector4d row = basis_at(static_cast<double>(i) * step_mm / spacing_mm, pieces, first);
    curve_mm.col(i) = (row * coefficients.middleRows<4>(first)).transpose();
  }
  return curve_mm;
}

/// Points of a fine polyline a millimetre of its length apart.
SampledCentreline every_millimetre(const Eigen::Matrix3Xd& fine_mm) {
  SampledCentreline fine;
  fine.p_world_mm = fine_mm;
  fine.s_mm.push_back(0);
  for (Eigen::Index i = 1; i < fine_mm.cols(); ++i) {
    fine.s_mm.push_back(fine.s_mm.back() + (fine_mm.col(i) - fine_mm.col(i - 1)).norm());
  }
  SampledCentreline curve;
  const auto count = static_cast<Eigen::Index>(std::floor(fine.s_mm.back())) + 1;
  curve.p_world_mm.resize(3, count);
  for (Eigen::Index s = 0; s < count; ++s) {
    curve.s_mm.push_back(static_cast<double>(s));
    curve.p_world_mm.col(s) = point_at(fine, static_cast<double>(s));
  }
  return curve;
}

}  // namespace

SampledCentreline segment_catheter(const CtScan& scan, const Eigen::Vector3d& near_tip_mm,
                                   const SegmentationSettings& settings) {
  const double threshold = half_height(scan);
  const Component component = largest_component(scan, threshold);
  if (component.empty()) throw std::runtime_error("CT: no voxel stands out");
  std::vector<Eigen::Vector3d> points_mm =
      ordered_moments(scan, component, threshold, near_tip_mm, settings.layer_mm);
  if (points_mm.size() < kMinPoints) throw std::runtime_error("CT: what stands out is too short for a curve");
  for (int round = 0; round < settings.rounds; ++round) {
    points_mm = centred_all(scan, threshold, points_mm, settings);
  }
  points_mm.insert(points_mm.begin(), found_tip(scan, threshold, points_mm));
  constexpr double kFine_mm = 0.1;
  return every_millimetre(smoothed(points_mm, settings.knot_spacing_mm, kFine_mm));
}

}  // namespace tubed
