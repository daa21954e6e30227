// How far the ends of a tube may be off that no coil holds.
#pragma once

#include <Eigen/Core>
#include <array>
#include <span>

#include "daemon/estimator/coils/coil_observation.hpp"
#include "daemon/estimator/images/line_constraint.hpp"

namespace tubed {

/// Beyond the first and the last coil a tube may bend to any side, as the vessel around it does: at a
/// distance d by d^2 / 2R. The covariance of the shape is that of a stiffer tube, since noise would bend a
/// soft one between its coils. An image that shows the tube from the coil on holds it across its rays as far
/// as it can be followed without a gap; what is found beyond may be something else. What was heard and seen a
/// while ago holds but for how far the tube may have moved since. Copied with the state; never allocates.
class LooseEnds {
 public:
  /// Standard deviation across the tube at that distance from the nearest coil, mm: d^2 / 2R beyond what the
  /// shape's own covariance is enough for, d at most.
  static double bends_away_mm(double distance_mm);

  /// Takes the coils that take part, measured at `time`.
  void observe(const CoilObservations& coils, MonotonicTime time);
  /// Takes images of one instant that confirmed the shape.
  void observe(std::span<const ViewConstraints> views, MonotonicTime instant);
  /// The shape is another one, which no image has confirmed.
  void forget_images() { seen_ = {}; }

  /// Ends of which an image shows a piece, and something else than the tube where the rest should be.
  struct Lost {
    bool tip = false;
    bool tail = false;
  };
  /// In the newest image of any camera that brought one within ten seconds.
  [[nodiscard]] Lost lost(MonotonicTime now) const;

  /// Mean square of what the tube may be off by at s_mm from its tip, where it is thought to be at p, mm^2,
  /// world; 0 between coils. Before the first coil was heard nothing is known, and that is 0 as well.
  [[nodiscard]] Eigen::Matrix3d square_mm2(double s_mm, const Eigen::Vector3d& p_world_mm,
                                           MonotonicTime now) const;

 private:
  struct Heard {
    double s_mm = 0;
    MonotonicTime at{};  ///< zero: never
  };
  /// Along what of the tube one camera's newest image shows it without a gap.
  struct Seen {
    const Camera* camera = nullptr;  ///< nullptr: none
    double from_mm = 0;
    double to_mm = 0;
    Lost lost{};
    MonotonicTime at{};
  };

  [[nodiscard]] double by_coils_mm(double s_mm, MonotonicTime now) const;

  std::array<Heard, kMaxCoils> heard_{};
  std::array<Seen, kMaxCameras> seen_{};
  int count_ = 0;        ///< of coils
  double first_mm_ = 0;  ///< the first coil that took part in the newest measurement,
  double last_mm_ = -1;  ///< and the last one; before the first: none
};

}  // namespace tubed
