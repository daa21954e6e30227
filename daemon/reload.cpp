#include "daemon/reload.hpp"

#include <fstream>
#include <sstream>

#include "daemon/config/changed_keys.hpp"
#include "daemon/config/load_configuration.hpp"
#include "daemon/config/sha256.hpp"

namespace tubed {

namespace {

constexpr std::string_view kLiveKey = "daemon.log_level";

std::string text_of(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

}  // namespace

ReloadableConfiguration::ReloadableConfiguration(const Configuration& running)
    : file_(running.file), log_level_(running.log_level), running_text_(text_of(running.file)) {
  if (sha256_hex(running_text_) != running.digest) {
    running_text_.clear();
  }
}

ReloadOutcome ReloadableConfiguration::reload() {
  ReloadOutcome outcome{false, log_level_, {}};
  try {
    const Configuration checked = load_configuration(file_);
    const std::string text = text_of(file_);
    outcome.log_level = log_level_ = checked.log_level;
    outcome.notices = checked.warnings;
    for (const std::string& key : changed_keys(running_text_, text)) {
      if (key != kLiveKey) {
        outcome.notices.push_back(key + " differs from what runs: takes effect with a restart");
      }
    }
    outcome.is_taken = true;
  } catch (const std::exception& error) {
    outcome.notices = {std::string(error.what()), "the configuration that runs is kept"};
  }
  return outcome;
}

}  // namespace tubed
