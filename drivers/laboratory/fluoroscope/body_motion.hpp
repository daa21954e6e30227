// How breath and heart beat move a patient's tissue.
#pragma once

#include <Eigen/Core>

#include "drivers/laboratory/fluoroscope/radiograph_settings.hpp"

namespace tubed {

/// Where a patient is between rest (0) and the far end of a movement (1).
struct Posture {
  float systole = 0;      ///< 0: heart filled, 1: emptied
  float inspiration = 0;  ///< 0: breathed out
};

/// Smooth displacement fields. Breathing moves what lies between the lungs' apices and the abdomen toward the
/// feet, most at and below the diaphragm, and leaves spine and chest wall in place; the heart shortens toward
/// its centre. Immutable, callable from any thread, never allocates.
class BodyMotion {
 public:
  explicit BodyMotion(const MotionSettings& settings) : settings_(settings) {}

  /// Both are periodic and smooth. `clutter` says which of them go on at all.
  [[nodiscard]] Posture posture(double time_s, const ClutterStates& clutter) const;
  /// Of the tissue at `p_room_mm`, mm, room frame.
  [[nodiscard]] Eigen::Vector3f displacement(const Eigen::Vector3f& p_room_mm, const Posture& posture) const;

 private:
  [[nodiscard]] Eigen::Vector3f breath(const Eigen::Vector3f& p_room_mm) const;
  [[nodiscard]] Eigen::Vector3f beat(const Eigen::Vector3f& p_room_mm) const;

  MotionSettings settings_;
};

}  // namespace tubed
