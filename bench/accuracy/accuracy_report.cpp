#include "bench/accuracy/accuracy_report.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "bench/support/machine.hpp"
#include "clients/evaluation/statistics.hpp"

namespace tubed {

namespace {

template <typename... Values>
std::string formatted(const char* format, Values... values) {
  std::array<char, 256> text{};
  std::snprintf(text.data(), text.size(), format, values...);
  return text.data();
}

std::string metrics_of(const MethodEvaluation& evaluation) {
  if (evaluation.judged_count() == 0) return "  nothing judged";
  std::string cells;
  for (const Metric& metric : kMetrics) {
    const MedianAndIqr value = median_and_iqr(evaluation.values_mm(metric));
    cells += formatted("  %5.2f |%5.2f", value.median, value.iqr);
  }
  return cells + formatted("  %5.2f", quantile(evaluation.values_mm(kMetrics[1]), 0.95));
}

double valid_percent(const MethodEvaluation& evaluation, std::size_t due_count) {
  const auto valid = evaluation.validity_counts.find(Validity::kValid);
  return valid == evaluation.validity_counts.end()
             ? 0
             : 100 * static_cast<double>(valid->second) /
                   static_cast<double>(std::max<std::size_t>(due_count, 1));
}

std::string coverage_of(const MethodEvaluation& evaluation) {
  if (evaluation.coverage.coordinate_count == 0) return "-";
  return formatted("%.0f/%.0f/%.0f", 100 * evaluation.coverage.share(1), 100 * evaluation.coverage.share(2),
                   100 * evaluation.coverage.share(3));
}

EvaluationReport report_of(const SequenceResult& result, const ComparedPair& pair, JudgedPart part) {
  const auto of = [&](std::size_t i) {
    return part == JudgedPart::kInView ? result.runs[i].in_view : result.runs[i].all;
  };
  EvaluationReport report{result.name, result.due_count, result.judged, of(pair.em), of(pair.fused), {}};
  report.settings.part = part;
  report.comparison = compare(*report.em, *report.fused);
  return report;
}

nlohmann::json row(const std::string& name, const std::string& unit, const std::vector<double>& values) {
  return {{"name", name},
          {"unit", unit},
          {"n", values.size()},
          {"min", quantile(values, 0)},
          {"p50", quantile(values, 0.5)},
          {"p90", quantile(values, 0.9)},
          {"p95", quantile(values, 0.95)},
          {"p99", quantile(values, 0.99)},
          {"iqr", quantile(values, 0.75) - quantile(values, 0.25)}};
}

}  // namespace

void print_methods(const SequenceResult& result, std::ostream& out) {
  out << result.name << ": " << result.due_count << " instants, s = 0 .. " << result.judged.s_max_mm
      << " mm, match " << name_of(result.judged.match) << "; mm, median | IQR over instants\n";
  const std::string heading =
      "      Hausdorff           RMS         x RMS         y RMS         z RMS  RMS95";
  for (const JudgedPart part : {JudgedPart::kAll, JudgedPart::kInView}) {
    out << formatted("%-11s", part == JudgedPart::kAll ? "all points" : "in view") << heading.substr(3)
        << (part == JudgedPart::kAll ? "  VALID %  in 1/2/3 sigma  ms\n" : "\n");
    for (std::size_t i = 0; i < result.methods.size(); ++i) {
      const MethodEvaluation& shown = part == JudgedPart::kAll ? result.runs[i].all : result.runs[i].in_view;
      out << formatted("%-10s", result.methods[i].name.c_str()) << metrics_of(shown);
      if (part == JudgedPart::kAll) {
        out << formatted("  %7.1f  %14s  %.1f", valid_percent(shown, result.due_count),
                         coverage_of(shown).c_str(), quantile(result.runs[i].solve_ms, 0.5));
      }
      out << '\n';
    }
  }
  out << '\n';
}

void print_pair(const SequenceResult& result, const ComparedPair& pair, JudgedPart part, std::ostream& out) {
  out << "EM = " << result.methods[pair.em].name << ", EM + fluoro = " << result.methods[pair.fused].name
      << '\n';
  print_report(report_of(result, pair, part), out);
  out << '\n';
}

nlohmann::json rows_of(const SequenceResult& result) {
  nlohmann::json rows = nlohmann::json::array();
  for (std::size_t i = 0; i < result.methods.size(); ++i) {
    const std::string prefix = "accuracy/" + result.name + "/" + result.methods[i].name + "/";
    for (const Metric& metric : kMetrics) {
      const std::string name = prefix + std::string(metric.name);
      if (result.runs[i].all.judged_count() > 0) {
        rows.push_back(row(name, "mm", result.runs[i].all.values_mm(metric)));
      }
      if (result.runs[i].in_view.judged_count() > 0) {
        rows.push_back(row(name + "/in_view", "mm", result.runs[i].in_view.values_mm(metric)));
      }
    }
    rows.push_back(row(prefix + "time", "ms", result.runs[i].solve_ms));
    const SigmaCoverage& coverage = result.runs[i].all.coverage;
    if (coverage.coordinate_count > 0) {
      rows.push_back({{"name", prefix + "within_sigma"},
                      {"unit", "share of coordinates within 1, 2, 3 sigma"},
                      {"n", coverage.coordinate_count},
                      {"values", {coverage.share(1), coverage.share(2), coverage.share(3)}}});
    }
  }
  return rows;
}

nlohmann::json comparisons_of(const SequenceResult& result) {
  nlohmann::json comparisons = nlohmann::json::array();
  for (const ComparedPair& pair : pairs_among(result.methods)) {
    for (const JudgedPart part : {JudgedPart::kAll, JudgedPart::kInView}) {
      nlohmann::json comparison = to_json(report_of(result, pair, part));
      comparison["em_method"] = result.methods[pair.em].name;
      comparison["fused_method"] = result.methods[pair.fused].name;
      comparisons.push_back(comparison);
    }
  }
  return comparisons;
}

nlohmann::json rows_of(const std::string& sequence, const std::vector<SensitivityPanel>& panels) {
  nlohmann::json rows = nlohmann::json::array();
  for (const SensitivityPanel& panel : panels) {
    for (const SensitivityCurve& curve : panel.curves) {
      for (std::size_t i = 0; i < curve.values.size(); ++i) {
        rows.push_back({{"name", "accuracy/" + sequence + "/" + curve.name + "/RMS/in_view/" + panel.varied +
                                     "=" + formatted("%g", curve.values[i])},
                        {"unit", "mm"},
                        {"p50", curve.error_mm[i]},
                        {"tip_within_3_sigma", curve.tip_told[i]}});
      }
    }
  }
  return rows;
}

nlohmann::json whole_report(const std::string& command, nlohmann::json rows, nlohmann::json comparisons) {
  const Machine machine = this_machine();
  return {{"git", source_revision()},
          {"machine",
           {{"cpu", machine.cpu},
            {"cores", machine.cores},
            {"kernel", machine.kernel},
            {"flags", machine.flags},
            {"load", machine.load}}},
          {"command", command},
          {"rows", std::move(rows)},
          {"comparisons", std::move(comparisons)}};
}

}  // namespace tubed
