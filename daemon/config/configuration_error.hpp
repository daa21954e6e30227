// What is wrong with a configuration file, and where.
#pragma once

#include <stdexcept>
#include <string>
#include <vector>

namespace tubed {

/// A place in the file, counted from 1; columns count characters, not bytes.
struct FilePosition {
  unsigned line = 1;
  unsigned column = 1;
};

/// One thing that is wrong, or worth a warning.
struct ConfigurationProblem {
  FilePosition position;
  std::string key;  ///< dotted, arrays count from 0: "camera[1].fx"; empty when the file as a whole is meant
  std::string message;  ///< what was expected, what was found, what was perhaps meant
};

/// "FILE:LINE:COLUMN: KEY: MESSAGE", the form editors and compilers' users know.
std::string to_line(const std::string& file, const ConfigurationProblem& problem);

/// The configuration cannot be used. what() has one line a problem, in the order of the file.
class ConfigurationError : public std::runtime_error {
 public:
  /// `problems`: at least one; sorted here by position.
  ConfigurationError(const std::string& file, std::vector<ConfigurationProblem> problems);

  [[nodiscard]] const std::vector<ConfigurationProblem>& problems() const { return problems_; }

 private:
  std::vector<ConfigurationProblem> problems_;
};

}  // namespace tubed
