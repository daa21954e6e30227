#include "clients/evaluation/evaluation.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <set>
#include <stdexcept>
#include <string>

namespace tubed {

namespace {

void refuse_frames_of_another_run(const TrueRun& run, const Estimates& estimates) {
  std::set<std::uint32_t> due;
  for (const TrueInstant& instant : run.instants) due.insert(instant.frame);
  for (const auto& [frame, shape] : estimates) {
    if (!due.contains(frame)) {
      throw std::runtime_error(
          "frame " + std::to_string(frame) +
          " is not due in this sequence (an instant is filed under the last of its rows in "
          "frames.csv); are the estimates those of another one?");
    }
  }
}

void count_within(const Eigen::Vector3d& off_mm, const Eigen::Vector3d& sigma_mm, SigmaCoverage& coverage) {
  if (!sigma_mm.allFinite()) return;  // it is unknown, and covers nothing
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    ++coverage.coordinate_count;
    for (std::size_t k = 1; k <= coverage.within.size(); ++k) {
      if (off_mm[axis] <= static_cast<double>(k) * sigma_mm[axis]) ++coverage.within[k - 1];
    }
  }
}

void count_coverage(const EstimatedShape& shape, const SampledCentreline& truth, double s_max_mm,
                    MethodEvaluation& evaluation) {
  for (std::size_t i = 0; i < shape.centreline.s_mm.size(); ++i) {
    const double s_mm = shape.centreline.s_mm[i];
    if (s_mm > s_max_mm || s_mm > truth.s_mm.back()) break;
    const auto column = static_cast<Eigen::Index>(i);
    const Eigen::Vector3d off_mm =
        (shape.centreline.p_world_mm.col(column) - point_at(truth, s_mm)).cwiseAbs();
    count_within(off_mm, shape.sigma_world_mm.col(column), evaluation.coverage);
    if (!shape.held_by.empty()) {
      HeldPoints& held = evaluation.held[shape.held_by[i]];
      held.off_mm.push_back(off_mm.norm());
      count_within(off_mm, shape.sigma_world_mm.col(column), held.coverage);
    }
  }
}

// Both begin at the tip. Off by nothing it is off by no sigma, whatever that is; nothing where sigma is
// unknown.
std::optional<double> tip_sigmas(const EstimatedShape& shape, const SampledCentreline& truth) {
  const double s_mm = std::max(shape.centreline.s_mm.front(), truth.s_mm.front());
  if (!shape.sigma_world_mm.col(0).allFinite()) return std::nullopt;
  const Eigen::Vector3d off_mm = (point_at(shape.centreline, s_mm) - point_at(truth, s_mm)).cwiseAbs();
  double max = 0;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    if (off_mm[axis] > 0) max = std::max(max, off_mm[axis] / shape.sigma_world_mm(axis, 0));
  }
  return max;
}

/// One metric at the instants both methods were judged at.
struct Pairs {
  std::vector<double> em_mm;
  std::vector<double> fused_mm;
};

Pairs pairs_of(const MethodEvaluation& em, const MethodEvaluation& fused, const Metric& metric) {
  Pairs pairs;
  for (std::size_t i = 0; i < em.errors.size(); ++i) {
    if (!em.errors[i] || !fused.errors[i]) continue;
    pairs.em_mm.push_back((*em.errors[i]).*metric.value_mm);
    pairs.fused_mm.push_back((*fused.errors[i]).*metric.value_mm);
  }
  return pairs;
}

double improvement_percent(double em_mm, double fused_mm) {
  if (em_mm == 0) return fused_mm == 0 ? 0.0 : -std::numeric_limits<double>::infinity();
  return 100 * (em_mm - fused_mm) / em_mm;
}

MedianAndIqr improvement_of(const Pairs& pairs) {
  std::vector<double> percent(pairs.em_mm.size());
  std::transform(pairs.em_mm.begin(), pairs.em_mm.end(), pairs.fused_mm.begin(), percent.begin(),
                 improvement_percent);
  const bool finite =
      std::all_of(percent.begin(), percent.end(), [](double value) { return std::isfinite(value); });
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  return finite ? median_and_iqr(percent) : MedianAndIqr{kNaN, kNaN};
}

MetricComparison compare_metric(const Pairs& pairs) {
  std::vector<double> differences_mm(pairs.em_mm.size());
  std::transform(pairs.em_mm.begin(), pairs.em_mm.end(), pairs.fused_mm.begin(), differences_mm.begin(),
                 std::minus<>());
  MetricComparison comparison;
  comparison.em_mm = median_and_iqr(pairs.em_mm);
  comparison.fused_mm = median_and_iqr(pairs.fused_mm);
  comparison.improvement_percent = improvement_of(pairs);
  comparison.wilcoxon = wilcoxon_signed_rank(differences_mm);
  comparison.p_corrected = bonferroni(comparison.wilcoxon.p_two_sided, kMetrics.size());
  comparison.normality = shapiro_wilk(differences_mm);
  return comparison;
}

}  // namespace

std::size_t MethodEvaluation::judged_count() const {
  return static_cast<std::size_t>(
      std::count_if(errors.begin(), errors.end(), [](const auto& e) { return e.has_value(); }));
}

std::vector<double> MethodEvaluation::values_mm(const Metric& metric) const {
  std::vector<double> values;
  for (const auto& error : errors) {
    if (error) values.push_back((*error).*metric.value_mm);
  }
  return values;
}

MethodEvaluation evaluate_method(const TrueRun& run, const Estimates& estimates,
                                 const ShapeErrorSettings& settings) {
  refuse_frames_of_another_run(run, estimates);
  MethodEvaluation evaluation;
  for (const TrueInstant& instant : run.instants) {
    std::optional<ShapeError>& error = evaluation.errors.emplace_back();
    std::optional<double>& tip = evaluation.tip_sigmas.emplace_back();
    const auto found = estimates.find(instant.frame);
    if (found == estimates.end()) {
      evaluation.missing_frames.push_back(instant.frame);
      continue;
    }
    const EstimatedShape& shape = found->second;
    ++evaluation.validity_counts[shape.validity];
    if (up_to(shape.centreline, settings.s_max_mm).s_mm.size() < 2) {
      evaluation.shapeless_frames.push_back(instant.frame);
    } else if (up_to(instant.truth, settings.s_max_mm).s_mm.size() < 2) {
      evaluation.truthless_frames.push_back(instant.frame);
    } else {
      Camera view = run.cameras[instant.view_camera];
      view.look_from(instant.view);
      const ViewOfFrame cameras{run.cameras.front(), view};
      error = shape_error(shape.centreline, instant.truth, cameras, settings);
      if (!error) evaluation.unjudged_frames.push_back(instant.frame);
      tip = tip_sigmas(shape, instant.truth);
      count_coverage(shape, instant.truth, settings.s_max_mm, evaluation);
      evaluation.consistency.add(shape, instant.truth, view, settings.s_max_mm);
      if (const auto points = misleading_points(shape, instant.truth, view, settings)) {
        MisleadingCount& count = evaluation.misleading[shape.validity];
        ++count.instants;
        count.misleading += points->any() ? 1 : 0;
      }
    }
  }
  return evaluation;
}

std::optional<Comparison> compare(const MethodEvaluation& em, const MethodEvaluation& fused) {
  Comparison comparison;
  for (std::size_t i = 0; i < kMetrics.size(); ++i) {
    const Pairs pairs = pairs_of(em, fused, kMetrics[i]);
    if (pairs.em_mm.empty()) return std::nullopt;
    comparison.pair_count = pairs.em_mm.size();
    comparison.metrics[i] = compare_metric(pairs);
  }
  return comparison;
}

}  // namespace tubed
