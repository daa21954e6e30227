#include "drivers/laboratory/fluoroscope/rod_shadow.hpp"

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

}  // namespace

RodShadow::RodShadow(const PixelRays& rays)
    : rays_(rays),
      T_camera_room_(rays.camera().calibration().T_camera_world),
      attenuation_(rays.size()),
      soft_(rays.size()),
      touch_(rays.size(), Touch::kNone) {
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
  const Eigen::Vector2d axis = to->p_image_px - from->p_image_px;
  area.from_px = from->p_image_px;
  area.length_px = axis.norm();
  area.axis = area.length_px > 1e-6 ? Eigen::Vector2d(axis / area.length_px) : Eigen::Vector2d::UnitX();
  // A pixel's corner and some room for distortion; along the axis the ends reach out as far as they are seen
  // obliquely or mitred.
  const double radius_px = 1.1 * radius_mm * px_a_mm;
  const double mitre =
      std::max((piece.begin_normal - piece.tangent).norm(), (piece.end_normal - piece.tangent).norm());
  const double oblique = std::abs(piece.tangent.dot(piece.begin.normalized()));
  area.across_px = radius_px + 1;
  area.beyond_px =
      area.length_px > 1e-6 ? radius_px * std::min(oblique + 1.2 * mitre, 1.0) + 1 : radius_px + 1;
  const double margin_px = std::max(area.across_px, area.beyond_px);
  const Eigen::Vector2d low = from->p_image_px.cwiseMin(to->p_image_px).array() - margin_px;
  const Eigen::Vector2d high = from->p_image_px.cwiseMax(to->p_image_px).array() + margin_px;
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
      const Eigen::Vector2d off = Eigen::Vector2d(x, y) - area.from_px;
      const double along_px = off.dot(area.axis);
      const double across_px = std::abs(off.x() * area.axis.y() - off.y() * area.axis.x());
      if (across_px > area.across_px || along_px < -area.beyond_px ||
          along_px > area.length_px + area.beyond_px) {
        continue;
      }
      const auto pixel =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(rays_.width()) + static_cast<std::size_t>(x);
      if (touch_[pixel] == Touch::kNone) {
        touched_.push_back(static_cast<std::uint32_t>(pixel));
      }
      if (!fine) {
        touch_[pixel] = std::max(touch_[pixel], Touch::kSoft);
        soft_[pixel] +=
            static_cast<float>(shell.attenuation_per_mm * thickness(rays_.slope_camera(pixel, {0, 0})));
        continue;
      }
      touch_[pixel] = Touch::kFine;
      auto& attenuation = attenuation_[pixel];
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
    if (touch_[pixel] == Touch::kFine) {
      float passed = 0;
      for (float& ray : attenuation_[pixel]) {
        passed += std::exp(-ray);
        ray = 0;
      }
      transmission[pixel] *= passed / static_cast<float>(kRays);
    }
    transmission[pixel] *= std::exp(-soft_[pixel]);
    soft_[pixel] = 0;
    touch_[pixel] = Touch::kNone;
  }
  touched_.clear();
}

}  // namespace tubed
