#include "idl/command_line/command_line.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <iostream>
#include <optional>
#include <sstream>
#include <utility>

#include "idl/settings/near_miss.hpp"

namespace tubed {

namespace {

/// The verb that a word is in place of, where there is none of that name.
struct UnknownVerb {
  std::string word;
  std::vector<std::string> verbs;  ///< that could stand there
  std::string command;             ///< what stands before it: "tubectl calibrate"
};

/// CLI11 says only that a verb is missing.
std::optional<UnknownVerb> unknown_verb(const CLI::App& program, int argc, const char* const* argv) {
  const CLI::App* app = &program;
  std::string command = program.get_name();
  for (int i = 1; i < argc && app->get_require_subcommand_min() > 0; ++i) {
    const std::string word = argv[i];
    if (word.starts_with("-")) {
      return {};
    }
    std::vector<std::string> verbs;
    const CLI::App* next = nullptr;
    for (const CLI::App* verb : app->get_subcommands([](const CLI::App*) { return true; })) {
      verbs.push_back(verb->get_name());
      next = verb->get_name() == word ? verb : next;
    }
    if (next == nullptr) {
      return UnknownVerb{word, std::move(verbs), command};
    }
    app = next;
    command += " " + word;
  }
  return {};
}

void refuse(const UnknownVerb& unknown) {
  const auto near = near_miss(unknown.word, unknown.verbs);
  std::cerr << unknown.command << ": there is no '" << unknown.word << "'"
            << (near ? "; did you mean '" + *near + "'? `" : std::string("; `")) << unknown.command
            << " --help` lists what there is.\n";
}

/// The verb that was named last.
const CLI::App& named_verb(const CLI::App& app) {
  const std::vector<CLI::App*> named = app.get_subcommands();
  return named.empty() ? app : named_verb(*named.front());
}

/// For options that no verb has: which one was meant, perhaps.
void offer_near_options(const CLI::App& program) {
  std::vector<std::string> options;
  const CLI::App& verb = named_verb(program);
  for (const CLI::Option* option : verb.get_options()) {
    for (const std::string& name : option->get_lnames()) {
      options.push_back("--" + name);
    }
  }
  for (const std::string& word : program.remaining(true)) {
    const auto near = near_miss(word.substr(0, word.find('=')), options);
    if (word.starts_with("--") && near) {
      std::cerr << "Did you mean " << *near << " instead of " << word << "?\n";
    }
  }
}

}  // namespace

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

Argument& Argument::in_range(double min, double max, const std::string& unit) {
  std::ostringstream range;
  range << min << " to " << max << ' ' << unit;
  const auto complaint = [min, max, words = range.str()](const std::string& text) {
    double value = 0;
    const bool is_in = CLI::detail::lexical_cast(text, value) && value >= min && value <= max;
    return is_in ? std::string() : "expected " + words + ", found " + text;
  };
  option_->check(complaint, range.str());
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
  if (const auto unknown = unknown_verb(*app_, argc, argv)) {
    refuse(*unknown);
    return kExitOfUsage;
  }
  try {
    app_->parse(argc, argv);
    return {};
  } catch (const CLI::Success& help) {
    return app_->exit(help);
  } catch (const CLI::ParseError& error) {
    offer_near_options(*app_);  // what is said to be missing may be there, misspelt
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
