#include "idl/command_line/command_line.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <optional>
#include <utility>

namespace tubed {

Argument& Argument::required() {
  option_->required();
  return *this;
}

Argument& Argument::capture_default_str() {
  option_->capture_default_str();
  return *this;
}

Argument& Argument::default_str(const std::string& words) {
  option_->default_str(words);
  return *this;
}

Argument& Argument::group(const std::string& heading) {
  option_->group(heading);
  return *this;
}

Argument& Argument::needs(const Argument& other) {
  option_->needs(other.option_);
  return *this;
}

Argument& Argument::excludes(const Argument& other) {
  option_->excludes(other.option_);
  return *this;
}

Argument& Argument::expected(int min, int max) {
  option_->expected(min, max);
  return *this;
}

Argument& Argument::delimiter(char separator) {
  option_->delimiter(separator);
  return *this;
}

Argument& Argument::in_range(int min, int max) {
  option_->check(CLI::Range(min, max));
  return *this;
}

Argument& Argument::in_range(std::int64_t min, std::int64_t max) {
  option_->check(CLI::Range(min, max));
  return *this;
}

Argument& Argument::in_range(double min, double max) {
  option_->check(CLI::Range(min, max));
  return *this;
}

Argument& Argument::positive() {
  option_->check(CLI::PositiveNumber);
  return *this;
}

Argument& Argument::is_member(const std::vector<std::string>& words) {
  option_->check(CLI::IsMember(words));
  return *this;
}

Argument& Argument::existing_directory() {
  option_->check(CLI::ExistingDirectory);
  return *this;
}

bool Argument::was_given() const { return option_->count() > 0; }

CommandLine CommandLine::add_subcommand(const std::string& name, const std::string& description) {
  return CommandLine(*app_->add_subcommand(name, description));
}

template <typename Value>
Argument CommandLine::add_option(const std::string& name, Value& value, const std::string& description) {
  return Argument(*app_->add_option(name, value, description));
}

Argument CommandLine::add_flag(const std::string& name, bool& value, const std::string& description) {
  return Argument(*app_->add_flag(name, value, description));
}

CommandLine& CommandLine::require_subcommand() {
  app_->require_subcommand(1);
  return *this;
}

CommandLine& CommandLine::callback(std::function<void()> run) {
  app_->callback(std::move(run));
  return *this;
}

CommandLine& CommandLine::group(const std::string& heading) {
  app_->group(heading);
  return *this;
}

CommandLine& CommandLine::footer(const std::string& text) {
  app_->footer(text);
  return *this;
}

CommandLine& CommandLine::help_column(std::size_t column) {
  app_->get_formatter()->column_width(column);
  return *this;
}

Program::Program(const std::string& description, const std::string& name)
    : app_(std::make_unique<CLI::App>(description, name)) {}

Program::~Program() = default;

void Program::set_version(const std::string& words) {
  app_->set_version_flag("--version", words, "Print the version and leave");
}

std::optional<int> Program::parse(int argc, const char* const* argv) {
  try {
    app_->parse(argc, argv);
    return {};
  } catch (const CLI::ParseError& error) {
    return app_->exit(error) == 0 ? 0 : kExitOfUsage;
  }
}

void Program::parse(std::vector<std::string> words) {
  std::reverse(words.begin(), words.end());  // CLI11 takes them last first
  app_->parse(words);
}

void refuse_usage(const std::string& verb, const std::string& words) {
  throw CLI::ValidationError(verb, words);
}

template Argument CommandLine::add_option(const std::string&, int&, const std::string&);
template Argument CommandLine::add_option(const std::string&, std::int64_t&, const std::string&);
template Argument CommandLine::add_option(const std::string&, std::uint32_t&, const std::string&);
template Argument CommandLine::add_option(const std::string&, std::uint64_t&, const std::string&);
template Argument CommandLine::add_option(const std::string&, double&, const std::string&);
template Argument CommandLine::add_option(const std::string&, std::string&, const std::string&);
template Argument CommandLine::add_option(const std::string&, std::filesystem::path&, const std::string&);
template Argument CommandLine::add_option(const std::string&, std::optional<int>&, const std::string&);
template Argument CommandLine::add_option(const std::string&, std::optional<double>&, const std::string&);
template Argument CommandLine::add_option(const std::string&, std::optional<std::string>&,
                                          const std::string&);
template Argument CommandLine::add_option(const std::string&, std::vector<int>&, const std::string&);
template Argument CommandLine::add_option(const std::string&, std::vector<double>&, const std::string&);
template Argument CommandLine::add_option(const std::string&, std::vector<std::string>&, const std::string&);

}  // namespace tubed
