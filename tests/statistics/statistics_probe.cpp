// Reads {"samples": [[...], ...]} from standard input and writes what our statistics make of each sample, as
// JSON: the door through which statistics_against_scipy.py sees them.
#include <iostream>
#include <nlohmann/json.hpp>

#include "clients/evaluation/statistics.hpp"

namespace {

nlohmann::json describe(const std::vector<double>& sample) {
  const tubed::MedianAndIqr spread = tubed::median_and_iqr(sample);
  const tubed::WilcoxonResult wilcoxon = tubed::wilcoxon_signed_rank(sample);
  nlohmann::json answer{{"median", spread.median},
                        {"iqr", spread.iqr},
                        {"wilcoxon_p", wilcoxon.p_two_sided},
                        {"wilcoxon_method", tubed::name_of(wilcoxon.method)},
                        {"rank_sum_positive", wilcoxon.rank_sum_positive},
                        {"rank_sum_negative", wilcoxon.rank_sum_negative},
                        {"rank_biserial", wilcoxon.rank_biserial()},
                        {"has_ties", wilcoxon.has_ties}};
  if (const auto shapiro = tubed::shapiro_wilk(sample)) {
    answer["shapiro_w"] = shapiro->w;
    answer["shapiro_p"] = shapiro->p;
  }
  return answer;
}

}  // namespace

int main() {
  const nlohmann::json request = nlohmann::json::parse(std::cin);
  nlohmann::json answers = nlohmann::json::array();
  for (const auto& sample : request.at("samples"))
    answers.push_back(describe(sample.get<std::vector<double>>()));
  std::cout << answers << '\n';
}
