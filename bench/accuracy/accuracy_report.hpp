// The figures of a run of this bench for a person and for a program.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <ostream>
#include <string>
#include <vector>

#include "bench/accuracy/method.hpp"
#include "bench/accuracy/plots.hpp"
#include "clients/evaluation/evaluation_report.hpp"

namespace tubed {

/// Everything about one sequence; runs[i] is of methods[i].
struct SequenceResult {
  std::string name;
  std::vector<Method> methods;
  std::vector<MethodRun> runs;
  std::size_t due_count = 0;
  ShapeErrorSettings judged;
};

/// One line a method: the five metrics over all points and over those in view, the 95th percentile of the
/// RMS, share of VALID, coverage of sigma, time.
void print_methods(const SequenceResult& result, std::ostream& out);

/// Table 1 of two methods beside the paper's.
void print_pair(const SequenceResult& result, const ComparedPair& pair, JudgedPart part, std::ostream& out);

/// Rows "accuracy/<sequence>/<method>/<metric>" (all points) and "../<metric>/in_view".
nlohmann::json rows_of(const SequenceResult& result);

/// Comparisons of all pairs.
nlohmann::json comparisons_of(const SequenceResult& result);

/// Rows "accuracy/<sequence>/<method>/RMS/in_view/<varied>=<value>".
nlohmann::json rows_of(const std::string& sequence, const std::vector<SensitivityPanel>& panels);

/// {"git", "machine", "rows", "comparisons"}.
nlohmann::json whole_report(const std::string& command, nlohmann::json rows, nlohmann::json comparisons);

}  // namespace tubed
