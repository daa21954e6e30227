// An evaluation for a person (the layout of the paper's Table 1) and for a program (JSON).
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <ostream>
#include <string>

#include "clients/evaluation/evaluation.hpp"

namespace tubed {

/// What was evaluated and how. A method that was not given is empty.
struct EvaluationReport {
  std::string sequence;
  std::size_t due_count = 0;  ///< instants at which an estimate is due
  ShapeErrorSettings settings;
  std::optional<MethodEvaluation> em;
  std::optional<MethodEvaluation> fused;
  std::optional<Comparison> comparison;  ///< of em and fused
};

/// Table, the paper's own numbers beside it, normality, frames, validity, coverage of sigma.
void print_report(const EvaluationReport& report, std::ostream& out);

/// The same figures; what is not a number is null.
nlohmann::json to_json(const EvaluationReport& report);

}  // namespace tubed
