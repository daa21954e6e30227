#include "daemon/reload.hpp"

#include <fstream>
#include <sstream>

#include "daemon/config/changed_keys.hpp"
#include "daemon/config/load_configuration.hpp"
#include "daemon/config/schema.hpp"
#include "daemon/config/sha256.hpp"

namespace tubed {

namespace {

std::string text_of(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

std::vector<std::string> names_of(const std::vector<CameraCalibration>& cameras) {
  std::vector<std::string> names;
  for (const CameraCalibration& camera : cameras) names.push_back(camera.name);
  return names;
}

std::vector<ViewGeometry> views_of(const std::vector<CameraCalibration>& cameras) {
  std::vector<ViewGeometry> views;
  for (const CameraCalibration& camera : cameras) views.push_back(geometry_of(camera));
  return views;
}

bool is_of_a_camera(const std::string& key) { return key.rfind("camera[", 0) == 0; }

}  // namespace

ReloadableConfiguration::ReloadableConfiguration(const Configuration& running)
    : file_(running.file),
      log_level_(running.log_level),
      running_text_(text_of(running.file)),
      camera_names_(names_of(running.room.cameras)),
      views_(views_of(running.room.cameras)) {
  if (sha256_hex(running_text_) != running.digest) {
    running_text_.clear();
  }
}

ReloadOutcome ReloadableConfiguration::reload() {
  ReloadOutcome outcome{false, log_level_, {}, {}};
  try {
    const Configuration checked = load_configuration(file_);
    const std::string text = text_of(file_);
    outcome.log_level = log_level_ = checked.log_level;
    outcome.notices = checked.warnings;
    const TableDescription described = configuration_schema(drivers());
    const bool same_cameras = names_of(checked.room.cameras) == camera_names_;
    if (same_cameras && views_of(checked.room.cameras) != views_) {
      outcome.views = views_ = views_of(checked.room.cameras);
    }
    for (const std::string& key : changed_keys(running_text_, text)) {
      if (!takes_effect_at_once(described, key) || (is_of_a_camera(key) && !same_cameras)) {
        outcome.notices.push_back(key + " differs from what runs: takes effect with a restart");
      }
    }
    outcome.is_taken = true;
  } catch (const ConfigurationError& error) {
    for (const ConfigurationProblem& problem : error.problems()) {
      outcome.notices.push_back(to_line(file_.string(), problem));
    }
    outcome.notices.emplace_back("the configuration that runs is kept");
  } catch (const std::exception& error) {
    outcome.notices = {std::string(error.what()), "the configuration that runs is kept"};
  }
  return outcome;
}

}  // namespace tubed
