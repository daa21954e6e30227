#include "drivers/simulation/fluoroscope/rod_shadow.hpp"

#include <algorithm>
#include <cmath>

namespace tubed {

namespace {

/// The tangent at a point of a polyline: of the only edge at its ends, halfway between both elsewhere.
Eigen::Vector3d mitre_normal(const Eigen::Matrix3Xd& points, Eigen::Index at) {
  const Eigen::Index last = points.cols() - 1;
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  if (at > 0) {
    normal += (points.col(at) - points.col(at - 1)).normalized();
  }
  if (at < last) {
    normal += (points.col(at + 1) - points.col(at)).normalized();
  }
  return normal.normalized();
}

double distance_to_segment(const Eigen::Vector2d& p, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const Eigen::Vector2d edge = b - a;
  const double length_squared = edge.squaredNorm();
  const double part = length_squared > 0 ? std::clamp((p - a).dot(edge) / length_squared, 0.0, 1.0) : 0.0;
  return (p - a - part * edge).norm();
}

}  // namespace

RodShadow::RodShadow(const PixelRays& rays)
    : rays_(rays),
      T_camera_room_(rays.camera().calibration().T_camera_world),
      attenuation_(rays.size()),
      is_touched_(rays.size()) {
  for (auto& pixel : attenuation_) {
    pixel.fill(0);
  }
  touched_.reserve(rays.size());
}

TubePiece RodShadow::piece_of(const Eigen::Matrix3Xd& centreline_room_mm, Eigen::Index from) const {
  const auto& R = T_camera_room_.linear();
  TubePiece piece;
  piece.begin = T_camera_room_ * Eigen::Vector3d(centreline_room_mm.col(from));
  piece.end = T_camera_room_ * Eigen::Vector3d(centreline_room_mm.col(from + 1));
  piece.tangent = (piece.end - piece.begin).normalized();
  piece.begin_normal = R * mitre_normal(centreline_room_mm, from);
  piece.end_normal = R * mitre_normal(centreline_room_mm, from + 1);
  return piece;
}

bool RodShadow::footprint(const TubePiece& piece, double radius_mm, Footprint& area) const {
  const auto from = rays_.camera().project(T_camera_room_.inverse() * piece.begin);
  const auto to = rays_.camera().project(T_camera_room_.inverse() * piece.end);
  if (!from || !to) {
    return false;
  }
  const CameraCalibration& camera = rays_.camera().calibration();
  const double px_a_mm = std::max(camera.fx, camera.fy) / std::min(from->depth_mm, to->depth_mm);
  area.from_px = from->p_image_px;
  area.to_px = to->p_image_px;
  // A pixel's corner, the cylinder's reach beyond its mitred ends, and some room for distortion.
  area.margin_px = 1.1 * radius_mm * px_a_mm + 1.0;
  const Eigen::Vector2d low = area.from_px.cwiseMin(area.to_px).array() - area.margin_px;
  const Eigen::Vector2d high = area.from_px.cwiseMax(area.to_px).array() + area.margin_px;
  if (!low.allFinite() || !high.allFinite() || high.x() < 0 || high.y() < 0 || low.x() > rays_.width() - 1 ||
      low.y() > rays_.height() - 1) {
    return false;
  }
  area.left = std::max(0, static_cast<int>(std::ceil(low.x())));
  area.top = std::max(0, static_cast<int>(std::ceil(low.y())));
  area.right = static_cast<int>(std::min<double>(rays_.width() - 1, std::floor(high.x())));
  area.bottom = static_cast<int>(std::min<double>(rays_.height() - 1, std::floor(high.y())));
  return true;
}

void RodShadow::add_piece(const TubePiece& piece, const Shell& shell, bool fine) {
  Footprint area;
  if (shell.attenuation_per_mm == 0 || piece.tangent.isZero() || !footprint(piece, shell.radius_mm, area)) {
    return;
  }
  const auto thickness = [&](const Eigen::Vector2d& slope) {
    const Eigen::Vector3d direction = slope.homogeneous().normalized();
    const double whole = chord_mm(piece, shell.radius_mm, direction);
    const bool hollow = whole > 0 && shell.hole_radius_mm > 0;
    return whole - (hollow ? chord_mm(piece, shell.hole_radius_mm, direction) : 0.0);
  };
  for (int y = area.top; y <= area.bottom; ++y) {
    for (int x = area.left; x <= area.right; ++x) {
      if (distance_to_segment({x, y}, area.from_px, area.to_px) > area.margin_px) {
        continue;
      }
      const auto pixel =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(rays_.width()) + static_cast<std::size_t>(x);
      if (is_touched_[pixel] == 0) {
        is_touched_[pixel] = 1;
        touched_.push_back(static_cast<std::uint32_t>(pixel));
      }
      auto& attenuation = attenuation_[pixel];
      if (!fine) {
        const double whole = shell.attenuation_per_mm * thickness(rays_.slope_camera(pixel, {0, 0}));
        for (float& ray : attenuation) {
          ray += static_cast<float>(whole);
        }
        continue;
      }
      for (std::size_t ray = 0; ray < kRays; ++ray) {
        const auto row = static_cast<int>(ray) / kRaysASide;
        const auto column = static_cast<int>(ray) % kRaysASide;
        const Eigen::Vector2d offset((column + 0.5) / kRaysASide - 0.5, (row + 0.5) / kRaysASide - 0.5);
        attenuation[ray] +=
            static_cast<float>(shell.attenuation_per_mm * thickness(rays_.slope_camera(pixel, offset)));
      }
    }
  }
}

void RodShadow::add_electrode(const RadiographRod& rod, const RadiographElectrode& electrode) {
  const double from_mm = electrode.s_mm - electrode.length_mm / 2;
  const double to_mm = electrode.s_mm + electrode.length_mm / 2;
  const Shell band{electrode.radius_mm, electrode.radius_mm - electrode.wall_mm,
                   electrode.attenuation_per_mm};
  double s_mm = 0;
  for (Eigen::Index i = 0; i + 1 < rod.centreline_room_mm.cols() && s_mm < to_mm; ++i) {
    TubePiece piece = piece_of(rod.centreline_room_mm, i);
    const double length_mm = (piece.end - piece.begin).norm();
    const Eigen::Vector3d begin = piece.begin;
    if (s_mm + length_mm > from_mm && length_mm > 0) {
      if (from_mm > s_mm) {
        piece.begin = begin + (from_mm - s_mm) * piece.tangent;
        piece.begin_normal = piece.tangent;
      }
      if (to_mm < s_mm + length_mm) {
        piece.end = begin + (to_mm - s_mm) * piece.tangent;
        piece.end_normal = piece.tangent;
      }
      add_piece(piece, band, true);
    }
    s_mm += length_mm;
  }
}

void RodShadow::add(const RadiographRod& rod) {
  const Shell wall{rod.radius_mm, rod.lumen_radius_mm, rod.attenuation_per_mm};
  for (Eigen::Index i = 0; i + 1 < rod.centreline_room_mm.cols(); ++i) {
    add_piece(piece_of(rod.centreline_room_mm, i), wall, true);
  }
  for (const RadiographElectrode& electrode : rod.electrodes) {
    add_electrode(rod, electrode);
  }
}

void RodShadow::add_soft(const Eigen::Matrix3Xd& centreline_room_mm, const Eigen::VectorXd& radius_mm,
                         const Eigen::VectorXd& attenuation_per_mm) {
  for (Eigen::Index i = 0; i + 1 < centreline_room_mm.cols(); ++i) {
    const Shell solid{(radius_mm[i] + radius_mm[i + 1]) / 2, 0,
                      (attenuation_per_mm[i] + attenuation_per_mm[i + 1]) / 2};
    add_piece(piece_of(centreline_room_mm, i), solid, false);
  }
}

void RodShadow::apply(std::span<float> transmission) {
  for (const std::uint32_t pixel : touched_) {
    float passed = 0;
    for (float& ray : attenuation_[pixel]) {
      passed += std::exp(-ray);
      ray = 0;
    }
    transmission[pixel] *= passed / static_cast<float>(kRays);
    is_touched_[pixel] = 0;
  }
  touched_.clear();
}

}  // namespace tubed
