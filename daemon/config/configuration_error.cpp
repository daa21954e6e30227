#include "daemon/config/configuration_error.hpp"

#include <algorithm>
#include <tuple>
#include <utility>

#include "idl/printable_text.hpp"

namespace tubed {

namespace {

std::vector<ConfigurationProblem> in_file_order(std::vector<ConfigurationProblem> problems) {
  std::stable_sort(problems.begin(), problems.end(), [](const auto& a, const auto& b) {
    return std::tie(a.position.line, a.position.column) < std::tie(b.position.line, b.position.column);
  });
  return problems;
}

std::string all_lines(const std::string& file, const std::vector<ConfigurationProblem>& problems) {
  std::string lines;
  for (const ConfigurationProblem& problem : problems) {
    lines += (lines.empty() ? "" : "\n") + to_line(file, problem);
  }
  return lines;
}

}  // namespace

std::string to_line(const std::string& file, const ConfigurationProblem& problem) {
  return printable_text(file) + ":" + std::to_string(problem.position.line) + ":" +
         std::to_string(problem.position.column) + ": " + (problem.key.empty() ? "" : problem.key + ": ") +
         problem.message;
}

ConfigurationError::ConfigurationError(const std::string& file, std::vector<ConfigurationProblem> problems)
    : std::runtime_error(all_lines(file, in_file_order(problems))),
      problems_(in_file_order(std::move(problems))) {}

}  // namespace tubed
