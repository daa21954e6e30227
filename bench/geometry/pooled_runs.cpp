#include "bench/geometry/pooled_runs.hpp"

#include "clients/evaluation/statistics.hpp"

namespace tubed {

void PooledRuns::add(const MistakeRuns::Outcome& outcome, const Said& said) {
  due += outcome.instants.size();
  for (const auto& instant : outcome.instants) valid += instant.validity == Validity::kValid ? 1 : 0;
  const std::vector<double> of_seed_mm = outcome.in_view.values_mm(kMetrics[1]);
  rms_mm.insert(rms_mm.end(), of_seed_mm.begin(), of_seed_mm.end());
  tip_mm.insert(tip_mm.end(), outcome.tip_mm.begin(), outcome.tip_mm.end());
  if (!of_seed_mm.empty()) median_rms_mm.push_back(quantile(of_seed_mm, 0.5));
  const MisleadingCount all = total_of(outcome.in_view.misleading);
  of_all.instants += all.instants;
  of_all.misleading += all.misleading;
  const auto found = outcome.in_view.misleading.find(Validity::kValid);
  if (found != outcome.in_view.misleading.end()) {
    of_valid.instants += found->second.instants;
    of_valid.misleading += found->second.misleading;
  }
  coverage.coordinate_count += outcome.in_view.coverage.coordinate_count;
  for (std::size_t k = 0; k < 3; ++k) coverage.within[k] += outcome.in_view.coverage.within[k];
  first_s.push_back(said.first_s);
  first_reasons.add(said.first_reasons);
  doubted += said.instants;
  for (const auto& [reason, count] : said.reasons) reasons[reason] += count;
}

double percent(std::size_t part, std::size_t whole) {
  return whole == 0 ? 0 : 100 * static_cast<double>(part) / static_cast<double>(whole);
}

}  // namespace tubed
