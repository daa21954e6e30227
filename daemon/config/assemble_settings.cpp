#include <algorithm>
#include <string>

#include "daemon/config/assemble.hpp"

namespace tubed {

namespace {

void check_grace(const CheckedTable& daemon, const PipelineSettings& settings, Problems& problems) {
  const double period_ms = 1000 / settings.rate_hz;
  if (daemon.sound("rate_hz") && daemon.sound("tick_grace_ms") && settings.tick_grace_ms >= period_ms) {
    problems.push_back({daemon.at("tick_grace_ms").position, "daemon.tick_grace_ms",
                        "expected less than the period of daemon.rate_hz, " + std::to_string(period_ms) +
                            " ms, found " + to_toml(settings.tick_grace_ms)});
  }
}

void check_back_off(const CheckedTable& em, const PipelineSettings& settings, Problems& problems) {
  if (em.sound("reconnect_first_ms") && em.sound("reconnect_last_ms") &&
      settings.reconnect_last_ms < settings.reconnect_first_ms) {
    problems.push_back({em.at("reconnect_last_ms").position, "em.reconnect_last_ms",
                        "expected at least em.reconnect_first_ms, " + to_toml(settings.reconnect_first_ms) +
                            " ms, found " + to_toml(settings.reconnect_last_ms)});
  }
}

void check_mode(const CheckedTable& file, const CheckedTable& decides, EstimatorMode mode,
                Problems& problems) {
  if (row_of(mode).needs_camera && file.many("camera").empty() && decides.sound("mode")) {
    problems.push_back({decides.at("mode").position, decides.path_of("mode"),
                        "\"" + std::string(name_of(mode)) +
                            "\" needs at least one [[camera]]; use \"em\" or \"filter\" without"});
  }
}

// A path of the file, which is relative to the file's folder; empty stays empty.
std::string below(const std::filesystem::path& folder, const std::string& path) {
  return path.empty() ? "" : (folder / path).lexically_normal().string();
}

}  // namespace

PipelineSettings pipeline_settings(const CheckedTable& file, Problems& problems) {
  const CheckedTable& daemon = file.one("daemon");
  const CheckedTable& realtime = file.one("realtime");
  const CheckedTable& em = file.one("em");
  const CheckedTable& estimator = file.one("estimator");
  PipelineSettings settings;
  read_keys(daemon, rate_keys(), settings);
  read_keys(em, back_off_keys(), settings);
  read_keys(estimator, image_timeout_keys(), settings);
  settings.em_stale_ms = estimator.get<double>("em_stale_ms");
  read_keys(realtime, scheduling_keys(), settings);
  for (const StageTable& stage : kStageTables) {
    read_keys(realtime.one(stage.name), thread_keys(0), settings.*stage.stage);
  }
  check_grace(daemon, settings, problems);
  check_back_off(em, settings, problems);
  return settings;
}

DdsSettings dds_settings(const CheckedTable& file, const std::filesystem::path& folder) {
  DdsSettings settings;
  read_keys(file.one("dds"), dds_keys(), settings);
  settings.security = below(folder, settings.security);
  return settings;
}

ShmSettings shm_settings(const CheckedTable& file, const std::filesystem::path& folder) {
  ShmSettings settings;
  read_keys(file.one("shm"), shm_keys(), settings);
  settings.estimates_socket = below(folder, settings.estimates_socket);
  settings.preview_folder = below(folder, settings.preview_folder);
  return settings;
}

FrangiSettings frangi_settings(const CheckedTable& file) {
  FrangiSettings settings;
  read_keys(file.one("frangi"), frangi_keys(), settings);
  return settings;
}

std::vector<EstimatorSettings> estimator_settings(const CheckedTable& file, Problems& problems) {
  const CheckedTable& table = file.one("estimator");
  EstimatorSettings common;
  read_keys(table, estimator_keys(), common);
  read_keys(table.one("paper"), paper_keys(), common.paper);
  std::vector<EstimatorSettings> estimators;
  bool common_mode_used = false;
  for (const CheckedTable& instrument : file.many("instrument")) {
    const bool own_mode = instrument.has("mode");
    EstimatorSettings settings = common;
    read_keys(own_mode ? instrument : table, {mode_key()}, settings);
    if (own_mode || !common_mode_used) {
      check_mode(file, own_mode ? instrument : table, settings.mode, problems);
    }
    common_mode_used = common_mode_used || !own_mode;
    estimators.push_back(settings);
  }
  return estimators;
}

}  // namespace tubed
