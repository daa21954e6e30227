// [em.reference]: which sensor is on the patient, and where it was when the tracker was registered.
#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <map>

#include "daemon/config/assemble.hpp"
#include "idl/geometry/sensor_pose.hpp"

namespace tubed {

namespace {

constexpr double kAxisTolerance = 0.02;  // of a length of 1: a person writes three decimals

void refuse(const CheckedTable& table, const std::string& key, std::string message, Problems& problems) {
  const CheckedValue& value = table.at(key);
  problems.push_back({value.state == ValueState::kAbsent ? table.position : value.position,
                      table.path_of(key), std::move(message)});
}

bool is_absent(const CheckedTable& table, const std::string& key) {
  return table.at(key).state == ValueState::kAbsent;
}

/// Keys that go with `kind`, "sensor" or "sensors": each has to be there, and those of the other must not.
void check_keys_of(const CheckedTable& table, const std::string& kind,
                   std::initializer_list<const char*> needed, std::initializer_list<const char*> strange,
                   Problems& problems) {
  for (const char* const key : needed) {
    if (is_absent(table, key)) {
      refuse(table, key,
             "missing, " + table.path_of(kind) +
                 " requires it: what the tracker said of it when em.T_world_em was found",
             problems);
    }
  }
  for (const char* const key : strange) {
    if (!is_absent(table, key)) {
      refuse(table, key, "means nothing with " + table.path_of(kind) + ": remove it", problems);
    }
  }
}

void check_which(const CheckedTable& table, Problems& problems) {
  const bool has_one = !is_absent(table, "sensor");
  const bool has_two = !is_absent(table, "sensors");
  if (has_one == has_two) {
    const std::string found = has_one
                                  ? "expected one of sensor and sensors, found both"
                                  : "missing, expected sensor = N (6 degrees of freedom) or sensors = [N, M] "
                                    "(two 5-DOF coils on one body)";
    refuse(table, has_one ? "sensors" : "sensor", found, problems);
  } else if (has_one) {
    check_keys_of(table, "sensor", {"T_em_reference"}, {"positions_em_mm", "axes_em"}, problems);
  } else {
    check_keys_of(table, "sensors", {"positions_em_mm", "axes_em"}, {"T_em_reference"}, problems);
  }
}

std::vector<int> sensors_of(const CheckedTable& table) {
  if (table.has("sensor")) {
    return {static_cast<int>(table.get<std::int64_t>("sensor"))};
  }
  const auto& sensors = table.get<std::vector<std::int64_t>>("sensors");
  return table.has("sensors") ? std::vector<int>(sensors.begin(), sensors.end()) : std::vector<int>{};
}

void check_sensors(const CheckedTable& file, const CheckedTable& table, const std::vector<int>& sensors,
                   Problems& problems) {
  const std::string key = table.has("sensor") ? "sensor" : "sensors";
  if (sensors.size() == 2 && sensors[0] == sensors[1]) {
    refuse(table, key, "sensor " + std::to_string(sensors[0]) + " is named twice; expected two coils",
           problems);
  }
  for (const CheckedTable& instrument : file.many("instrument")) {
    for (const CheckedTable& coil : instrument.many("coil")) {
      const auto sensor = static_cast<int>(coil.get<std::int64_t>("sensor"));
      if (coil.sound("sensor") && std::find(sensors.begin(), sensors.end(), sensor) != sensors.end()) {
        refuse(table, key,
               "sensor " + std::to_string(sensor) + " is a coil of the catheter too, in line " +
                   std::to_string(coil.at("sensor").position.line) +
                   "; the reference has to be a sensor of its own, on the patient",
               problems);
      }
    }
  }
}

std::array<Eigen::Vector3d, 2> two_vectors(const CheckedTable& table, const std::string& key) {
  const auto& numbers = table.get<std::vector<double>>(key);
  return {Eigen::Vector3d(numbers[0], numbers[1], numbers[2]),
          Eigen::Vector3d(numbers[3], numbers[4], numbers[5])};
}

/// Sets the registered pose of two coils, when it is one from which a pose follows.
void read_two_coils(const CheckedTable& table, ReferenceDescription& reference, Problems& problems) {
  if (!table.has("positions_em_mm") || !table.has("axes_em")) {
    return;
  }
  reference.p_em_registered_mm = two_vectors(table, "positions_em_mm");
  reference.axis_em_registered = two_vectors(table, "axes_em");
  TwoCoils coils;
  for (std::size_t i = 0; i < coils.size(); ++i) {
    const double length = reference.axis_em_registered[i].norm();
    if (std::abs(length - 1) > kAxisTolerance) {
      refuse(table, "axes_em", "expected two directions of length 1, found one of length " + to_toml(length),
             problems);
      return;
    }
    reference.axis_em_registered[i] /= length;
    coils[i] = {reference.p_em_registered_mm[i], reference.axis_em_registered[i]};
  }
  if (!knows_turn(coils)) {
    refuse(table, "axes_em",
           "both axes and the line between the coils are parallel within 10 degrees, so that a turn about it "
           "cannot be known: fix the coils at an angle, and register again",
           problems);
  }
}

void check_ports(const CheckedTable& file, const CheckedTable& table, const ReferenceDescription& reference,
                 Problems& problems) {
  if (reference.ports.size() > reference.sensors.size()) {
    refuse(table, "ports", "expected one port a sensor at most", problems);
    return;
  }
  RoomDescription alone;
  alone.reference = reference;
  for (const CoilPlacement& own : tracked_coils(alone)) {
    for (const CheckedTable& instrument : file.many("instrument")) {
      for (const CheckedTable& coil : instrument.many("coil")) {
        const int channel = coil.has("channel") ? static_cast<int>(coil.get<std::int64_t>("channel")) : 0;
        if (coil.has("port") && coil.get<std::int64_t>("port") == own.port && channel == own.channel) {
          refuse(table, "ports",
                 "port " + std::to_string(own.port) + " channel " + std::to_string(channel) +
                     " belongs to sensor " + std::to_string(coil.get<std::int64_t>("sensor")) +
                     " of the catheter already; expected each plug once",
                 problems);
        }
      }
    }
  }
}

}  // namespace

std::optional<ReferenceDescription> reference_description(const CheckedTable& file, Problems& problems) {
  const CheckedTable& em = file.one("em");
  const CheckedTable& table = em.one("reference");
  if (!table.given) {
    return std::nullopt;
  }
  if (is_absent(em, "T_world_em")) {
    problems.push_back(
        {table.position, table.path,
         "means nothing without em.T_world_em: it says how the tracker's frame moved since it was "
         "registered"});
  }
  ReferenceDescription reference;
  read_keys(table, reference_keys(), reference);
  check_which(table, problems);
  reference.sensors = sensors_of(table);
  check_sensors(file, table, reference.sensors, problems);
  reference.T_em_reference_registered = rigid(table, "T_em_reference", problems);
  read_two_coils(table, reference, problems);
  if (table.has("ports")) {
    const auto& ports = table.get<std::vector<std::int64_t>>("ports");
    reference.ports.assign(ports.begin(), ports.end());
    check_ports(file, table, reference, problems);
  }
  return reference;
}

void check_reference_driver(const CheckedTable& file, const std::vector<DriverDescription>& available,
                            Problems& problems) {
  const CheckedTable& em = file.one("em");
  const CheckedTable& table = em.one("reference");
  const DriverDescription* driver = find_driver(available, em.get<std::string>("driver"));
  if (!table.given || !em.has("driver") || driver == nullptr) {
    return;
  }
  const std::string name = "em.driver = \"" + driver->name + "\"";
  if (driver->finds_coils_by_port && is_absent(table, "ports")) {
    refuse(table, "ports", "missing, " + name + " tells coils apart by port and channel", problems);
  }
  if (!driver->gives_orientation && !is_absent(table, "sensor")) {
    refuse(table, "sensor",
           name +
               " gives positions and axes, and no turn about the axis: use sensors = [N, M], two 5-DOF coils "
               "on one body",
           problems);
  }
}

}  // namespace tubed
