#include <array>
#include <cstdio>
#include <map>
#include <set>

#include "daemon/config/assemble.hpp"
#include "idl/geometry/rigid_transform.hpp"

namespace tubed {

namespace {

const char* name_of_origin(Origin origin) {
  switch (origin) {
    case Origin::kSimulated:
      return "simulated";
    case Origin::kReplayed:
      return "replayed";
    case Origin::kDevice:
      break;
  }
  return "real";
}

void warn_of_mixed_origins(const CheckedTable& file, const std::vector<DriverDescription>& available,
                           Problems& found) {
  const CheckedTable& em = file.one("em");
  const DriverDescription* em_driver = find_driver(available, em.get<std::string>("driver"));
  for (const CheckedTable& camera : file.many("camera")) {
    const DriverDescription* driver = find_driver(available, camera.get<std::string>("driver"));
    if (driver != nullptr && em_driver != nullptr && driver->origin != em_driver->origin) {
      found.push_back({camera.at("driver").position, camera.path_of("driver"),
                       std::string(name_of_origin(driver->origin)) + " images beside " +
                           name_of_origin(em_driver->origin) +
                           " EM measurements: every estimate will say so"});
    }
  }
}

std::string mode_of(const CheckedTable& instrument, const CheckedTable& file) {
  return (instrument.has("mode") ? instrument : file.one("estimator")).get<std::string>("mode");
}

/// Sensor and place of each coil.
std::map<std::int64_t, double> coils_of(const CheckedTable& instrument) {
  std::map<std::int64_t, double> coils;
  for (const CheckedTable& coil : instrument.many("coil")) {
    coils.emplace(coil.get<std::int64_t>("sensor"), coil.get<double>("offset_from_tip_mm"));
  }
  return coils;
}

/// "sensor 2 belongs", "sensors 1, 2 belong": those of `coils` that are the other's too.
std::string sensors_of_both(const std::map<std::int64_t, double>& coils,
                            const std::map<std::int64_t, double>& others) {
  std::string sensors;
  std::size_t count = 0;
  for (const auto& [sensor, place] : coils) {
    if (!others.contains(sensor)) continue;
    sensors += (count == 0 ? "" : ", ") + std::to_string(sensor);
    ++count;
  }
  return count == 0 ? "" : count == 1 ? "sensor " + sensors + " belongs" : "sensors " + sensors + " belong";
}

// Two modes on one catheter, all coils at the same places, are compared; all else is a mistake.
void warn_of_shared_sensors(const CheckedTable& file, Problems& found) {
  const auto& instruments = file.many("instrument");
  for (std::size_t second = 1; second < instruments.size(); ++second) {
    for (std::size_t first = 0; first < second; ++first) {
      const auto coils = coils_of(instruments[second]);
      const auto others = coils_of(instruments[first]);
      const std::string shared = sensors_of_both(coils, others);
      const bool is_compared =
          coils == others && mode_of(instruments[first], file) != mode_of(instruments[second], file);
      if (!shared.empty() && !is_compared) {
        found.push_back(
            {instruments[second].at("id").position, instruments[second].path_of("coil"),
             shared + " to instrument \"" + instruments[first].get<std::string>("id") +
                 "\" too; meant is that only with all coils at the same places and another mode"});
      }
    }
  }
}

// The roll of a hook is found in images, by the modes that fuse them.
void warn_of_hooks_without_images(const CheckedTable& file, Problems& found) {
  for (const CheckedTable& instrument : file.many("instrument")) {
    const std::string& shape = instrument.get<std::string>("rest_shape");
    if (shape != "hook" && shape != "arcs") continue;
    const std::string mode = mode_of(instrument, file);
    const bool fuses = mode == name_of(EstimatorMode::kJoint) || mode == name_of(EstimatorMode::kFilter);
    if (!fuses || file.many("camera").empty()) {
      found.push_back(
          {instrument.at("rest_shape").position, instrument.path_of("rest_shape"),
           fuses ? "without a camera nobody finds the hook's roll: the tip is taken for straight"
                 : "mode \"" + mode + "\" takes every tip for straight; modes joint and filter do not"});
    }
  }
}

void warn_of_unused_tables(const CheckedTable& file, const std::vector<DriverDescription>& available,
                           Problems& found) {
  std::set<std::string> used{file.one("em").get<std::string>("driver")};
  for (const CheckedTable& camera : file.many("camera")) {
    used.insert(camera.get<std::string>("driver"));
  }
  for (const DriverDescription& driver : available) {
    const CheckedTable& table = file.one(driver.name);
    if (table.given && !used.contains(driver.name)) {
      found.push_back({table.position, driver.name, "no source uses this driver"});
    }
  }
}

// The world is then the patient as registered. That a constant pose is right while only the field generator
// moves, and wrong once the patient does, looks the same to the reference.
void warn_of_standing_cameras(const CheckedTable& file, Problems& found) {
  const CheckedTable& reference = file.one("em").one("reference");
  if (!reference.given || file.many("camera").empty()) {
    return;
  }
  for (const CheckedTable& camera : file.many("camera")) {
    if (camera.get<std::string>("geometry") != "required") {
      found.push_back(
          {camera.position, camera.path,
           "its pose is of the patient as registered, beside [em.reference]: right while the field "
           "generator moves and wrong once the patient does; where the table moves, images have to "
           "bring their geometry (geometry = \"required\")"});
    }
  }
}

void warn_of_a_rounded_rotation(const CheckedTable& table, const char* key, Problems& found) {
  constexpr double kUsual = 1e-4;
  const double error = table.has(key) ? orthonormality_error(table.get<Eigen::Matrix4d>(key)) : 0;
  if (error > kUsual) {
    std::array<char, 160> words{};
    std::snprintf(
        words.data(), words.size(),
        "its rotation is rounded: R^T R differs from the identity by %.1e; the nearest rotation is used",
        error);
    found.push_back({table.at(key).position, table.path_of(key), words.data()});
  }
}

void warn_of_rounded_rotations(const CheckedTable& file, Problems& found) {
  warn_of_a_rounded_rotation(file.one("em"), "T_world_em", found);
  for (const CheckedTable& camera : file.many("camera")) {
    warn_of_a_rounded_rotation(camera, "T_camera_world", found);
  }
}

}  // namespace

SourceChoice source_choice(const CheckedTable& file, const CheckedTable& owner,
                           const std::vector<DriverDescription>& available, Problems& problems) {
  SourceChoice choice;
  choice.device = owner.get<std::string>("device");
  const DriverDescription* driver = find_driver(available, owner.get<std::string>("driver"));
  if (!owner.has("driver") || driver == nullptr) {
    return choice;
  }
  choice.driver = driver->name;
  if (driver->needs_device && choice.device.empty()) {
    problems.push_back({owner.at("driver").position, owner.path_of("device"),
                        "missing, " + owner.path_of("driver") + " = \"" + driver->name + "\" requires it"});
  }
  const CheckedTable& table = file.one(driver->name);
  std::map<std::string, SettingValue> values;
  for (const KeyDescription& setting : driver->settings) {
    const CheckedValue& value = table.at(setting.name);
    if (value.state == ValueState::kAbsent) {
      problems.push_back({table.given ? table.position : owner.at("driver").position,
                          table.path_of(setting.name),
                          "missing, " + owner.path_of("driver") + " = \"" + driver->name + "\" requires it"});
    }
    values.emplace(setting.name, value.value);
  }
  choice.settings = DriverSettings(std::move(values));
  return choice;
}

void deliver_cameras(const CheckedTable& file, const std::vector<DriverDescription>& available,
                     Configuration& configuration, Problems& problems) {
  if (!problems.empty()) {
    return;
  }
  for (std::size_t index = 0; index < configuration.image_sources.size(); ++index) {
    SourceChoice& source = configuration.image_sources[index];
    const DriverDescription* driver = find_driver(available, source.driver);
    if (driver == nullptr || !driver->deliver_camera) {
      continue;
    }
    const std::string fault = driver->deliver_camera(configuration.room.cameras.at(index), source.settings);
    if (!fault.empty()) {
      const CheckedTable& camera = file.many("camera").at(index);
      const CheckedTable& table = file.one(driver->name);
      problems.push_back({table.given ? table.position : camera.position,
                          camera.path + " with [" + driver->name + "]", fault});
    }
  }
}

void check_coil_ports(const CheckedTable& file, const std::vector<DriverDescription>& available,
                      Problems& problems) {
  const CheckedTable& em = file.one("em");
  const DriverDescription* driver = find_driver(available, em.get<std::string>("driver"));
  if (!em.has("driver") || driver == nullptr || !driver->finds_coils_by_port) {
    return;
  }
  for (const CheckedTable& instrument : file.many("instrument")) {
    for (const CheckedTable& coil : instrument.many("coil")) {
      if (coil.at("port").state == ValueState::kAbsent) {
        problems.push_back(
            {coil.position, coil.path_of("port"),
             "missing, em.driver = \"" + driver->name + "\" tells coils apart by port and channel"});
      }
    }
  }
}

Problems warnings(const CheckedTable& file, const std::vector<DriverDescription>& available) {
  Problems found;
  warn_of_mixed_origins(file, available, found);
  warn_of_shared_sensors(file, found);
  warn_of_unused_tables(file, available, found);
  warn_of_standing_cameras(file, found);
  warn_of_rounded_rotations(file, found);
  warn_of_hooks_without_images(file, found);
  return found;
}

}  // namespace tubed
