#include "daemon/config/load_configuration.hpp"

#include <toml++/toml.h>

#include <cerrno>
#include <fstream>
#include <system_error>

#include "daemon/config/assemble.hpp"
#include "daemon/config/sha256.hpp"
#include "daemon/config/surroundings.hpp"
#include "drivers/interface/toml_nesting.hpp"
#include "idl/printable_text.hpp"

namespace tubed {

namespace {

// Far beyond any configuration; stops a device file or a wrong path from filling the memory.
constexpr std::size_t kMaxFileBytes = std::size_t{1} << 20U;

std::string read_text(const std::filesystem::path& file) {
  errno = 0;
  std::ifstream stream(file, std::ios::binary);
  std::string text(kMaxFileBytes + 1, '\0');
  if (stream) {
    stream.read(text.data(), static_cast<std::streamsize>(text.size()));
  }
  if (!stream.is_open() || stream.bad()) {
    const int error = errno == 0 ? EIO : errno;
    throw ConfigurationError(file.string(),
                             {{{}, "", "cannot be read: " + std::generic_category().message(error)}});
  }
  text.resize(static_cast<std::size_t>(stream.gcount()));
  if (text.size() > kMaxFileBytes) {
    throw ConfigurationError(file.string(), {{{}, "", "cannot be a configuration: larger than 1 MiB"}});
  }
  return text;
}

toml::table parse(std::string_view text, const std::string& file) {
  if (const auto line = line_of_too_many_dots(text)) {
    throw ConfigurationError(file, {{{static_cast<unsigned>(*line), 1},
                                     "",
                                     "cannot be a configuration: more than " + std::to_string(kMaxTomlDots) +
                                         " dots outside comments; tables lie too deep in each other"}});
  }
  try {
    return toml::parse(text);
  } catch (const toml::parse_error& error) {
    const toml::source_position at = error.source().begin;
    throw ConfigurationError(
        file, {{{at.line, at.column}, "", "not valid TOML: " + printable_text(error.description())}});
  }
}

const DriverDescription& chosen(const SourceChoice& choice, const std::vector<DriverDescription>& available) {
  const DriverDescription* driver = find_driver(available, choice.driver);
  if (driver == nullptr) {
    throw std::logic_error("the configuration was checked against other drivers");
  }
  return *driver;
}

SourceContext context_of(const Configuration& configuration, const SourceChoice& choice) {
  return {configuration.room, choice.settings, choice.device, configuration.file.parent_path()};
}

using FurtherChecks = decltype(&check_surroundings);

void no_further_checks(const CheckedTable& /*file*/, const std::filesystem::path& /*folder*/,
                       const std::vector<DriverDescription>& /*available*/, Problems& /*problems*/) {}

Configuration checked_configuration(std::string_view text, const std::filesystem::path& file,
                                    const std::vector<DriverDescription>& available,
                                    FurtherChecks further_checks) {
  const toml::table parsed = parse(text, file.string());
  Problems problems;
  const CheckedTable checked = check_file(parsed, configuration_schema(available), problems);
  Configuration configuration;
  configuration.file = file;
  configuration.digest = sha256_hex(text);
  read_keys(checked.one("daemon"), log_keys(), configuration);
  configuration.pipeline = pipeline_settings(checked, problems);
  configuration.dds = dds_settings(checked, file.parent_path());
  configuration.security_position = checked.one("dds").at("security").position;
  configuration.shm = shm_settings(checked, file.parent_path());
  configuration.frangi = frangi_settings(checked);
  configuration.room = room_description(checked, problems);
  configuration.c_arms = c_arms(checked);
  configuration.estimators = estimator_settings(checked, problems);
  configuration.em_source = source_choice(checked, checked.one("em"), available, problems);
  check_coil_ports(checked, available, problems);
  check_reference_driver(checked, available, problems);
  for (const CheckedTable& camera : checked.many("camera")) {
    configuration.image_sources.push_back(source_choice(checked, camera, available, problems));
  }
  deliver_cameras(checked, available, configuration, problems);
  further_checks(checked, file.parent_path(), available, problems);
  if (!problems.empty()) {
    throw ConfigurationError(file.string(), std::move(problems));
  }
  for (const ConfigurationProblem& warning : warnings(checked, available)) {
    configuration.warnings.push_back(to_line(file.string(), warning));
  }
  return configuration;
}

}  // namespace

Configuration load_configuration(const std::filesystem::path& file,
                                 const std::vector<DriverDescription>& available) {
  return checked_configuration(read_text(file), file, available, &check_surroundings);
}

Configuration parse_configuration(std::string_view text, const std::filesystem::path& file,
                                  const std::vector<DriverDescription>& available) {
  return checked_configuration(text, file, available, &no_further_checks);
}

std::unique_ptr<EmSource> make_em_source(const Configuration& configuration,
                                         const std::vector<DriverDescription>& available) {
  const SourceChoice& choice = configuration.em_source;
  return chosen(choice, available).make_em_source(context_of(configuration, choice));
}

std::unique_ptr<ImageSource> make_image_source(const Configuration& configuration, int camera,
                                               const std::vector<DriverDescription>& available) {
  const SourceChoice& choice = configuration.image_sources.at(static_cast<std::size_t>(camera));
  return chosen(choice, available).make_image_source(context_of(configuration, choice), camera);
}

}  // namespace tubed
