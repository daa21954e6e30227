// An arc that images confirm and coils that are measured beside it: a bench for CoilImageAgreement.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <chrono>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "daemon/estimator/agreement/agreement_words.hpp"
#include "daemon/estimator/agreement/coil_image_agreement.hpp"
#include "tests/daemon/estimator/simulated_tube.hpp"

namespace tubed {

inline constexpr double kNoise_mm = 0.5;
inline constexpr double kMiddle_mm = 190;  // of the tube

/// From behind the second view of the tests of two.
inline RoomDescription two_views() {
  RoomDescription room = one_view_room();
  CameraCalibration side = room.cameras.front();
  side.name = "B";
  side.T_camera_world.linear() = Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitY()).matrix();
  room.cameras.push_back(side);
  return room;
}

/// The same room, whose cameras' poses are known well.
inline RoomDescription well_posed(RoomDescription room) {
  for (CameraCalibration& camera : room.cameras) {
    camera.pose_sigma_mm = {0.2, 0.2, 0.2};
    camera.pose_sigma_deg = {0.1, 0.1, 0.1};
  }
  return room;
}

/// Where a coil is measured instead of where it is.
using Mistake = std::function<Eigen::Vector3d(const Eigen::Vector3d& p_mm, int coil, double t_s)>;

inline Eigen::Vector3d as_it_is(const Eigen::Vector3d& p_mm, int /*coil*/, double /*t_s*/) { return p_mm; }

inline Mistake registered_wrong(const Eigen::Vector3d& shift_mm, double turn_rad) {
  return [=](const Eigen::Vector3d& p_mm, int, double) -> Eigen::Vector3d {
    return shift_mm + Eigen::AngleAxisd(turn_rad, Eigen::Vector3d::UnitZ()) * p_mm;
  };
}

/// The arc, which images confirm, and coils that are measured on it, by mistake somewhere else.
class AgreementBench {
 public:
  explicit AgreementBench(RoomDescription room = one_view_room(), unsigned seed = 1)
      : room_(std::move(room)),
        map_(EstimatorSettings{}, 380),
        random_(seed),
        agreement_(room_errors(room_, room_.instruments.front()), room_.instruments.front(),
                   static_cast<int>(room_.cameras.size())) {
    for (const CameraCalibration& camera : room_.cameras) {
      cameras_.emplace_back(camera);
    }
    C_ = Eigen::Matrix3Xd::Zero(3, map_.columns().count());
    const CoilObservations coils = observed(as_it_is, 0);
    bool converged = false;
    map_.solve_linear(coils, C_);
    map_.refine(coils, {}, nullptr, 20, C_, converged);
  }

  /// How far the tube as a whole is from where it was at the beginning, at a time.
  std::function<Eigen::Vector3d(double t_s)> motion_mm = [](double) { return Eigen::Vector3d::Zero(); };
  double noise_mm = kNoise_mm;
  double lasting_mm = 0.5;  ///< what else the tracker may be wrong by
  double image_scale = 1;   ///< of the first image, about its middle; the shape keeps its length
  double end_mm = 0;        ///< by which the tube ends further out in the image
  bool shows_end = true;
  int rate_hz = 10;                    ///< of images
  double dark_from_mm = 1e9;           ///< from here on the image is too dark to show the tube
  CoilState third = CoilState::kUsed;  ///< of the third coil

  const CoilImageAgreement& watch(double seconds, const Mistake& mistake) {
    for (int i = 0; i < static_cast<int>(std::lround(seconds * rate_hz)); ++i) {
      now_ += std::chrono::milliseconds(1000) / rate_hz;
      const double t_s = static_cast<double>(to_ns(now_)) * 1e-9;
      Eigen::Matrix3Xd C = image_scale == 1 ? C_ : scaled();
      C.leftCols(map_.spline().coefficient_count()).colwise() += motion_mm(t_s);
      agreement_.observe(observed(mistake, t_s), {now_, map_.spline(), C, lines(C)}, kNoise_mm, lasting_mm);
    }
    return agreement_;
  }

  [[nodiscard]] Eigen::Vector3d sigma_mm(double s_mm) const {
    return agreement_.doubt({s_mm, arc_point(s_mm), -arc_tangent_to_tip(s_mm)}, now_)
        .diagonal()
        .cwiseMax(0)
        .cwiseSqrt();
  }
  void forget_held() { agreement_.forget_held(); }
  const CoilImageAgreement& forget() {
    agreement_.reset();
    return agreement_;
  }
  [[nodiscard]] MonotonicTime now() const { return now_; }
  [[nodiscard]] std::string words() const {
    std::array<char, 256> text{};
    write_disagreement(agreement_.summary(), room_.instruments.front(), room_.cameras, text);
    return text.data();
  }

 private:
  CoilObservations observed(const Mistake& mistake, double t_s) {
    std::normal_distribution<double> normal(0, noise_mm);
    CoilObservations coils;
    for (const CoilPlacement& coil : room_.instruments.front().coils) {
      const int i = coils.count++;
      CoilObservation& seen = coils.coils[static_cast<std::size_t>(i)];
      const Eigen::Vector3d p_mm = arc_point(coil.offset_from_tip_mm) + motion_mm(t_s);
      seen.state = i == 2 ? third : CoilState::kUsed;
      seen.s_mm = coil.offset_from_tip_mm;
      seen.p_world_mm =
          mistake(p_mm, i, t_s) + Eigen::Vector3d(normal(random_), normal(random_), normal(random_));
      seen.tangent_world = arc_tangent_to_tip(coil.offset_from_tip_mm);
    }
    return coils;
  }

  Eigen::Matrix3Xd scaled() {
    CoilObservations coils = observed(as_it_is, 0);
    for (int i = 0; i < coils.count; ++i) {
      CoilObservation& coil = coils.coils[static_cast<std::size_t>(i)];
      const double s_mm = kMiddle_mm + (coil.s_mm - kMiddle_mm) / image_scale;
      coil.p_world_mm = arc_point(s_mm);
      coil.p_world_mm.head<2>() *= image_scale;
      coil.tangent_world = arc_tangent_to_tip(s_mm);
    }
    Eigen::Matrix3Xd C = C_;
    bool converged = false;
    map_.solve_linear(coils, C);
    map_.refine(coils, {}, nullptr, 20, C, converged);
    return C;
  }

  std::span<const ViewConstraints> lines(const Eigen::Matrix3Xd& C) {
    views_.clear();
    lines_.resize(cameras_.size());
    for (std::size_t v = 0; v < cameras_.size(); ++v) {
      lines_[v].clear();
      for (double s_mm = 0; s_mm <= 380; s_mm += 2) {
        lines_[v].push_back({.s_mm = s_mm, .variance_px2 = s_mm < dark_from_mm ? 1.0 : 200.0});
      }
      const CubicBasis tip = map_.spline().basis(0);
      const auto p = cameras_[v].project(combine(C, tip.first, tip.value));
      const Eigen::Vector2d outward_px = p->J_image_world * -combine(C, tip.first, tip.first_derivative);
      views_.push_back({&cameras_[v], lines_[v].data(), static_cast<int>(lines_[v].size())});
      if (shows_end) {
        views_.back().end_by_greys = {0, p->p_image_px + end_mm * outward_px, outward_px.normalized()};
      }
    }
    return views_;
  }

  RoomDescription room_;
  TubeMap map_;
  std::mt19937 random_;
  std::vector<Camera> cameras_;
  Eigen::Matrix3Xd C_;
  std::vector<std::vector<LineConstraint>> lines_;
  std::vector<ViewConstraints> views_;
  MonotonicTime now_ = from_ns(1'000'000'000);
  CoilImageAgreement agreement_;
};

/// The gate believes a third coil that is off by this mistake, and leaves it out when it is right again: do
/// coils and images disagree meanwhile, and after it came back?
inline std::pair<bool, bool> disagree_in_and_after_a_burst(const Mistake& mistake) {
  AgreementBench bench;
  bench.watch(0.3, as_it_is);
  const bool meanwhile = bench.watch(1.4, mistake).disagree();
  bench.third = CoilState::kOutlier;
  bench.watch(0.2, as_it_is);
  bench.third = CoilState::kUsed;
  return {meanwhile, bench.watch(0.5, as_it_is).disagree()};
}

}  // namespace tubed
