#include "clients/tubectl/watch/status_line.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <iterator>
#include <nlohmann/json.hpp>

#include "clients/tubectl/watch/sample_text.hpp"
#include "idl/printable_text.hpp"
#include "idl/validity.hpp"

namespace tubed {

std::string_view name_of_stage_state(std::uint32_t state) {
  constexpr std::array<std::string_view, 6> kNames{"starting",     "running", "degraded",
                                                   "reconnecting", "ended",   "failed"};
  return state < kNames.size() ? kNames[state] : "unknown";
}

void StatusLine::add(const TubeSample& sample) {
  validity_ = name_of(static_cast<Validity>(sample.estimate.validity));
  reasons_ = names_of(Reasons(sample.estimate.reasons));
  trouble_.reset();
  if (samples_++ == 0) {
    first_received_ns_ = sample.received_monotonic_ns;
  }
  last_received_ns_ = sample.received_monotonic_ns;
  const std::int64_t measured_ns = measured_monotonic_ns(sample.estimate);
  latency_ms_.reset();
  if (measured_ns > 0) {
    latency_ms_ = static_cast<double>(sample.received_monotonic_ns - measured_ns) * 1e-6;
  }
}

void StatusLine::add(const TubeNews& news) {
  if (news.event == TubeEvent::kRivalSeen || news.event == TubeEvent::kRivalGone) {
    rival_ = news.rival;
  } else {
    trouble_ = news.event;
  }
}

bool StatusLine::add(const tubed_TubeStatus& status) {
  const bool is_first = stages_.empty();
  estimate_age_ns_ = status.estimate_age_ns;
  stages_.clear();
  whys_.clear();
  const auto count = std::min<std::size_t>(status.stage_count, std::size(status.stages));
  for (std::size_t i = 0; i < count; ++i) {
    stages_[printable_text(status.stages[i].name)] = name_of_stage_state(status.stages[i].state);
    if (status.stages[i].why[0] != '\0') {
      whys_[printable_text(status.stages[i].name)] = printable_text(status.stages[i].why);
    }
  }
  return is_first;
}

bool StatusLine::is_valid() const {
  return !trouble_ && rival_.empty() && validity_ == name_of(Validity::kValid);
}

std::string StatusLine::word() const {
  return trouble_ || validity_.empty() ? std::string("NO_SHAPE") : validity_;
}

std::optional<double> StatusLine::rate_hz() const {
  const double seconds = static_cast<double>(last_received_ns_ - first_received_ns_) * 1e-9;
  return samples_ >= 2 && seconds > 0 ? std::optional(static_cast<double>(samples_ - 1) / seconds)
                                      : std::nullopt;
}

std::string StatusLine::text(const std::string& id) const {
  const auto number = [](const std::optional<double>& value, const char* unit) {
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), "%.1f", value.value_or(0));
    return value ? std::string(text.data()) + unit : std::string("-");
  };
  std::string line = id + " " + word() + " ";
  line += trouble_ ? "\"" + std::string(name_of(*trouble_)) + "\"" : reasons_.empty() ? "-" : reasons_;
  line += " rate=" + number(rate_hz(), "Hz") + " latency=" + number(latency_ms_, "ms");
  line += " age=" + (estimate_age_ns_ ? age_text(*estimate_age_ns_) : "-");
  for (const auto& [stage, state] : stages_) line += " " + stage + "=" + state;
  for (const auto& [stage, why] : whys_) line += " " + stage + "=\"" + why + "\"";
  if (!rival_.empty()) line += " rival=\"" + rival_ + "\"";
  return line;
}

nlohmann::json StatusLine::to_json(const std::string& id) const {
  nlohmann::json json{{"instrument_id", id}, {"validity", word()}, {"stages", stages_}};
  json["why"] = whys_;
  json["reasons"] = reasons_.empty() ? nlohmann::json() : nlohmann::json(reasons_);
  json["event"] = trouble_ ? nlohmann::json(name_of(*trouble_)) : nlohmann::json();
  json["rival"] = rival_.empty() ? nlohmann::json() : nlohmann::json(rival_);
  json["rate_hz"] = rate_hz() ? nlohmann::json(*rate_hz()) : nlohmann::json();
  json["latency_ms"] = latency_ms_ ? nlohmann::json(*latency_ms_) : nlohmann::json();
  json["estimate_age_ns"] = estimate_age_ns_ ? nlohmann::json(*estimate_age_ns_) : nlohmann::json();
  return json;
}

}  // namespace tubed
