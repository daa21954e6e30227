#include "daemon/config/schema.hpp"

#include <sys/sysinfo.h>

#include <algorithm>
#include <utility>

#include "daemon/estimator/estimator_settings.hpp"
#include "daemon/image/frangi_settings.hpp"
#include "daemon/pipeline/pipeline_settings.hpp"
#include "daemon/publishing/dds_settings.hpp"
#include "daemon/publishing/shm_settings.hpp"
#include "idl/estimate.hpp"

namespace tubed {

namespace {

struct Range {
  double minimum;
  double maximum;
};

KeyDescription real(std::string name, double value, std::string unit, Range range, std::string meaning) {
  return {.name = std::move(name),
          .default_value = value,
          .unit = std::move(unit),
          .minimum = range.minimum,
          .maximum = range.maximum,
          .meaning = std::move(meaning)};
}

KeyDescription integer(std::string name, std::int64_t value, std::string unit, Range range,
                       std::string meaning) {
  return {.name = std::move(name),
          .default_value = value,
          .unit = std::move(unit),
          .minimum = range.minimum,
          .maximum = range.maximum,
          .meaning = std::move(meaning)};
}

KeyDescription boolean(std::string name, bool value, std::string meaning) {
  return {.name = std::move(name), .default_value = value, .meaning = std::move(meaning)};
}

KeyDescription text(std::string name, std::string value, TextRule rule, std::string meaning) {
  return {.name = std::move(name),
          .default_value = std::move(value),
          .text = std::move(rule),
          .meaning = std::move(meaning)};
}

KeyDescription word(std::string name, std::string value, std::vector<std::string> choices,
                    std::string meaning) {
  return {.name = std::move(name),
          .default_value = std::move(value),
          .choices = std::move(choices),
          .meaning = std::move(meaning)};
}

KeyDescription matrix(std::string name, std::string unit, std::string meaning) {
  return {.name = std::move(name),
          .default_value = Eigen::Matrix4d{Eigen::Matrix4d::Identity()},
          .unit = std::move(unit),
          .minimum = -1e5,
          .maximum = 1e5,
          .meaning = std::move(meaning)};
}

KeyDescription required(KeyDescription key) {
  key.presence = Presence::kRequired;
  return key;
}

KeyDescription optional(KeyDescription key) {
  key.presence = Presence::kOptional;
  return key;
}

// A name that others see: a DDS key, a label in a report, part of a path.
TextRule published_name(std::size_t maximum_bytes) { return {1, maximum_bytes, true, "/"}; }

TableDescription daemon_table() {
  const PipelineSettings defaults;
  return {.name = "daemon",
          .meaning = "the daemon as a whole",
          .keys = {word("log_level", "info", {"trace", "debug", "info", "warning", "error", "critical"},
                        "the least important messages that are logged"),
                   real("rate_hz", defaults.rate_hz, "Hz", {1, 120}, "estimates a second, whatever happens"),
                   real("tick_grace_ms", defaults.tick_grace_ms, "ms", {0, 500},
                        "how long a slot waits for its image before the clock fills it")}};
}

TableDescription stage_table(std::string name, std::string meaning) {
  const double last_cpu = std::max(get_nprocs_conf(), 1) - 1;
  KeyDescription cpus{.name = "cpus",
                      .default_value = std::vector<std::int64_t>{},
                      .maximum_count = 1024,
                      .meaning = "CPUs it may run on, counted from 0; empty = all"};
  cpus.minimum = 0;
  cpus.maximum = last_cpu;
  return {.name = std::move(name),
          .meaning = std::move(meaning),
          .keys = {integer("priority", ThreadSettings{}.fifo_priority, "", {0, 99},
                           "SCHED_FIFO priority; 0 = leave the default scheduling"),
                   cpus}};
}

TableDescription realtime_table() {
  return {.name = "realtime",
          .meaning = "scheduling of the threads",
          .keys = {word("scheduling", "optional", {"optional", "required"},
                        "whether the daemon starts when the system refuses a priority or CPU set")},
          .tables = {stage_table("em_acquisition", "the thread that reads the EM tracker"),
                     stage_table("image_grab", "the threads that read the fluoroscope, one a camera"),
                     stage_table("frangi", "the threads that filter images, one a camera"),
                     stage_table("optimizer", "the thread that solves for the shapes"),
                     stage_table("publisher", "the thread that publishes")}};
}

TableDescription dds_table() {
  const DdsSettings defaults;
  return {
      .name = "dds",
      .meaning = "where subscribers find the estimates",
      .keys = {
          integer("domain", defaults.domain, "", {0, 230}, "DDS domain"),
          text("partition", defaults.partition, {0, 128, true, "*?[]"},
               "the room, as DDS partition; empty = the default partition"),
          text("network_interface", defaults.network_interface, {1, 64, true, " /<>&\"'"},
               "name or address of the interface; lo = nothing leaves this host"),
          text("world_frame", defaults.world_frame, {1, 64, true, ""}, "what the world frame is, in words"),
          word("world_axes", defaults.world_axes, {"as registered", "LPS", "RAS"},
               "the patient's directions along x, y, z of the world frame: left, posterior, superior; "
               "right, anterior, superior; or whatever the registration makes of them")}};
}

TableDescription shm_table() {
  const ShmSettings defaults;
  return {
      .name = "shm",
      .meaning = "estimates for software on the same machine, through shared memory, beside DDS",
      .keys = {
          text("estimates_socket", defaults.estimates_socket, {0, 107, true, ""},
               "path of the socket where readers get them, such as /run/tubed/estimates.sock; empty = none"),
          text("group", defaults.group, {0, 32, true, ""},
               "group whose members may read; empty = root and the daemon's user only")}};
}

TableDescription em_table(const std::vector<std::string>& driver_names) {
  const PipelineSettings defaults;
  return {
      .name = "em",
      .minimum_count = 1,
      .meaning = "the EM tracker",
      .keys = {required(word("driver", "", driver_names, "the driver of the EM tracker")),
               text("device", "", {}, "device of the driver, when it has one"),
               real("reconnect_first_ms", defaults.reconnect_first_ms, "ms", {10, 60000},
                    "back-off after a source is lost, doubled up to reconnect_last_ms; images too"),
               real("reconnect_last_ms", defaults.reconnect_last_ms, "ms", {10, 60000}, "longest back-off"),
               optional(matrix("T_world_em", "mm",
                               "registration p_world = T_world_em * p_em; left out = not registered")),
               optional(real("registration_residual_mm", 0, "mm", {0, 100},
                             "RMS residual of the registration; left out = not stated"))}};
}

TableDescription camera_table(const std::vector<std::string>& driver_names) {
  const Range focal_px{1, 1e6};
  const Range principal_px{-1e4, 1e4};
  KeyDescription distortion{.name = "distortion",
                            .default_value = std::vector<double>(5, 0.0),
                            .minimum = -1000,
                            .maximum = 1000,
                            .minimum_count = 5,
                            .maximum_count = 5,
                            .meaning = "k1 k2 p1 p2 k3, as OpenCV defines them"};
  return {
      .name = "camera",
      .shape = TableShape::kMany,
      .maximum_count = kMaxCameras,
      .meaning = "one view of the fluoroscope",
      .keys = {
          required(text("name", "", published_name(32), "name of the view, unique")),
          required(integer("width", 0, "px", {64, 2048}, "width of the image")),
          required(integer("height", 0, "px", {64, 2048}, "height of the image")),
          required(real("fx", 1, "px", focal_px, "focal length along x")),
          required(real("fy", 1, "px", focal_px, "focal length along y")),
          required(real("cx", 0, "px", principal_px, "principal point, x; the first pixel's centre is 0")),
          required(real("cy", 0, "px", principal_px, "principal point, y; the first pixel's centre is 0")),
          distortion,
          real("white_level", 0, "grey levels", {0, 65535},
               "of a saturated pixel, such as 4095 of a detector of 12 bits; 0 = learnt from the images"),
          required(matrix("T_camera_world", "mm",
                          "p_camera = T_camera_world * p_world; x right, y down, z depth")),
          required(word("driver", "", driver_names, "the driver of the images")),
          text("device", "", {}, "device of the driver, when it has one")}};
}

KeyDescription mode_key() {
  return word("mode", "filter", {"em", "paper", "joint", "filter"},
              "em: coils only; paper: as published, for comparison; joint: coils and images of one instant; "
              "filter: with what was known before");
}

TableDescription instrument_table() {
  const InstrumentDescription defaults;
  TableDescription coil{
      .name = "coil",
      .shape = TableShape::kMany,
      .minimum_count = 1,
      .maximum_count = kMaxTrackerCoils,
      .meaning = "one EM coil of this instrument, in order from the tip",
      .keys = {required(integer("sensor", 1, "", {1, kMaxTrackerCoils},
                                "which sensor of the tracker it is, counted from 1")),
               required(real("offset_from_tip_mm", 0, "mm", {0, 2000},
                             "where it sits, along the catheter from the tip")),
               boolean("flipped", false, "mounted the other way round: its z points away from the tip"),
               optional(integer("port", 1, "", {1, kMaxTrackerCoils},
                                "port of the tracker it is plugged in; a tracker with ports requires it")),
               optional(integer("channel", 0, "", {0, 1},
                                "which of the two coils of its plug it is; left out = 0")),
               optional(text("tool_serial", "3C4B0001", {1, 8, true, " "},
                             "serial number that the tool in this plug has to have, hexadecimal, as `tubectl "
                             "doctor --tracker` prints it; another tool is told and not tracked; left out = "
                             "any")),
               optional(text("tool_part_number", "610029", {1, 20, true},
                             "part number that the tool in this plug has to have; left out = any"))}};
  KeyDescription mode = optional(mode_key());
  mode.meaning = "mode of this instrument alone; left out = that of [estimator]";
  return {
      .name = "instrument",
      .shape = TableShape::kMany,
      .minimum_count = 1,
      .maximum_count = kMaxInstruments,
      .meaning = "one tracked catheter",
      .keys = {required(text("id", "", published_name(kInstrumentIdLength), "the DDS key, unique")),
               real("diameter_mm", defaults.diameter_mm, "mm", {0.3, 20}, "outer diameter; 7 Fr = 2.33 mm"),
               real("length_mm", defaults.length_mm, "mm", {10, 2000},
                    "from the tip, the part whose shape is asked for"),
               mode},
      .tables = {coil}};
}

TableDescription paper_table() {
  const PaperSettings d;
  return {.name = "paper",
          .meaning = "mode \"paper\" alone: where the equations need help to work, and how much they get",
          .keys = {integer("knot_point_count", d.knot_point_count, "", {4, 48}, "knot points of the tube"),
                   word("weights", "consistent", {"consistent", "printed"},
                        "of the terms of Eq. (14): by their variances, or all 1 as printed"),
                   real("sigma_length_mm", d.sigma_length_mm, "mm", {0.001, 50},
                        "standard deviation of the length between two coils"),
                   word("depth_lengths", "left_out", {"left_out", "printed"},
                        "the lengths of Eq. (12) in the depth-only step"),
                   word("mle_start", "lines", {"lines", "em"},
                        "where Eq. (18) begins: at the nearest ridge, or at the coils' own projection"),
                   word("mle_prior", "em_error", {"em_error", "none"},
                        "what holds the tube where no pixel does: the coils' error, or nothing"),
                   word("hub_end", "goes_on", {"goes_on", "capped"},
                        "whether the catheter goes on behind length_mm or the tube ends there"),
                   word("heaviside", "fixed", {"narrowing", "fixed"},
                        "epsilon of Eq. (17): wide first, or always heaviside_px"),
                   real("heaviside_px", d.heaviside_px, "px", {0.5, 20}, "epsilon of Eq. (17)"),
                   real("appearance_share", d.appearance_share, "", {0, 1},
                        "of a trusted image in the appearance of tube and background"),
                   integer("rounds", d.rounds, "", {1, 50}, "of image and depth in turn, at most")}};
}

TableDescription estimator_table() {
  const EstimatorSettings d;
  const Range age_ms{20, 5000};
  return {
      .name = "estimator",
      .meaning = "how the shape is estimated, for every instrument",
      .keys = {mode_key(),
               integer("coefficient_count", d.coefficient_count, "", {8, 48}, "coefficients of the B-spline"),
               real("sigma_position_mm", d.sigma_position_mm, "mm", {0.01, 50},
                    "standard deviation of a coil's position, an axis"),
               real("sigma_tangent", d.sigma_tangent, "", {0.0005, 1},
                    "standard deviation of a coil's unit tangent, an axis"),
               real("sigma_strain_sqrt_mm", d.sigma_strain_sqrt_mm, "sqrt(mm)", {1e-4, 1},
                    "standard deviation of the strain over 1 mm of arc length"),
               real("bending_q_per_mm", d.bending_q_per_mm, "1/mm", {1e-8, 1},
                    "expected squared curvature times mm"),
               word("image_likelihood", "vesselness", {"vesselness", "posterior", "band"},
                    "what speaks for the tube in an image: ridges; histograms of grey value and vesselness; "
                    "those over all pixels near it"),
               real("sigma_image_px", d.sigma_image_px, "px", {0.05, 20},
                    "standard deviation of a correspondence line's offset, beside its own"),
               real("image_search_px", d.image_search_px, "px", {2, 24},
                    "half length of the correspondence lines"),
               real("image_temper", d.image_temper, "", {1, 1000},
                    "the images' variance is multiplied by this: pixels are not independent"),
               real("em_stale_ms", d.em_stale_ms, "ms", age_ms,
                    "EM_STALE when two EM measurements in a row are missing, at the latest after this"),
               real("em_stuck_ms", d.em_stuck_ms, "ms", age_ms,
                    "bit-equal measurements for so long mean EM_STUCK"),
               real("image_stale_ms", PipelineSettings{}.image_stale_ms, "ms", age_ms,
                    "IMAGE_STALE after two image periods without one, at the latest after this"),
               integer("iterations", d.iterations, "", {1, 50}, "Gauss-Newton iterations, at most")},
      .tables = {paper_table()}};
}

TableDescription frangi_table() {
  const FrangiSettings d;
  KeyDescription scales{.name = "scales_px",
                        .default_value = d.scales_px,
                        .unit = "px",
                        .minimum = 0.5,
                        .maximum = 20,
                        .minimum_count = 1,
                        .maximum_count = kMostFrangiScales,
                        .meaning = "standard deviation of each Gaussian"};
  return {.name = "frangi",
          .meaning = "the filter that finds tubes in an image",
          .keys = {scales, real("beta", d.beta, "", {0.01, 10}, "how much blob-like structure is suppressed"),
                   real("structureness", d.structureness, "grey levels", {0, 65535},
                        "Frangi's c; 0 = half the greatest Hessian norm of the image"),
                   word("polarity", "dark", {"dark", "bright"}, "what a tube is on the image"),
                   word("smoothing", "float", {"float", "integer16"},
                        "arithmetic of the Gaussians up to 2.5 px; integer16: less time, more rounding"),
                   word("area", "band", {"band", "frame"},
                        "what is filtered before the shape is sought; band: around the tubes where they are "
                        "expected, and what is missing when it is needed; frame: all of every image")}};
}

KeyDescription from_driver(const SettingDescription& setting) {
  KeyDescription key{.name = setting.name,
                     .presence = setting.required ? Presence::kRequired : Presence::kDefault,
                     .unit = setting.unit,
                     .minimum = setting.minimum,
                     .maximum = setting.maximum,
                     .choices = setting.choices,
                     .meaning = setting.meaning};
  std::visit([&](const auto& value) { key.default_value = value; }, setting.default_value);
  if (setting.required) {
    key.text.minimum_bytes = 1;
  }
  return key;
}

TableDescription driver_table(const DriverDescription& driver) {
  TableDescription table{.name = driver.name, .meaning = driver.meaning, .only_when_used = true};
  for (const SettingDescription& setting : driver.settings) {
    table.keys.push_back(from_driver(setting));
  }
  return table;
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
    file.tables.push_back(driver_table(driver));
  }
  return file;
}

}  // namespace tubed
