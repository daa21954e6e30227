// What may be wrong between coils and images, as unknowns of a linear model.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <span>
#include <vector>

#include "daemon/estimator/coils/coil_observation.hpp"
#include "daemon/estimator/tube_map.hpp"

namespace tubed {

/// A shape that the images of one instant have confirmed, with what confirmed it.
struct ConfirmedShape {
  MonotonicTime instant;
  const UniformCubicBSpline& spline;
  const Eigen::Matrix3Xd& C;
  std::span<const ViewConstraints> views;  ///< their cameras stay where they are in memory
  std::optional<double> speed_mm_s{};      ///< of the tube along itself, toward its tip, where it is known
};

/// A displacement seen from the camera's axis, in the plane of the image; world, mm.
Eigen::Vector3d lateral_mm(const Camera& camera, const Eigen::Vector3d& p_world_mm);

/// The unknowns x, in this order: the registration's shift (mm, world) and turn (rad, about the middle of the
/// tube), an offset along the tube that all coils share (mm), the clock (s), each view's relative
/// magnification, three numbers a coil of its own (mm, world), three that it shares with its neighbours as a
/// smooth field does (of unit variance each, by the Cholesky factor of their covariance), and an offset along
/// the tube of each coil (mm). Rows are how a residual depends on them. Memory is taken in the constructor.
class CoilImageModel {
 public:
  CoilImageModel(const InstrumentDescription& instrument, int view_count);

  static constexpr Eigen::Index kTurn = 3;
  static constexpr Eigen::Index kArcLength = 6;
  static constexpr Eigen::Index kClock = 7;
  static constexpr Eigen::Index kViews = 8;
  [[nodiscard]] Eigen::Index own_column(int coil) const { return kViews + view_count_ + 3 * coil; }
  [[nodiscard]] Eigen::Index shared_column(int coil) const { return own_column(coil_count() + coil); }
  [[nodiscard]] Eigen::Index arc_length_column(int coil) const {
    return kViews + view_count_ + 6 * coil_count() + coil;
  }
  [[nodiscard]] Eigen::Index unknowns() const { return arc_length_column(coil_count()); }
  [[nodiscard]] int coil_count() const { return static_cast<int>(places_mm_.size()); }
  [[nodiscard]] int view_count() const { return view_count_; }

  void reset();

  /// The next shape: velocities are taken between the newest five, of a second at most, and the turn is about
  /// the middle of the first one.
  void follow(const ConfirmedShape& shape);

  /// Before the first shape there is no middle of it.
  [[nodiscard]] bool has_centre() const { return past_count_ > 0; }
  /// About which the registration turns; world.
  [[nodiscard]] const Eigen::Vector3d& centre_mm() const { return centre_mm_; }

  /// The displacement that a wrong registration makes of p, to a side, so many times.
  void add_registration(const Eigen::Vector3d& p_mm, const Eigen::Vector3d& side, double weight,
                        Eigen::VectorXd& row) const;
  /// A displacement of the coil to a side, so many times: what the clock and its neighbours' errors add.
  void add_shared_errors(int coil, const Eigen::Vector3d& side, double weight, Eigen::VectorXd& row) const;
  /// The same along the tube, with what is the coil's own there.
  void add_errors_along(int coil, const Eigen::Vector3d& toward_tip, double weight,
                        Eigen::VectorXd& row) const;

 private:
  static constexpr int kPlaces = 5;  ///< images between which velocities are taken
  struct Places {
    MonotonicTime instant{};
    std::array<Eigen::Vector3d, kMaxCoils> p_world_mm{};
    std::array<Eigen::Vector3d, kMaxCoils> toward_tip{};  ///< unit tangents, world
    std::optional<double> speed_mm_s{};
  };

  [[nodiscard]] Eigen::Vector3d velocity_mm_s(int coil) const;

  std::vector<double> places_mm_;  ///< of the coils, along the tube
  int view_count_;
  Eigen::MatrixXd neighbours_;  ///< Cholesky factor of how coils share what they are off by
  std::array<Places, kPlaces> past_{};
  int past_count_ = 0;
  Eigen::Vector3d centre_mm_ = Eigen::Vector3d::Zero();
};

}  // namespace tubed
