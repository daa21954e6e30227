// What stands in the room and how it is calibrated: cameras, tracker, instruments. Values from the
// configuration; a simulated source draws from it, the estimator measures with it.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "drivers/interface/em_source.hpp"
#include "drivers/interface/reference_description.hpp"
#include "drivers/interface/registration_quality.hpp"
#include "drivers/interface/rest_curve.hpp"
#include "drivers/interface/stiffness_profile.hpp"
#include "idl/estimate.hpp"
#include "idl/geometry/camera.hpp"
#include "idl/geometry/rigid_transform.hpp"
#include "idl/settings/bound_key.hpp"

namespace tubed {

/// One coil of an instrument.
struct CoilPlacement {
  int sensor = 1;                 ///< counts from 1 in the tracker's measurement
  double offset_from_tip_mm = 0;  ///< s along the catheter
  bool flipped = false;           ///< mounted the other way round: its +z points away from the tip
  int port = 0;                   ///< of the tracker, counts from 1; 0: not given
  int channel = 0;                ///< of the port: two coils may share a plug
  std::optional<std::uint32_t> tool_serial =
      std::nullopt;                   ///< of the tool that has to be in that plug; not given: any
  std::string tool_part_number = {};  ///< the same; empty: any
  std::optional<double> offset_sigma_mm =
      std::nullopt;  ///< how well offset_from_tip_mm is known, one standard deviation; not given: not stated
};

/// The keys of an [[instrument.coil]]; tool_serial is checked and set by whoever reads them.
inline BoundKeys<CoilPlacement> coil_keys() {
  using S = CoilPlacement;
  return {key::required(key::number("sensor", &S::sensor, "", {1, kMaxTrackerCoils},
                                    "which sensor of the tracker it is, counted from 1"),
                        "1"),
          key::required(key::number("offset_from_tip_mm", &S::offset_from_tip_mm, "mm", {0, 2000},
                                    "where it sits, along the catheter from the tip"),
                        "10.0"),
          key::optional(key::number("offset_sigma_mm", &S::offset_sigma_mm, "mm", {0, 100},
                                    "standard deviation of offset_from_tip_mm; left out = not stated"),
                        0.5),
          key::flag("flipped", &S::flipped, "mounted the other way round: its z points away from the tip"),
          key::optional(key::number("port", &S::port, "", {1, kMaxTrackerCoils},
                                    "port of the tracker it is plugged in; a tracker with ports requires it"),
                        std::int64_t{1}),
          key::optional(key::number("channel", &S::channel, "", {0, 1},
                                    "which of the two coils of its plug it is; left out = 0"),
                        std::int64_t{0}),
          {key::optional(
              key::text("tool_serial", "3C4B0001", {1, 8, true, " "},
                        "serial number that the tool in this plug has to have, hexadecimal, as `tubectl "
                        "doctor --tracker` prints it; another tool is told and not tracked; left out = "
                        "any"))},
          key::optional(key::text("tool_part_number", &S::tool_part_number, {1, 20, true},
                                  "part number that the tool in this plug has to have; left out = any"),
                        std::string("610029"))};
}

/// What a catheter's tip is like while nothing bends it.
enum class RestShape {
  kUnknown,   ///< nobody says: straight unless coils and images know better
  kStraight,  ///< as far as the instrument can be bent it is straight by itself
  kHook,      ///< its maker has bent the tip: a circle in one plane, see hook_radius_mm
  kArcs,      ///< the same in several arcs, see rest_arcs_mm
};

inline bool is_preshaped(RestShape shape) { return shape == RestShape::kHook || shape == RestShape::kArcs; }

inline constexpr std::size_t kMaxRestArcs = 32;

inline constexpr std::size_t kMaxMarks = 16;

/// One tracked catheter.
struct InstrumentDescription {
  std::string id;  ///< the DDS key
  double diameter_mm = 2.33;
  double length_mm = 380;            ///< from the tip, the part whose shape is asked for
  std::vector<CoilPlacement> coils;  ///< tip first
  RestShape rest_shape = RestShape::kUnknown;
  bool trust_straight = false;         ///< nobody asks images whether a straight tip is one
  double hook_radius_mm = 0;           ///< of a hook's circle; 0: there is none
  double hook_length_mm = 0;           ///< from the tip, along the catheter
  std::vector<double> rest_arcs_mm{};  ///< length and radius of each arc, see RestCurve::from_pairs()
  std::vector<double>
      stiffness{};  ///< of pieces, see StiffnessProfile::from_pairs(); empty: everywhere the same
  /// Middles of dark bands that images show across it, such as electrodes and marker bands, arc length from
  /// the tip, ascending; each mark_length_mm long.
  std::vector<double> marks_mm{};
  double mark_length_mm = 1.3;

  [[nodiscard]] StiffnessProfile stiffness_profile() const { return StiffnessProfile::from_pairs(stiffness); }

  /// The bent tip that the configuration tells of; without arcs where it tells of none.
  [[nodiscard]] RestCurve rest_curve() const {
    switch (rest_shape) {
      case RestShape::kHook:
        return RestCurve::hook(hook_radius_mm, hook_length_mm);
      case RestShape::kArcs:
        return RestCurve::from_pairs(rest_arcs_mm);
      case RestShape::kUnknown:
      case RestShape::kStraight:
        break;
    }
    return {};
  }
};

/// The keys of an [[instrument]], its mode aside.
inline BoundKeys<InstrumentDescription> instrument_keys() {
  using S = InstrumentDescription;
  return {
      key::required(key::text("id", &S::id, key::published_name(kInstrumentIdLength), "the DDS key, unique"),
                    "\"cath-1\""),
      key::number("diameter_mm", &S::diameter_mm, "mm", {0.3, 20}, "outer diameter; 7 Fr = 2.33 mm"),
      key::number("length_mm", &S::length_mm, "mm", {10, 2000},
                  "from the tip, the part whose shape is asked for"),
      key::word(
          "rest_shape", &S::rest_shape,
          {{RestShape::kUnknown, "unknown"},
           {RestShape::kStraight, "straight"},
           {RestShape::kHook, "hook"},
           {RestShape::kArcs, "arcs"}},
          "the tip while nothing bends it: a hook or several arcs that its maker has bent, straight, or left "
          "to coils and images to find out"),
      key::flag("trust_straight", &S::trust_straight,
                "with rest_shape \"straight\": images are not asked whether the tip is a hook, which saves "
                "time, and nobody tells when it is another catheter"),
      key::optional(
          key::number(
              "hook_radius_mm", &S::hook_radius_mm, "mm", {2, 200},
              "of rest_shape \"hook\": radius of its circle, along the middle of the catheter; half of "
              "diameter_mm or more"),
          8.0),
      key::optional(
          key::number(
              "hook_length_mm", &S::hook_length_mm, "mm", {3, 200},
              "of rest_shape \"hook\": how much of the catheter it is, from the tip; two turns at most"),
          14.0),
      key::optional(
          key::numbers("rest_arcs_mm", &S::rest_arcs_mm, "mm", {-500, 500}, {2, 2 * kMaxRestArcs},
                       "of rest_shape \"arcs\": length and radius of each arc from the tip on, one after the "
                       "other, all in one plane; radius 0 is straight, a negative one turns to the other "
                       "side. Each radius is half of diameter_mm or more, all together turn twice at most. "
                       "`tubectl calibrate tip` finds them in a drawing"),
          std::vector<double>{8, 0, 14, 8, 12, 0, 20, -25}),
      key::optional(
          key::numbers(
              "stiffness", &S::stiffness, "", {kMinStiffness, 500}, {2, 2 * kMaxStiffnessPieces},
              "of a catheter that is not equally stiff everywhere: length in mm and bending stiffness of "
              "each "
              "piece from the tip on, one after the other, the stiffness as a multiple of the shaft's, which "
              "is 1 and follows behind the last piece; left out = as stiff everywhere"),
          std::vector<double>{20, 0.2, 60, 0.6}),
      key::optional(
          key::numbers(
              "marks_mm", &S::marks_mm, "mm", {0, 2000}, {0, kMaxMarks},
              "middles of dark bands that images show across it (electrodes, marker bands), along the "
              "catheter from the tip; two or more hold the tube along itself in the image"),
          std::vector<double>{6.5, 10.5, 14.5}),
      key::number("mark_length_mm", &S::mark_length_mm, "mm", {0.3, 10}, "of marks_mm, length of each band")};
}

/// The registration's keys in [em]; all are checked and set by whoever reads them.
inline std::vector<KeyDescription> registration_keys() {
  constexpr double kMaxPlace_mm = 1e4;
  constexpr double kMaxCovariance = 1e6;
  return {
      key::optional(
          key::transform("T_world_em", "registration p_world = T_world_em * p_em; left out = not registered"),
          "[[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]"),
      key::optional(key::real("registration_residual_mm", 1.0, "mm", {0, 100},
                              "RMS residual of the registration; left out = not stated")),
      key::optional({.name = "registration_covariance",
                     .default_value = upper_triangle(
                         Eigen::Matrix<double, 6, 1>(1e-5, 1e-5, 1e-5, 0.04, 0.04, 0.04).asDiagonal()),
                     .unit = "rad^2, rad mm, mm^2",
                     .minimum = -kMaxCovariance,
                     .maximum = kMaxCovariance,
                     .minimum_count = kRegistrationCovarianceCount,
                     .maximum_count = kRegistrationCovarianceCount,
                     .meaning = "how well T_world_em is known: the upper triangle by rows of the 6 x 6 "
                                "covariance of a small turn w (rad), then shift v (mm), world axes, p_true = "
                                "p + w x (p - c) + v; `tubectl register` finds it"}),
      key::optional({.name = "registration_centre_mm",
                     .default_value = std::vector<double>{0, 0, 0},
                     .unit = "mm",
                     .minimum = -kMaxPlace_mm,
                     .maximum = kMaxPlace_mm,
                     .minimum_count = 3,
                     .maximum_count = 3,
                     .meaning = "c of registration_covariance, in the world: the centre of the markers"}),
      key::optional(key::text("registration_date", "2026-01-31 14:05", {.maximum_bytes = 64},
                              "when the registration was made"))};
}

struct RoomDescription {
  RigidTransform T_world_em = RigidTransform::Identity();
  bool registered = true;  ///< false: T_world_em was not given; estimates say NO_REGISTRATION
  std::vector<CameraCalibration> cameras;
  std::vector<InstrumentDescription> instruments;
  std::optional<ReferenceDescription> reference = std::nullopt;  ///< not given: T_world_em is constant
  std::optional<double> registration_residual_mm =
      std::nullopt;  ///< RMS of the registration; not given: not stated
  std::optional<RegistrationQuality> registration_quality = std::nullopt;  ///< not given: not stated
  std::string registration_date = {};  ///< in the words of whoever made it; empty: not stated
};

/// What a tracker has to measure for the room: the coils of all instruments, then the sensors of the
/// patient's reference, whose place along a catheter means nothing.
inline std::vector<CoilPlacement> tracked_coils(const RoomDescription& room) {
  std::vector<CoilPlacement> coils;
  for (const InstrumentDescription& instrument : room.instruments) {
    coils.insert(coils.end(), instrument.coils.begin(), instrument.coils.end());
  }
  if (!room.reference) {
    return coils;
  }
  const std::vector<int>& ports = room.reference->ports;
  for (std::size_t i = 0; i < room.reference->sensors.size(); ++i) {
    CoilPlacement coil{.sensor = room.reference->sensors[i]};
    if (!ports.empty()) {
      coil.port = ports[std::min(i, ports.size() - 1)];
      coil.channel = i > 0 && coil.port == ports.front() ? 1 : 0;
    }
    coils.push_back(coil);
  }
  return coils;
}

}  // namespace tubed
