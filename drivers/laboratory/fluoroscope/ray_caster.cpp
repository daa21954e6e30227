#include "drivers/laboratory/fluoroscope/ray_caster.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tubed {

/// The samples of one ray, in voxel indices: first + n * step, n = 0 .. count - 1.
struct RayCaster::Walk {
  Eigen::Vector3f first = Eigen::Vector3f::Zero();
  Eigen::Vector3f step = Eigen::Vector3f::Zero();
  int count = 0;
  int main_axis = 0;
  float step_mm = 0;
};

RayCaster::RayCaster(const AttenuationVolume& volume)
    : volume_(volume),
      T_volume_room_(volume.T_room_volume().inverse()),
      last_((volume.size() - Eigen::Vector3i::Ones()).cast<double>()),
      last_cell_(last_.cast<float>().array() * (1 - 1e-6F)),
      stride_(1, volume.size().x(), volume.size().x() * volume.size().y()) {}

RayCaster::Walk RayCaster::walk(const Eigen::Vector3d& source_room_mm,
                                const Eigen::Vector3d& direction_room) const {
  const Eigen::Vector3d source = (T_volume_room_ * source_room_mm).cwiseQuotient(volume_.spacing_mm());
  const Eigen::Vector3d direction_mm = T_volume_room_.linear() * direction_room.normalized();
  const Eigen::Vector3d direction = direction_mm.cwiseQuotient(volume_.spacing_mm());
  Walk walk;
  direction.cwiseAbs().maxCoeff(&walk.main_axis);
  const Eigen::Vector3d step = direction / std::abs(direction[walk.main_axis]);

  // Where the ray is inside the grid, by slabs: from the first to the last plane across the main axis, a hair
  // off the border along the others so that every sample has neighbours.
  double enter = 0;
  double leave = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    const double hair = axis == walk.main_axis ? -1e-6 : 1e-3;
    const double low = hair - source[axis];
    const double high = last_[axis] - hair - source[axis];
    if (std::abs(step[axis]) < 1e-12) {
      if (low > 0 || high < 0) {
        return walk;
      }
      continue;
    }
    enter = std::max(enter, std::min(low / step[axis], high / step[axis]));
    leave = std::min(leave, std::max(low / step[axis], high / step[axis]));
  }
  if (!(enter < leave)) {
    return walk;
  }
  // The first plane of voxels behind the entry.
  const double sign = step[walk.main_axis];
  const double at_entry = source[walk.main_axis] + enter * sign;
  const double plane = sign > 0 ? std::ceil(at_entry) : std::floor(at_entry);
  const double first = (plane - source[walk.main_axis]) / sign;
  if (first > leave) {
    return walk;
  }
  walk.count = 1 + static_cast<int>(std::floor(leave - first));
  walk.first = (source + first * step).cast<float>();
  walk.step = step.cast<float>();
  walk.step_mm = static_cast<float>(1 / std::abs(direction[walk.main_axis]));
  return walk;
}

float RayCaster::line_integral(const Eigen::Vector3d& source_room_mm,
                               const Eigen::Vector3d& direction_room) const {
  const Walk ray = walk(source_room_mm, direction_room);
  if (ray.count == 0) {
    return 0;
  }
  const int u = (ray.main_axis + 1) % 3;
  const int v = (ray.main_axis + 2) % 3;
  const std::ptrdiff_t stride_u = stride_[u];
  const std::ptrdiff_t stride_v = stride_[v];
  const std::ptrdiff_t stride_main =
      ray.step[ray.main_axis] > 0 ? stride_[ray.main_axis] : -stride_[ray.main_axis];
  const std::uint16_t* plane =
      volume_.voxels() + std::lround(ray.first[ray.main_axis]) * std::ptrdiff_t{stride_[ray.main_axis]};
  float sum = 0;
  for (int n = 0; n < ray.count; ++n, plane += stride_main) {
    const float at_u = ray.first[u] + static_cast<float>(n) * ray.step[u];
    const float at_v = ray.first[v] + static_cast<float>(n) * ray.step[v];
    const int cell_u = static_cast<int>(at_u);
    const int cell_v = static_cast<int>(at_v);
    const float part_u = at_u - static_cast<float>(cell_u);
    const float part_v = at_v - static_cast<float>(cell_v);
    const std::uint16_t* voxel = plane + cell_u * stride_u + cell_v * stride_v;
    const auto v00 = static_cast<float>(voxel[0]);
    const auto v10 = static_cast<float>(voxel[stride_u]);
    const auto v01 = static_cast<float>(voxel[stride_v]);
    const auto v11 = static_cast<float>(voxel[stride_u + stride_v]);
    const float low = v00 + part_u * (v10 - v00);
    const float high = v01 + part_u * (v11 - v01);
    sum += low + part_v * (high - low);
  }
  return sum * ray.step_mm * AttenuationVolume::kUnit_per_mm;
}

float RayCaster::sample(const Eigen::Vector3f& index) const {
  const Eigen::Vector3f place = index.array().max(0.0F).min(last_cell_);
  const Eigen::Vector3i cell = place.cast<int>();
  const Eigen::Vector3f part = place - cell.cast<float>();
  const std::uint16_t* voxel = volume_.voxels() + volume_.index(cell.x(), cell.y(), cell.z());
  const auto along_x = [&](const std::uint16_t* at) {
    const auto left = static_cast<float>(at[0]);
    return left + part.x() * (static_cast<float>(at[1]) - left);
  };
  const auto in_plane = [&](const std::uint16_t* at) {
    const float low = along_x(at);
    return low + part.y() * (along_x(at + stride_.y()) - low);
  };
  const float low = in_plane(voxel);
  return low + part.z() * (in_plane(voxel + stride_.z()) - low);
}

void RayCaster::changes(const Eigen::Vector3d& source_room_mm, const Eigen::Vector3d& direction_room,
                        const BodyMotion& motion, const Posture& far, std::span<float> changes) const {
  // The displacement is smooth: it is worked out at every so many samples and interpolated. Where it vanishes
  // nothing changes.
  constexpr int kStride = 8;
  const Walk ray = walk(source_room_mm, direction_room);
  const Eigen::Vector3f spacing = volume_.spacing_mm().cast<float>();
  const Eigen::Isometry3f T_room_volume = volume_.T_room_volume().cast<float>();
  const Eigen::Matrix3f R_volume_room = T_volume_room_.linear().cast<float>();
  const auto place = [&](int n) -> Eigen::Vector3f { return ray.first + static_cast<float>(n) * ray.step; };
  const auto moved = [&](int n) -> Eigen::Vector3f {
    const Eigen::Vector3f p_room = T_room_volume * place(n).cwiseProduct(spacing);
    return (R_volume_room * motion.displacement(p_room, far)).cwiseQuotient(spacing);
  };
  std::fill(changes.begin(), changes.end(), 0.0F);
  Eigen::Vector3f next = moved(0);
  for (int block = 0; block < ray.count; block += kStride) {
    const Eigen::Vector3f here = next;
    next = moved(block + kStride);
    if (here.isZero(0) && next.isZero(0)) {
      continue;
    }
    for (int n = block; n < std::min(block + kStride, ray.count); ++n) {
      const Eigen::Vector3f shift = here + static_cast<float>(n - block) / kStride * (next - here);
      const float still = sample(place(n));
      for (std::size_t phase = 0; phase < changes.size(); ++phase) {
        const float part = static_cast<float>(phase + 1) / static_cast<float>(changes.size());
        changes[phase] += sample(place(n) - part * shift) - still;
      }
    }
  }
  for (float& change : changes) {
    change *= ray.step_mm * AttenuationVolume::kUnit_per_mm;
  }
}

}  // namespace tubed
