// The patient's reference: a sensor fixed to the patient, to which all coils are expressed relative. Values
// from [em.reference]; a tracker has to measure its sensors, the estimator's history applies it.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "drivers/interface/em_source.hpp"
#include "idl/geometry/rigid_transform.hpp"
#include "idl/settings/bound_key.hpp"

namespace tubed {

/// One sensor of 6 degrees of freedom, or two 5-DOF coils that are rigidly on one body; and where they were,
/// in the tracker's frame, when T_world_em was found.
struct ReferenceDescription {
  std::vector<int> sensors;  ///< one of 6 DOF or two of 5; counts from 1 in the tracker's measurement
  std::vector<int> ports;    ///< of the tracker, one a sensor; empty: not given
  RigidTransform T_em_reference_registered = RigidTransform::Identity();  ///< of the 6-DOF sensor
  std::array<Eigen::Vector3d, 2> p_em_registered_mm{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  std::array<Eigen::Vector3d, 2> axis_em_registered{Eigen::Vector3d::UnitZ(), Eigen::Vector3d::UnitZ()};
  double time_constant_ms = 100;   ///< of the filter
  double timeout_ms = 500;         ///< lost for so long: INVALID
  double jump_mm = 4;              ///< between the filtered pose and one measurement: more is said
  double jump_deg = 3;             ///< likewise
  double tolerance_mm = 2;         ///< of the distance of two coils against what was registered
  double tolerance_deg = 4;        ///< of the angles between their axes and their connecting line
  double sigma_position_mm = 0.5;  ///< of one sensor, an axis
  double sigma_angle_deg = 0.3;    ///< of one sensor's axes, about an axis

  [[nodiscard]] bool has_two_coils() const { return sensors.size() == 2; }
};

/// The keys of [em.reference]; the sensors and their registered poses are checked and set by whoever reads
/// them.
inline BoundKeys<ReferenceDescription> reference_keys() {
  using S = ReferenceDescription;
  constexpr double kMaxPlace_mm = 1e4;
  return {
      {key::optional(key::integer("sensor", 6, "", {1, kMaxTrackerCoils},
                                  "the tracker's sensor on the patient, of 6 degrees of freedom"))},
      {key::optional({.name = "sensors",
                      .default_value = std::vector<std::int64_t>{6, 7},
                      .minimum = 1,
                      .maximum = kMaxTrackerCoils,
                      .minimum_count = 2,
                      .maximum_count = 2,
                      .meaning = "instead of sensor: two 5-DOF coils that are rigidly on one body"})},
      {key::optional({.name = "ports",
                      .default_value = std::vector<std::int64_t>{4},
                      .minimum = 1,
                      .maximum = kMaxTrackerCoils,
                      .minimum_count = 1,
                      .maximum_count = 2,
                      .meaning =
                          "port of the tracker of each sensor, a tracker with ports requires it; one port "
                          "of two coils: its channels 0 and 1"})},
      {key::optional(key::transform("T_em_reference",
                                    "of sensor: its pose when T_world_em was found, p_em = T_em_reference * "
                                    "p_reference"))},
      {key::optional(
          {.name = "positions_em_mm",
           .default_value = std::vector<double>{70, 40, 60, 100, 40, 60},
           .unit = "mm",
           .minimum = -kMaxPlace_mm,
           .maximum = kMaxPlace_mm,
           .minimum_count = 6,
           .maximum_count = 6,
           .meaning = "of sensors: x, y, z of the first, then of the second, when T_world_em was found"})},
      {key::optional(
          {.name = "axes_em",
           .default_value = std::vector<double>{0, 0, 1, 0, 1, 0},
           .minimum = -2,
           .maximum = 2,
           .minimum_count = 6,
           .maximum_count = 6,
           .meaning = "of sensors: the direction of the first one's z axis, then of the second one's"})},
      key::number("time_constant_ms", &S::time_constant_ms, "ms", {0, 5000},
                  "of the filter: noise shrinks, and a slow movement is followed so much later"),
      key::number("timeout_ms", &S::timeout_ms, "ms", {100, 10000},
                  "without the reference shapes are QUESTIONABLE at once and INVALID after this"),
      key::number("jump_mm", &S::jump_mm, "mm", {0.1, 100},
                  "a measurement farther than this from the filtered pose is a jump, which is said"),
      key::number("jump_deg", &S::jump_deg, "deg", {0.1, 90}, "the same of its angle"),
      key::number("tolerance_mm", &S::tolerance_mm, "mm", {0.05, 50},
                  "of sensors: how far their distance may be from what was registered"),
      key::number("tolerance_deg", &S::tolerance_deg, "deg", {0.1, 45},
                  "of sensors: how far their axes may be from what was registered"),
      key::number("sigma_position_mm", &S::sigma_position_mm, "mm", {0.001, 50},
                  "standard deviation of one measured position, an axis"),
      key::number("sigma_angle_deg", &S::sigma_angle_deg, "deg", {0.001, 45},
                  "standard deviation of one measured direction, about an axis")};
}

}  // namespace tubed
