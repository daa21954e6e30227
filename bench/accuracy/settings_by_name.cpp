#include "bench/accuracy/settings_by_name.hpp"

#include <functional>
#include <map>
#include <stdexcept>

namespace tubed {

namespace {

struct Option {
  std::string takes;
  std::function<void(const std::string&, EstimatorSettings&)> apply;
};

template <typename Get>
Option number(Get get) {
  return {"a number", [get](const std::string& word, EstimatorSettings& settings) {
            std::size_t used = 0;
            const double value = std::stod(word, &used);
            if (used != word.size()) throw std::invalid_argument("not a number");
            auto& target = get(settings);
            target = static_cast<std::remove_reference_t<decltype(target)>>(value);
          }};
}

template <typename Get>
Option choice(const std::string& first, const std::string& second, Get get) {
  return {first + " or " + second, [=](const std::string& word, EstimatorSettings& settings) {
            if (word != first && word != second) throw std::invalid_argument("no such word");
            auto& target = get(settings);
            target = static_cast<std::remove_reference_t<decltype(target)>>(word == first ? 0 : 1);
          }};
}

const std::map<std::string, Option>& options() {
  using S = EstimatorSettings;
  static const std::map<std::string, Option> kOptions{
      {"coefficient_count", number([](S& s) -> int& { return s.coefficient_count; })},
      {"sigma_position_mm", number([](S& s) -> double& { return s.sigma_position_mm; })},
      {"sigma_tangent", number([](S& s) -> double& { return s.sigma_tangent; })},
      {"sigma_strain_sqrt_mm", number([](S& s) -> double& { return s.sigma_strain_sqrt_mm; })},
      {"bending_q_per_mm", number([](S& s) -> double& { return s.bending_q_per_mm; })},
      {"sigma_image_px", number([](S& s) -> double& { return s.sigma_image_px; })},
      {"image_search_px", number([](S& s) -> double& { return s.image_search_px; })},
      {"image_temper", number([](S& s) -> double& { return s.image_temper; })},
      {"paper.knot_point_count", number([](S& s) -> int& { return s.paper.knot_point_count; })},
      {"paper.sigma_length_mm", number([](S& s) -> double& { return s.paper.sigma_length_mm; })},
      {"paper.heaviside_px", number([](S& s) -> double& { return s.paper.heaviside_px; })},
      {"paper.appearance_share", number([](S& s) -> double& { return s.paper.appearance_share; })},
      {"paper.rounds", number([](S& s) -> int& { return s.paper.rounds; })},
      {"paper.weights",
       choice("consistent", "printed", [](S& s) -> PaperWeights& { return s.paper.weights; })},
      {"paper.depth_lengths",
       choice("left_out", "printed", [](S& s) -> PaperDepthLengths& { return s.paper.depth_lengths; })},
      {"paper.mle_start", choice("lines", "em", [](S& s) -> PaperMleStart& { return s.paper.mle_start; })},
      {"paper.mle_prior",
       choice("em_error", "none", [](S& s) -> PaperMlePrior& { return s.paper.mle_prior; })},
      {"paper.hub_end", choice("goes_on", "capped", [](S& s) -> PaperHubEnd& { return s.paper.hub_end; })},
      {"paper.heaviside",
       choice("narrowing", "fixed", [](S& s) -> PaperHeaviside& { return s.paper.heaviside; })}};
  return kOptions;
}

}  // namespace

void apply_option(const std::string& option, EstimatorSettings& settings) {
  const std::size_t equals = option.find('=');
  const auto found = options().find(option.substr(0, equals));
  if (equals == std::string::npos || found == options().end()) {
    throw std::invalid_argument("--set " + option + ": write KEY=VALUE with one of\n" + settings_help());
  }
  try {
    found->second.apply(option.substr(equals + 1), settings);
  } catch (const std::exception&) {
    throw std::invalid_argument("--set " + option + ": takes " + found->second.takes);
  }
}

std::string settings_help() {
  std::string help;
  for (const auto& [key, option] : options()) help += "  " + key + " = " + option.takes + '\n';
  return help;
}

}  // namespace tubed
