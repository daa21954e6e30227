// Command lines as programs and their verbs state them. CLI11 parses; it is compiled in command_line.cpp
// alone, because its headers take longer to compile than most of what includes this.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace tubed {

/// One option, flag or positional argument of a verb; valid as long as the command line is. Every call
/// returns the argument itself.
class Argument {
 public:
  explicit Argument(CLI::Option& option) : option_(&option) {}

  Argument& required();
  /// The help names the variable's present value as the default, or `words`.
  Argument& capture_default_str();
  Argument& default_str(const std::string& words);
  /// The heading in the help.
  Argument& group(const std::string& heading);
  Argument& needs(const Argument& other);
  Argument& excludes(const Argument& other);
  /// So many values: as many of them at least and at most.
  Argument& expected(int min, int max);
  /// A list in one word: "a,b".
  Argument& delimiter(char separator);

  // What a value has to be; anything else is refused before the verb runs.
  Argument& in_range(int min, int max);
  Argument& in_range(std::int64_t min, std::int64_t max);
  Argument& in_range(double min, double max);
  /// The same with the unit in the words that refuse, and no NaN.
  Argument& in_range(double min, double max, const std::string& unit);
  Argument& positive();
  Argument& is_member(const std::vector<std::string>& words);
  Argument& existing_directory();

  /// Once the command line has been parsed.
  [[nodiscard]] bool was_given() const;

 private:
  CLI::Option* option_;
};

/// The program's command line, or one verb of it; valid as long as its Program is.
class CommandLine {
 public:
  explicit CommandLine(CLI::App& app) : app_(&app) {}

  CommandLine add_subcommand(const std::string& name, const std::string& description);
  /// `value` outlives the command line, and keeps what it is unless the option is given. Of the types that
  /// command_line.cpp lists at its end; others are a link error.
  template <typename Value>
  Argument add_option(const std::string& name, Value& value, const std::string& description);
  Argument add_flag(const std::string& name, bool& value, const std::string& description);
  /// Exactly one of the subcommands has to be named.
  CommandLine& require_subcommand();
  /// Runs when the verb was named and everything was parsed.
  CommandLine& callback(std::function<void()> run);
  /// The heading in the list of verbs.
  CommandLine& group(const std::string& heading);
  CommandLine& footer(const std::string& text);
  /// Where the help's explanations begin, in columns.
  CommandLine& help_column(std::size_t column);

 private:
  CLI::App* app_;
};

/// A whole program's command line.
class Program {
 public:
  explicit Program(const std::string& description, const std::string& name = "");
  ~Program();
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  CommandLine command_line() { return CommandLine(*app_); }
  /// `--version` prints `words`.
  void set_version(const std::string& words);

  /// Reads main()'s arguments and runs the verb among them. Returns the code to end with: 0 after --help or
  /// --version, kExitOfUsage after words of CLI11 on standard error; nothing: the program goes on. What a
  /// verb throws comes through.
  [[nodiscard]] std::optional<int> parse(int argc, const char* const* argv);
  /// The same for words in their order, without the program's name. Throws CLI::ParseError.
  void parse(std::vector<std::string> words);

  static constexpr int kExitOfUsage = 64;

 private:
  std::unique_ptr<CLI::App> app_;
};

/// For a callback: the options do not go together. The program ends with kExitUsage and these words.
[[noreturn]] void refuse_usage(const std::string& verb, const std::string& words);

}  // namespace tubed
