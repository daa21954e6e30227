#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <map>
#include <set>

#include "daemon/config/assemble.hpp"
#include "daemon/image/mark_search.hpp"
#include "idl/geometry/c_arm.hpp"
#include "idl/geometry/image_mask.hpp"

namespace tubed {

namespace {

// A rotation written by a person with three decimals passes, with a warning (assemble_sources.cpp); 1 % of
// scale does not.
constexpr double kRotationTolerance = 2e-3;

void check_distances(const CheckedTable& table, const CArm& c_arm, Problems& problems) {
  if (table.has("source_isocentre_mm") && table.has("source_detector_mm") &&
      c_arm.source_isocentre_mm >= c_arm.source_detector_mm) {
    problems.push_back({table.at("source_isocentre_mm").position, table.path_of("source_isocentre_mm"),
                        "expected less than source_detector_mm, " + to_toml(c_arm.source_detector_mm) +
                            " mm, found " + to_toml(c_arm.source_isocentre_mm)});
  }
}

void check_masks(const CheckedTable& table, const CameraCalibration& camera, Problems& problems) {
  if (table.sound("masks") && table.sound("width") && table.sound("height")) {
    const std::string fault = fault_of_masks(camera.masks, camera.width, camera.height);
    if (!fault.empty()) {
      problems.push_back({table.at("masks").position, table.path_of("masks"), fault});
    }
  }
}

CArm c_arm_of(const CheckedTable& table, Problems& problems) {
  CArm c_arm;
  read_keys(table, c_arm_keys(), c_arm);
  c_arm.T_c_arm_world = rigid(table, "T_c_arm_world", problems);
  return c_arm;
}

CameraCalibration camera_calibration(const CheckedTable& table, Problems& problems) {
  CameraCalibration camera;
  read_keys(table, camera_keys(), camera);
  check_masks(table, camera, problems);
  const CheckedTable& c_arm_table = table.one("c_arm");
  if (!c_arm_table.given) {
    camera.T_camera_world = rigid(table, "T_camera_world", problems);
    return camera;
  }
  const CArm c_arm = c_arm_of(c_arm_table, problems);
  check_distances(c_arm_table, c_arm, problems);
  place(c_arm, camera);
  return camera;
}

std::optional<std::uint32_t> serial_number(const std::string& digits) {
  std::uint32_t value = 0;
  const char* const end = digits.data() + digits.size();
  const auto [stopped, error] = std::from_chars(digits.data(), end, value, 16);
  return error == std::errc{} && stopped == end ? std::optional(value) : std::nullopt;
}

CoilPlacement coil_placement(const CheckedTable& table) {
  CoilPlacement coil;
  read_keys(table, coil_keys(), coil);
  coil.tool_serial =
      table.has("tool_serial") ? serial_number(table.get<std::string>("tool_serial")) : std::nullopt;
  return coil;
}

void check_expected_tools(const CheckedTable& instrument, Problems& problems) {
  for (const CheckedTable& coil : instrument.many("coil")) {
    for (const char* const key : {"tool_serial", "tool_part_number"}) {
      if (coil.has(key) && !coil.has("port")) {
        problems.push_back({coil.at(key).position, coil.path_of(key),
                            "means nothing without port: expected both or neither"});
      }
    }
    if (coil.has("tool_serial") && coil.sound("tool_serial") &&
        !serial_number(coil.get<std::string>("tool_serial"))) {
      problems.push_back({coil.at("tool_serial").position, coil.path_of("tool_serial"),
                          "expected 1 to 8 hexadecimal digits, as in \"3C4B0001\", found \"" +
                              coil.get<std::string>("tool_serial") + "\""});
    }
  }
}

void check_offsets(const CheckedTable& instrument, Problems& problems) {
  double previous_mm = -1;
  for (const CheckedTable& coil : instrument.many("coil")) {
    if (!coil.sound("offset_from_tip_mm")) {
      continue;
    }
    const double offset_mm = coil.get<double>("offset_from_tip_mm");
    const double length_mm = instrument.get<double>("length_mm");
    if (offset_mm <= previous_mm) {
      problems.push_back({coil.at("offset_from_tip_mm").position, coil.path_of("offset_from_tip_mm"),
                          "expected more than the coil before it, " + to_toml(previous_mm) + " mm, found " +
                              to_toml(offset_mm) + "; coils are listed from the tip"});
    } else if (instrument.sound("length_mm") && offset_mm > length_mm) {
      problems.push_back({coil.at("offset_from_tip_mm").position, coil.path_of("offset_from_tip_mm"),
                          "expected at most the instrument's length_mm, " + to_toml(length_mm) +
                              " mm, found " + to_toml(offset_mm)});
    }
    previous_mm = std::max(previous_mm, offset_mm);
  }
}

void check_coil_sensors(const CheckedTable& instrument, Problems& problems) {
  std::set<std::int64_t> seen;
  for (const CheckedTable& coil : instrument.many("coil")) {
    if (coil.sound("sensor") && !seen.insert(coil.get<std::int64_t>("sensor")).second) {
      problems.push_back({coil.at("sensor").position, coil.path_of("sensor"),
                          "sensor " + std::to_string(coil.get<std::int64_t>("sensor")) +
                              " is used twice in this instrument; expected each sensor once"});
    }
  }
}

// Two instruments may share a sensor; then both have to say the same plug, or one of them none.
void check_plugs(const CheckedTable& file, Problems& problems) {
  std::map<std::int64_t, CoilPlacement> of_sensor;
  std::map<std::pair<int, int>, int> of_plug;
  for (const CheckedTable& instrument : file.many("instrument")) {
    for (const CheckedTable& table : instrument.many("coil")) {
      const CoilPlacement coil = coil_placement(table);
      if (coil.port == 0) {
        if (table.has("channel")) {
          problems.push_back({table.at("channel").position, table.path_of("channel"),
                              "means nothing without port: expected both or neither"});
        }
        continue;
      }
      const auto [first, is_new] = of_sensor.emplace(coil.sensor, coil);
      const auto [user, is_free] = of_plug.emplace(std::pair(coil.port, coil.channel), coil.sensor);
      const std::string plug =
          "port " + std::to_string(coil.port) + " channel " + std::to_string(coil.channel);
      if (!is_free && user->second != coil.sensor) {
        problems.push_back({table.at("port").position, table.path_of("port"),
                            plug + " belongs to sensor " + std::to_string(user->second) +
                                " already; expected each plug once"});
      } else if (!is_new && (first->second.port != coil.port || first->second.channel != coil.channel)) {
        problems.push_back({table.at("port").position, table.path_of("port"),
                            "sensor " + std::to_string(coil.sensor) + " is at port " +
                                std::to_string(first->second.port) + " channel " +
                                std::to_string(first->second.channel) + " already, found " + plug});
      }
    }
  }
}

void check_marks(const CheckedTable& table, const InstrumentDescription& instrument, Problems& problems) {
  const std::vector<double>& marks_mm = instrument.marks_mm;
  if (!table.has("marks_mm") || marks_mm.empty()) {
    return;
  }
  const auto refuse = [&](const std::string& words) {
    problems.push_back({table.at("marks_mm").position, table.path_of("marks_mm"), words});
  };
  for (std::size_t i = 1; i < marks_mm.size(); ++i) {
    if (marks_mm[i] < marks_mm[i - 1] + instrument.mark_length_mm) {
      refuse("expected marks from the tip on, at least mark_length_mm, " +
             to_toml(instrument.mark_length_mm) + " mm, apart; found " + to_toml(marks_mm[i]) + " after " +
             to_toml(marks_mm[i - 1]));
      return;
    }
  }
  if (marks_mm.size() == 1) {
    refuse("one band could be any other dark spot: expected two marks or more");
  } else if (const double needed_mm = MarkSearch::needed_behind_mm(instrument.mark_length_mm);
             marks_mm.back() + needed_mm > instrument.length_mm) {
    refuse("expected " + to_toml(needed_mm) + " mm of the instrument behind its last mark, length_mm is " +
           to_toml(instrument.length_mm) + ", found " + to_toml(marks_mm.back()));
  }
}

InstrumentDescription instrument_description(const CheckedTable& table, Problems& problems) {
  InstrumentDescription instrument;
  read_keys(table, instrument_keys(), instrument);
  for (const CheckedTable& coil : table.many("coil")) {
    instrument.coils.push_back(coil_placement(coil));
  }
  check_offsets(table, problems);
  check_coil_sensors(table, problems);
  check_expected_tools(table, problems);
  check_rest_shape(table, instrument, problems);
  check_stiffness(table, instrument, problems);
  check_marks(table, instrument, problems);
  return instrument;
}

void check_unique(const std::vector<CheckedTable>& tables, const std::string& key, Problems& problems) {
  std::map<std::string, FilePosition> seen;
  for (const CheckedTable& table : tables) {
    if (!table.sound(key)) {
      continue;
    }
    const auto [first, is_new] = seen.emplace(table.get<std::string>(key), table.at(key).position);
    if (!is_new) {
      problems.push_back({table.at(key).position, table.path_of(key),
                          "expected a unique name, found \"" + printable(first->first) +
                              "\" again, first used in line " + std::to_string(first->second.line)});
    }
  }
}

void check_belongs_to_registration(const CheckedTable& em, Problems& problems) {
  for (const char* const key : {"registration_residual_mm", "registration_covariance",
                                "registration_centre_mm", "registration_date"}) {
    if (em.has(key) && em.at("T_world_em").state == ValueState::kAbsent) {
      problems.push_back({em.at(key).position, em.path_of(key),
                          "means nothing without em.T_world_em: expected both or neither"});
    }
  }
}

/// Why the matrix is no covariance; empty when it is one. Turns and shifts differ by orders of magnitude, so
/// that eigenvalues are those of the correlations.
std::string refusal(const RegistrationCovariance& covariance) {
  constexpr double kTolerance = 1e-6;  // a person writes seven digits
  const Eigen::Matrix<double, 6, 1> variances = covariance.diagonal();
  if (variances.minCoeff() < 0) {
    return "expected variances of 0 and more on the diagonal, found " + to_toml(variances.minCoeff());
  }
  RegistrationCovariance correlation = covariance;
  for (Eigen::Index i = 0; i < 6; ++i) {
    for (Eigen::Index j = 0; j < 6; ++j) {
      const double scale = std::sqrt(variances(i) * variances(j));
      if (scale == 0 && covariance(i, j) != 0) {
        return "expected a positive semidefinite matrix: a variance is 0, and a number in its row is not";
      }
      correlation(i, j) = scale == 0 ? 0 : covariance(i, j) / scale;
    }
  }
  const double least =
      Eigen::SelfAdjointEigenSolver<RegistrationCovariance>(correlation, Eigen::EigenvaluesOnly)
          .eigenvalues()(0);
  if (least >= -kTolerance) {
    return "";
  }
  std::array<char, 120> words{};
  std::snprintf(words.data(), words.size(),
                "expected a positive semidefinite matrix, found an eigenvalue of %.3g (of its correlations)",
                least);
  return words.data();
}

std::optional<RegistrationQuality> registration_quality(const CheckedTable& em, Problems& problems) {
  const std::string kCovariance = "registration_covariance";
  const std::string kCentre = "registration_centre_mm";
  const auto is_absent = [&](const std::string& key) { return em.at(key).state == ValueState::kAbsent; };
  if (is_absent(kCovariance) != is_absent(kCentre)) {
    const std::string& given = is_absent(kCovariance) ? kCentre : kCovariance;
    const std::string& missing = is_absent(kCovariance) ? kCovariance : kCentre;
    problems.push_back({em.at(given).position, em.path_of(given),
                        "means nothing without em." + missing + ": expected both or neither"});
  }
  if (!em.has(kCovariance)) {
    return std::nullopt;
  }
  RegistrationQuality quality;
  quality.covariance = from_upper_triangle(em.get<std::vector<double>>(kCovariance));
  const std::string why = refusal(quality.covariance);
  if (!why.empty()) {
    problems.push_back({em.at(kCovariance).position, em.path_of(kCovariance), why});
  }
  quality.centre_world_mm = Eigen::Map<const Eigen::Vector3d>(em.get<std::vector<double>>(kCentre).data());
  return quality;
}

}  // namespace

RigidTransform rigid(const CheckedTable& table, const std::string& key, Problems& problems) {
  if (!table.has(key)) {
    return RigidTransform::Identity();
  }
  std::string why;
  const auto transform = rigid_from_matrix(table.get<Eigen::Matrix4d>(key), kRotationTolerance, why);
  if (!transform) {
    problems.push_back({table.at(key).position, table.path_of(key), "expected a rigid transform: " + why});
  }
  return transform.value_or(RigidTransform::Identity());
}

std::vector<std::optional<CArm>> c_arms(const CheckedTable& file) {
  std::vector<std::optional<CArm>> arms;
  Problems told_with_the_room;
  for (const CheckedTable& camera : file.many("camera")) {
    const CheckedTable& table = camera.one("c_arm");
    arms.push_back(table.given ? std::optional(c_arm_of(table, told_with_the_room)) : std::nullopt);
  }
  return arms;
}

RoomDescription room_description(const CheckedTable& file, Problems& problems) {
  const CheckedTable& em = file.one("em");
  RoomDescription room;
  room.registered = em.has("T_world_em");
  room.T_world_em = rigid(em, "T_world_em", problems);
  check_belongs_to_registration(em, problems);
  room.registration_quality = registration_quality(em, problems);
  if (em.has("registration_residual_mm")) {
    room.registration_residual_mm = em.get<double>("registration_residual_mm");
  }
  if (em.has("registration_date")) {
    room.registration_date = em.get<std::string>("registration_date");
  }
  for (const CheckedTable& camera : file.many("camera")) {
    room.cameras.push_back(camera_calibration(camera, problems));
  }
  for (const CheckedTable& instrument : file.many("instrument")) {
    room.instruments.push_back(instrument_description(instrument, problems));
  }
  room.reference = reference_description(file, problems);
  check_plugs(file, problems);
  check_unique(file.many("camera"), "name", problems);
  check_unique(file.many("instrument"), "id", problems);
  return room;
}

}  // namespace tubed
