#include "clients/evaluation/evaluation_report.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <numeric>
#include <string_view>

namespace tubed {

namespace {

/// A row of Table 1 (simulation) as the paper prints it, "?" where our copy of the table is not legible. The
/// p-values are those of its text: far below 0.05 but for z.
struct PaperRow {
  std::string_view em;
  std::string_view fused;
  std::string_view improvement;
  std::string_view p;
  std::string_view effect;
};
constexpr std::array<PaperRow, kMetrics.size()> kPaper{
    {{"?", "?", "23.5 | 24.3", "<< 0.05", "0.97"},
     {"2.8 | 0.5", "2.0 | 0.7", "28.0 | 21.9", "<< 0.05", "0.99"},
     {"1.7 | 0.7", "0.2 | 0.1", "87.9 | 9.5", "<< 0.05", "1"},
     {"?", "0.2 | 0.1", "73.3 | 21.7", "<< 0.05", "0.99"},
     {"?", "?", "-0.2 | 11.9", ">> 0.05", "-0.03"}}};

constexpr std::size_t kNamedFrames = 10;  // of those left out, before "..."
constexpr std::array<double, 3> kNormalShares{68.3, 95.4, 99.7};

template <typename... Values>
std::string formatted(const char* format, Values... values) {
  std::array<char, 256> text{};
  std::snprintf(text.data(), text.size(), format, values...);
  return text.data();
}

std::string spread(const MedianAndIqr& value, int decimals) {
  if (!std::isfinite(value.median) || !std::isfinite(value.iqr)) return "undefined";
  return formatted("%.*f | %.*f", decimals, value.median, decimals, value.iqr);
}

std::string probability(double p) { return p < 1e-3 ? formatted("%.1e", p) : formatted("%.3f", p); }

std::string cell(std::string_view text, int width) {
  return formatted("%-*.*s", width, width, std::string(text).c_str());
}

std::string half_row(const PaperRow& row) {
  return cell(row.em, 13) + cell(row.fused, 13) + cell(row.improvement, 15) + cell(row.p, 9) +
         cell(row.effect, 7);
}

std::string table_row(std::string_view name, const PaperRow& ours, const PaperRow& paper) {
  const std::string row = cell(name, 11) + half_row(ours) + "|  " + half_row(paper);
  return row.substr(0, row.find_last_not_of(' ') + 1) + "\n";
}

void print_table(const EvaluationReport& report, std::ostream& out) {
  out << cell("", 11) << cell("median | IQR, mm; improvement %", 57)
      << "|  the paper's Table 1, its simulation\n";
  constexpr PaperRow kHeading{"EM", "EM + fluoro", "improvement", "p", "ES"};
  out << table_row("", kHeading, kHeading);
  for (std::size_t i = 0; i < kMetrics.size(); ++i) {
    std::string em = "-";
    std::string fused = "-";
    std::string improvement = "-";
    std::string p = "-";
    std::string effect = "-";
    if (report.comparison) {
      const MetricComparison& metric = report.comparison->metrics[i];
      em = spread(metric.em_mm, 2);
      fused = spread(metric.fused_mm, 2);
      improvement = spread(metric.improvement_percent, 1);
      p = probability(metric.p_corrected);
      effect = formatted("%.2f", metric.wilcoxon.rank_biserial());
    } else {
      if (report.em && report.em->judged_count() > 0)
        em = spread(median_and_iqr(report.em->values_mm(kMetrics[i])), 2);
      if (report.fused && report.fused->judged_count() > 0) {
        fused = spread(median_and_iqr(report.fused->values_mm(kMetrics[i])), 2);
      }
    }
    out << table_row(kMetrics[i].name, {em, fused, improvement, p, effect}, kPaper[i]);
  }
}

void print_tests(const Comparison& comparison, std::ostream& out) {
  const WilcoxonResult& rms = comparison.metrics[1].wilcoxon;
  out << "p: Wilcoxon signed-rank over " << comparison.pair_count << " pairs, two-sided, "
      << name_of(rms.method) << ", times " << kMetrics.size()
      << " (Bonferroni). ES: matched-pairs rank-biserial,\n"
      << "   positive = EM + fluoro is better. The paper has p < 10^-50 in two rows that our copy does not "
         "tell apart.\n"
      << "Shapiro-Wilk p that EM - fused is normal:";
  for (std::size_t i = 0; i < kMetrics.size(); ++i) {
    const auto& normality = comparison.metrics[i].normality;
    out << (i == 0 ? " " : ", ") << kMetrics[i].name << ' '
        << (normality ? probability(normality->p) : "undefined");
  }
  out << '\n';
}

void print_frames(std::string_view why, const std::vector<std::uint32_t>& frames, std::ostream& out) {
  if (frames.empty()) return;
  out << "  LEFT OUT: " << frames.size() << ' ' << why << ": frame";
  for (std::size_t i = 0; i < std::min(frames.size(), kNamedFrames); ++i) out << ' ' << frames[i];
  out << (frames.size() > kNamedFrames ? " ...\n" : "\n");
}

double percent_of(const MisleadingCount& count) {
  return count.instants == 0
             ? 0
             : 100 * static_cast<double>(count.misleading) / static_cast<double>(count.instants);
}

void print_misleading(const std::map<Validity, MisleadingCount>& counts, std::ostream& out) {
  if (counts.empty()) return;
  const auto valid = counts.find(Validity::kValid);
  const MisleadingCount of_valid = valid == counts.end() ? MisleadingCount{} : valid->second;
  const MisleadingCount all = total_of(counts);
  const MisleadingLimits limits;
  out << formatted("  misleading (a point off by more than %g mm and %g sigma of that direction): ",
                   limits.distance_mm, limits.sigmas)
      << formatted("%zu of %zu VALID instants (%.1f %%), ", of_valid.misleading, of_valid.instants,
                   percent_of(of_valid))
      << formatted("%zu of all %zu (%.1f %%)\n", all.misleading, all.instants, percent_of(all));
}

constexpr std::array<std::string_view, 4> kHolders{"nothing", "a coil", "an image", "a coil and an image"};

double root_mean_square(const std::vector<double>& values) {
  const double squares = std::inner_product(values.begin(), values.end(), values.begin(), 0.0);
  return std::sqrt(squares / static_cast<double>(values.size()));
}

void print_held(const std::array<HeldPoints, 4>& held, std::ostream& out) {
  std::size_t points = 0;
  for (const HeldPoints& part : held) points += part.off_mm.size();
  if (points == 0) return;
  out << "  points held by          share   RMS mm   95 %   greatest   within 1 / 2 / 3 sigma\n";
  for (std::size_t i = held.size(); i-- > 0;) {
    const HeldPoints& part = held[i];
    if (part.off_mm.empty()) continue;
    const double share = static_cast<double>(part.off_mm.size()) / static_cast<double>(points);
    out << "    " << cell(kHolders[i], 21)
        << formatted("%5.1f %%   %6.2f %6.2f   %8.2f   %.1f / %.1f / %.1f %%\n", 100 * share,
                     root_mean_square(part.off_mm), quantile(part.off_mm, 0.95),
                     *std::max_element(part.off_mm.begin(), part.off_mm.end()), 100 * part.coverage.share(1),
                     100 * part.coverage.share(2), 100 * part.coverage.share(3));
  }
}

std::string consistency_cell(const NormalisedErrors& errors) {
  if (errors.count == 0) return cell("-", 16);
  return cell(formatted("%.2f  %.1f %%", errors.mean_of_squares(), 100 * errors.share_beyond_3_sigma()), 16);
}

void print_consistency(const Consistency& consistency, std::ostream& out) {
  std::string head;
  std::string all;
  for (std::size_t k = 0; k < kSeenDirections.size(); ++k) {
    head += cell(kSeenDirections[k], 16);
    all += consistency_cell(consistency.of(k));
  }
  if (consistency.of(0).count == 0) return;
  const auto print = [&out](std::string_view name, const std::string& cells) {
    out << "    " << cell(name, 21) << cells.substr(0, cells.find_last_not_of(' ') + 1) << '\n';
  };
  out << "  error^2 / sigma^2, mean (1 where sigma is right), and share beyond 3 sigma (normal: 0.3 %), as "
         "the camera sees it\n";
  print("", head);
  for (std::size_t stretch = 0; stretch < kConsistencyStretches.size(); ++stretch) {
    std::string cells;
    for (std::size_t k = 0; k < kSeenDirections.size(); ++k)
      cells += consistency_cell(consistency.of(stretch, k));
    print(kConsistencyStretches[stretch].name, cells);
  }
  print("all", all);
}

void print_method(std::string_view name, const MethodEvaluation& method, std::size_t due_count,
                  std::ostream& out) {
  out << name << ": " << method.judged_count() << " of " << due_count << " instants judged; validity";
  for (const auto& [validity, count] : method.validity_counts)
    out << ' ' << name_of(validity) << ' ' << count;
  out << '\n';
  print_frames("missing in the estimates", method.missing_frames, out);
  print_frames("estimated without a shape", method.shapeless_frames, out);
  print_frames("without truth", method.truthless_frames, out);
  print_frames("without a point in view", method.unjudged_frames, out);
  print_misleading(method.misleading, out);
  if (method.coverage.coordinate_count == 0) {
    if (method.judged_count() > 0) out << "  it says no sigma\n";
    return;
  }
  out << "  coordinates within 1 / 2 / 3 sigma (same arc length): ";
  for (std::size_t k = 1; k <= 3; ++k)
    out << formatted(k == 1 ? "%.1f" : " / %.1f", 100 * method.coverage.share(k));
  out << formatted(" %%; normal: %.1f / %.1f / %.1f %%\n", kNormalShares[0], kNormalShares[1],
                   kNormalShares[2]);
  print_held(method.held, out);
  print_consistency(method.consistency, out);
}

nlohmann::json number(double value) {
  return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json(nullptr);
}

nlohmann::json json_of(const MedianAndIqr& value) {
  return {{"median", number(value.median)}, {"iqr", number(value.iqr)}};
}

nlohmann::json json_of(const SigmaCoverage& coverage) {
  if (coverage.coordinate_count == 0) return nullptr;
  return {coverage.share(1), coverage.share(2), coverage.share(3)};
}

nlohmann::json json_of(const Consistency& consistency) {
  nlohmann::json json = nullptr;
  for (std::size_t stretch = 0; stretch < kConsistencyStretches.size(); ++stretch) {
    for (std::size_t k = 0; k < kSeenDirections.size(); ++k) {
      const NormalisedErrors& errors = consistency.of(stretch, k);
      if (errors.count == 0) continue;
      json[std::string(kConsistencyStretches[stretch].name)][std::string(kSeenDirections[k])] = {
          {"coordinates", errors.count},
          {"nees", errors.mean_of_squares()},
          {"beyond_3_sigma", errors.share_beyond_3_sigma()}};
    }
  }
  return json;
}

nlohmann::json json_of(const MethodEvaluation& method) {
  nlohmann::json json{{"judged", method.judged_count()},
                      {"missing_frames", method.missing_frames},
                      {"shapeless_frames", method.shapeless_frames},
                      {"truthless_frames", method.truthless_frames},
                      {"unjudged_frames", method.unjudged_frames},
                      {"validity", nlohmann::json::object()},
                      {"within_sigma", nullptr},
                      {"held_by", nullptr},
                      {"misleading", nullptr}};
  for (std::size_t i = 0; i < method.held.size(); ++i) {
    const HeldPoints& part = method.held[i];
    if (part.off_mm.empty()) continue;
    json["held_by"][std::string(kHolders[i])] = {{"points", part.off_mm.size()},
                                                 {"rms_mm", root_mean_square(part.off_mm)},
                                                 {"p95_mm", quantile(part.off_mm, 0.95)},
                                                 {"within_sigma", json_of(part.coverage)}};
  }
  for (const auto& [validity, count] : method.misleading) {
    json["misleading"][std::string(name_of(validity))] = {{"instants", count.instants},
                                                          {"misleading", count.misleading}};
  }
  for (const auto& [validity, count] : method.validity_counts)
    json["validity"][std::string(name_of(validity))] = count;
  json["within_sigma"] = json_of(method.coverage);
  json["consistency"] = json_of(method.consistency);
  for (const Metric& metric : kMetrics) {
    const std::vector<double> values = method.values_mm(metric);
    json["mm"][std::string(metric.name)] =
        values.empty() ? nlohmann::json(nullptr) : json_of(median_and_iqr(values));
  }
  return json;
}

nlohmann::json json_of(const MetricComparison& metric) {
  nlohmann::json json{{"em_mm", json_of(metric.em_mm)},
                      {"fused_mm", json_of(metric.fused_mm)},
                      {"improvement_percent", json_of(metric.improvement_percent)},
                      {"p", metric.wilcoxon.p_two_sided},
                      {"p_corrected", metric.p_corrected},
                      {"p_method", name_of(metric.wilcoxon.method)},
                      {"effect_size", metric.wilcoxon.rank_biserial()},
                      {"zero_differences", metric.wilcoxon.zero_count},
                      {"shapiro_wilk", nullptr}};
  if (metric.normality) json["shapiro_wilk"] = {{"w", metric.normality->w}, {"p", metric.normality->p}};
  return json;
}

}  // namespace

void print_report(const EvaluationReport& report, std::ostream& out) {
  out << report.sequence << ": " << report.due_count << " instants, s = 0 .. " << report.settings.s_max_mm
      << " mm, match " << name_of(report.settings.match)
      << (report.settings.part == JudgedPart::kInView ? ", points in view\n\n" : ", all points\n\n");
  print_table(report, out);
  out << '\n';
  if (report.comparison) {
    print_tests(*report.comparison, out);
  } else if (report.em && report.fused) {
    out << "No instant was judged for both methods: nothing to compare.\n";
  }
  if (report.em) print_method("EM", *report.em, report.due_count, out);
  if (report.fused) print_method("EM + fluoro", *report.fused, report.due_count, out);
}

nlohmann::json to_json(const EvaluationReport& report) {
  nlohmann::json json{{"sequence", report.sequence},
                      {"due", report.due_count},
                      {"s_max_mm", report.settings.s_max_mm},
                      {"match", name_of(report.settings.match)},
                      {"in_view", report.settings.part == JudgedPart::kInView},
                      {"em", report.em ? json_of(*report.em) : nlohmann::json(nullptr)},
                      {"fused", report.fused ? json_of(*report.fused) : nlohmann::json(nullptr)},
                      {"comparison", nullptr}};
  if (report.comparison) {
    json["comparison"] = {{"pairs", report.comparison->pair_count}};
    for (std::size_t i = 0; i < kMetrics.size(); ++i) {
      json["comparison"]["metrics"][std::string(kMetrics[i].name)] = json_of(report.comparison->metrics[i]);
    }
  }
  return json;
}

}  // namespace tubed
