#include "daemon/config/schema.hpp"

#include <sys/sysinfo.h>

#include <algorithm>
#include <utility>

#include "daemon/config/configuration.hpp"
#include "idl/geometry/c_arm.hpp"

namespace tubed {

namespace {

using Keys = std::vector<KeyDescription>;

// The keys of several lists, one after the other.
Keys all_of(std::initializer_list<Keys> lists) {
  Keys all;
  for (const Keys& keys : lists) {
    all.insert(all.end(), keys.begin(), keys.end());
  }
  return all;
}

TableDescription daemon_table() {
  return {.name = "daemon",
          .meaning = "the daemon as a whole",
          .keys = all_of({descriptions(log_keys()), descriptions(rate_keys())})};
}

TableDescription realtime_table() {
  const double last_cpu = std::max(get_nprocs_conf(), 1) - 1;
  TableDescription table{
      .name = "realtime", .meaning = "scheduling of the threads", .keys = descriptions(scheduling_keys())};
  for (const StageTable& stage : kStageTables) {
    table.tables.push_back(
        {.name = stage.name, .meaning = stage.meaning, .keys = descriptions(thread_keys(last_cpu))});
  }
  return table;
}

TableDescription dds_table() {
  return {.name = "dds", .meaning = "where subscribers find the estimates", .keys = descriptions(dds_keys())};
}

TableDescription shm_table() {
  return {.name = "shm",
          .meaning = "estimates for software on the same machine, through shared memory, beside DDS",
          .keys = descriptions(shm_keys())};
}

// Which driver a source uses: a SourceChoice.
Keys source_keys(std::vector<std::string> driver_names, std::string meaning) {
  return {
      key::required(key::word("driver", "", std::move(driver_names), std::move(meaning)), "\"simulation\""),
      key::text("device", "", {}, "device of the driver, when it has one")};
}

TableDescription em_table(const std::vector<std::string>& driver_names) {
  return {
      .name = "em",
      .minimum_count = 1,
      .meaning = "the EM tracker",
      .keys = all_of({source_keys(driver_names, "the driver of the EM tracker"),
                      descriptions(back_off_keys()), registration_keys()}),
      .tables = {{.name = "reference",
                  .meaning =
                      "a sensor that is fixed to the patient: coils are expressed relative to it, so that "
                      "field generator or table may move; left out = neither moves",
                  .keys = descriptions(reference_keys()),
                  .is_alternative = true}}};
}

TableDescription camera_table(const std::vector<std::string>& driver_names) {
  return {
      .name = "camera",
      .shape = TableShape::kMany,
      .maximum_count = kMaxCameras,
      .meaning = "one view of the fluoroscope",
      .keys = all_of({descriptions(camera_keys()), source_keys(driver_names, "the driver of the images")}),
      .tables = {{.name = "c_arm",
                  .meaning = "instead of fx, fy and T_camera_world: a C-arm's distances and angles, as "
                             "DICOM defines them; cx and cy are of its image, which is as the source sees "
                             "it: displays mirror it, see mirrored",
                  .keys = descriptions(c_arm_keys()),
                  .is_alternative = true}}};
}

TableDescription instrument_table() {
  TableDescription coil{.name = "coil",
                        .shape = TableShape::kMany,
                        .minimum_count = 1,
                        .maximum_count = kMaxTrackerCoils,
                        .meaning = "one EM coil of this instrument, in order from the tip",
                        .keys = descriptions(coil_keys())};
  const KeyDescription own_mode =
      key::optional(mode_key("mode of this instrument alone; left out = that of [estimator]").key);
  return {.name = "instrument",
          .shape = TableShape::kMany,
          .minimum_count = 1,
          .maximum_count = kMaxInstruments,
          .meaning = "one tracked catheter",
          .keys = all_of({descriptions(instrument_keys()), {own_mode}}),
          .tables = {coil}};
}

TableDescription estimator_table() {
  const TableDescription paper{
      .name = "paper",
      .meaning = "mode \"paper\" alone: where the equations need help to work, and how much they get",
      .keys = descriptions(paper_keys())};
  return {.name = "estimator",
          .meaning = "how the shape is estimated, for every instrument",
          .keys = all_of({descriptions(estimator_keys()), descriptions(image_timeout_keys())}),
          .tables = {paper}};
}

TableDescription frangi_table() {
  return {.name = "frangi",
          .meaning = "the filter that finds tubes in an image",
          .keys = descriptions(frangi_keys())};
}

bool has_live_key(const TableDescription& table, const std::string& name, const std::string& path) {
  const auto below = [&](const std::string& inner) { return name.empty() ? inner : name + "." + inner; };
  return std::any_of(table.keys.begin(), table.keys.end(),
                     [&](const KeyDescription& key) {
                       return key.takes_effect == TakesEffect::kAtOnce && below(key.name) == path;
                     }) ||
         std::any_of(table.tables.begin(), table.tables.end(), [&](const TableDescription& inner) {
           return has_live_key(inner, below(inner.name), path);
         });
}

}  // namespace

TableDescription configuration_schema(const std::vector<DriverDescription>& available) {
  std::vector<std::string> em_drivers;
  std::vector<std::string> image_drivers;
  for (const DriverDescription& driver : available) {
    if (driver.make_em_source) {
      em_drivers.push_back(driver.name);
    }
    if (driver.make_image_source) {
      image_drivers.push_back(driver.name);
    }
  }
  TableDescription file{
      .meaning = "tubed's configuration",
      .tables = {daemon_table(), realtime_table(), dds_table(), shm_table(), em_table(em_drivers),
                 camera_table(image_drivers), instrument_table(), estimator_table(), frangi_table()}};
  for (const DriverDescription& driver : available) {
    file.tables.push_back(
        {.name = driver.name, .meaning = driver.meaning, .keys = driver.settings, .only_when_used = true});
  }
  return file;
}

std::string header_path(std::string_view path) {
  std::string header;
  bool inside = false;
  for (const char c : path) {
    inside = c == '[' || (inside && c != ']');
    if (!inside && c != ']') {
      header += c;
    }
  }
  return header;
}

bool takes_effect_at_once(const TableDescription& file, std::string_view path) {
  return has_live_key(file, "", header_path(path));
}

}  // namespace tubed
