#include "bench/accuracy/bench_report.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <nlohmann/json.hpp>
#include <numeric>
#include <optional>
#include <string_view>

#include "clients/evaluation/statistics.hpp"

namespace tubed {

namespace {

/// A row of the right half of Table 1, the experiment, "?" where our copy of it is not legible; effect sizes
/// are those of its text as well.
struct PaperRow {
  std::string_view em;
  std::string_view fused;
  std::string_view p;
  std::string_view effect;
};
constexpr std::array<PaperRow, kMetrics.size()> kPaper{{{"?", "?", "?", "0.87"},
                                                        {"4.7", "3.7", "0.31", "1"},
                                                        {"2.1", "0.6", "0.31", "1"},
                                                        {"1.6", "1.0", "0.31", "1"},
                                                        {"?", "?", "?", "?"}}};

template <typename... Values>
std::string formatted(const char* format, Values... values) {
  std::array<char, 256> text{};
  std::snprintf(text.data(), text.size(), format, values...);
  return text.data();
}

using OfDraw = std::function<double(const BenchDraw&)>;

std::vector<double> over_draws(const std::vector<BenchDraw>& draws, const OfDraw& of_draw) {
  std::vector<double> values;
  for (const BenchDraw& draw : draws) values.push_back(of_draw(draw));
  return values;
}

std::string spread(const std::vector<double>& values) {
  return formatted("%.2f (%.2f to %.2f)", quantile(values, 0.5), quantile(values, 0), quantile(values, 1));
}

double mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

double deviation(const std::vector<double>& values) {
  const double middle = mean(values);
  double squares = 0;
  for (const double value : values) squares += (value - middle) * (value - middle);
  return std::sqrt(squares / static_cast<double>(values.size() - 1));
}

double root_mean_square(const std::vector<double>& values) {
  return std::sqrt(std::inner_product(values.begin(), values.end(), values.begin(), 0.0) /
                   static_cast<double>(values.size()));
}

double greatest(const std::vector<double>& values) { return *std::max_element(values.begin(), values.end()); }

/// What was drawn, by name, of each draw.
struct Drawn {
  std::string name;
  std::string meaning;
  std::string_view paper;
  OfDraw of_draw;
};
const std::vector<Drawn>& drawn() {
  static const std::vector<Drawn> all{
      {"markers/mean", "residual of 13 markers: mean", "1.81",
       [](const BenchDraw& draw) { return mean(draw.marker_residual_mm); }},
      {"markers/deviation", ".. standard deviation", "0.78",
       [](const BenchDraw& draw) { return deviation(draw.marker_residual_mm); }},
      {"markers/greatest", ".. greatest", "3.64",
       [](const BenchDraw& draw) { return greatest(draw.marker_residual_mm); }},
      {"coils/registration", "registration off at the coils, RMS", "?",
       [](const BenchDraw& draw) { return root_mean_square(draw.registration_mm); }},
      {"coils/all", "coils off, field and registration, RMS", "?",
       [](const BenchDraw& draw) { return root_mean_square(draw.coil_mm); }},
      {"truth", "segmented truth off the simulated centreline, RMS", "?",
       [](const BenchDraw& draw) { return root_mean_square(draw.truth_rms_mm); }}};
  return all;
}

/// Of each draw the median over the positions.
std::vector<double> medians(const std::vector<BenchDraw>& draws, std::size_t method, const Metric& metric) {
  return over_draws(
      draws, [&](const BenchDraw& draw) { return quantile(draw.methods[method].values_mm(metric), 0.5); });
}

void print_drawn(const std::vector<BenchDraw>& draws, std::ostream& out) {
  out << "| drawn, mm | median of the draws (least to greatest) | the paper |\n|---|---|---|\n";
  for (const Drawn& quantity : drawn()) {
    out << "| " << quantity.meaning << " | " << spread(over_draws(draws, quantity.of_draw)) << " | "
        << quantity.paper << " |\n";
  }
}

void print_errors(const std::vector<BenchDraw>& draws, const std::vector<Method>& methods,
                  std::ostream& out) {
  std::string rule = "|---|";
  out << "| mm |";
  for (const Method& method : methods) {
    out << " `" << method.name << "` |";
    rule += "---|";
  }
  out << " the paper: EM | EM + fluoroscopy |\n" << rule << "---|---|\n";
  for (std::size_t i = 0; i < kMetrics.size(); ++i) {
    out << "| " << kMetrics[i].name << " |";
    for (std::size_t method = 0; method < methods.size(); ++method) {
      out << ' ' << spread(medians(draws, method, kMetrics[i])) << " |";
    }
    out << ' ' << kPaper[i].em << " | " << kPaper[i].fused << " |\n";
  }
}

void print_pair(const std::vector<BenchDraw>& draws, const std::vector<Method>& methods,
                const ComparedPair& pair, std::ostream& out) {
  const bool is_the_papers = methods[pair.fused].settings.mode == methods[pair.em].settings.mode;
  for (std::size_t i = 0; i < kMetrics.size(); ++i) {
    std::vector<double> p;
    std::vector<double> effect;
    std::vector<double> improvement;
    for (const BenchDraw& draw : draws) {
      const auto comparison = compare(draw.methods[pair.em], draw.methods[pair.fused]);
      if (!comparison) continue;
      p.push_back(comparison->metrics[i].p_corrected);
      effect.push_back(comparison->metrics[i].wilcoxon.rank_biserial());
      improvement.push_back(comparison->metrics[i].improvement_percent.median);
    }
    if (p.empty()) continue;
    const std::vector<double> em_mm = medians(draws, pair.em, kMetrics[i]);
    const std::vector<double> fused_mm = medians(draws, pair.fused, kMetrics[i]);
    std::vector<double> differences_mm(em_mm.size());
    std::transform(em_mm.begin(), em_mm.end(), fused_mm.begin(), differences_mm.begin(), std::minus<>());
    const auto all_better = std::count(effect.begin(), effect.end(), 1.0);
    const double p_draws = bonferroni(wilcoxon_signed_rank(differences_mm).p_two_sided, kMetrics.size());
    out << "| `" << methods[pair.em].name << "`, `" << methods[pair.fused].name << "` | " << kMetrics[i].name
        << formatted(" | %.0f | %.2f (%.2f to %.2f) | %zu of %zu | %.2f | %.1e | ",
                     quantile(improvement, 0.5), quantile(p, 0.5), quantile(p, 0), quantile(p, 1),
                     static_cast<std::size_t>(all_better), effect.size(), quantile(effect, 0.5), p_draws)
        << (is_the_papers ? std::string(kPaper[i].p) + ", " + std::string(kPaper[i].effect) : "-") << " |\n";
  }
}

nlohmann::json row(const std::string& name, const std::vector<double>& values) {
  return {{"name", "accuracy/bench/" + name},
          {"unit", "mm"},
          {"n", values.size()},
          {"min", quantile(values, 0)},
          {"p50", quantile(values, 0.5)},
          {"p90", quantile(values, 0.9)},
          {"max", quantile(values, 1)},
          {"iqr", quantile(values, 0.75) - quantile(values, 0.25)},
          {"values", values}};
}

}  // namespace

void print_bench(const std::vector<BenchDraw>& draws, const std::vector<Method>& methods, std::ostream& out) {
  const std::size_t positions = draws.front().truth_rms_mm.size();
  out << "Sec. 3.2: " << draws.size() << " draws, " << positions << " positions each\n\n";
  print_drawn(draws, out);
  out << '\n';
  print_errors(draws, methods, out);
  out << "\n| EM, fused | metric | improvement, % | p of the positions, Bonferroni (least to greatest) | all "
         "positions better | effect size | p of the draws' medians, Bonferroni | the paper: p, effect size "
         "|\n"
         "|---|---|---|---|---|---|---|---|\n";
  for (const ComparedPair& pair : pairs_among(methods)) print_pair(draws, methods, pair, out);
}

nlohmann::json bench_rows(const std::vector<BenchDraw>& draws, const std::vector<Method>& methods) {
  nlohmann::json rows = nlohmann::json::array();
  for (const Drawn& quantity : drawn())
    rows.push_back(row(quantity.name, over_draws(draws, quantity.of_draw)));
  for (std::size_t method = 0; method < methods.size(); ++method) {
    for (const Metric& metric : kMetrics) {
      rows.push_back(
          row(methods[method].name + "/" + std::string(metric.name), medians(draws, method, metric)));
    }
  }
  return rows;
}

}  // namespace tubed
