#include "clients/tubectl/watch/stream_statistics.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "clients/tubectl/watch/sample_text.hpp"
#include "idl/validity.hpp"

namespace tubed {
namespace {

using nlohmann::json;

json percentiles_json(const std::vector<double>& values) {
  const std::optional<Percentiles> percentiles = percentiles_of(values);
  if (!percentiles) {
    return nullptr;
  }
  return {{"count", values.size()},
          {"p50", percentiles->p50},
          {"p90", percentiles->p90},
          {"p99", percentiles->p99}};
}

std::string latency_row(const char* name, const std::vector<double>& values) {
  const std::optional<Percentiles> percentiles = percentiles_of(values);
  if (!percentiles) {
    return fmt::format("  {:<28}none\n", name);
  }
  return fmt::format("  {:<28}p50 {:.2f}  p90 {:.2f}  p99 {:.2f}  ({} samples)\n", name, percentiles->p50,
                     percentiles->p90, percentiles->p99, values.size());
}

std::string counts_rows(const std::string& heading, const std::map<std::string, std::uint64_t>& counts) {
  std::string rows;
  for (const auto& [name, count] : counts) {
    rows += fmt::format("  {:<28}{}\n", fmt::format("{} {}", heading, name), count);
  }
  return rows;
}

double milliseconds(std::int64_t ns) { return static_cast<double>(ns) / 1e6; }

}  // namespace

std::optional<Percentiles> percentiles_of(std::vector<double> values) {
  if (values.empty()) {
    return std::nullopt;
  }
  std::sort(values.begin(), values.end());
  const auto nearest_rank = [&](double percent) {
    const double rank = std::ceil(percent / 100 * static_cast<double>(values.size()));
    return values[static_cast<std::size_t>(rank) - 1];
  };
  return Percentiles{.p50 = nearest_rank(50), .p90 = nearest_rank(90), .p99 = nearest_rank(99)};
}

void StreamStatistics::add(const TubeSample& sample) {
  const tubed_TubeEstimate& estimate = sample.estimate;
  if (samples_ == 0) {
    first_received_ns_ = sample.received_monotonic_ns;
  } else {
    max_interval_ns_ = std::max(max_interval_ns_, sample.received_monotonic_ns - last_received_ns_);
    lost_ += sample.lost_before;
  }
  last_received_ns_ = sample.received_monotonic_ns;
  ++samples_;
  restarts_ += sample.is_restart ? 1 : 0;
  if (const std::int64_t measured_ns = measured_monotonic_ns(estimate); measured_ns != 0) {
    (estimate.has_image ? exposure_latencies_ms_ : em_latencies_ms_)
        .push_back(milliseconds(sample.received_monotonic_ns) - milliseconds(measured_ns));
  }
  ++validity_[std::string(name_of(static_cast<Validity>(estimate.validity)))];
  for (int bit = 0; bit < kReasonCount; ++bit) {
    const auto reason = static_cast<Reason>(1U << static_cast<unsigned>(bit));
    if (Reasons(estimate.reasons).has(reason)) {
      ++reasons_[std::string(name_of(reason))];
    }
  }
}

void StreamStatistics::add(TubeEvent event) { ++events_[std::string(name_of(event))]; }

double StreamStatistics::rate_hz() const {
  const double seconds = static_cast<double>(last_received_ns_ - first_received_ns_) / 1e9;
  return samples_ < 2 || seconds <= 0 ? 0 : static_cast<double>(samples_ - 1) / seconds;
}

json StreamStatistics::to_json() const {
  return {
      {"samples", samples_},
      {"rate_hz", rate_hz()},
      {"lost", lost_},
      {"restarts", restarts_},
      {"interval_ms", {{"max", milliseconds(max_interval_ns_)}}},
      {"latency_ms",
       {{"exposure", percentiles_json(exposure_latencies_ms_)}, {"em", percentiles_json(em_latencies_ms_)}}},
      {"validity", validity_},
      {"reasons", reasons_},
      {"events", events_}};
}

std::string StreamStatistics::table() const {
  return fmt::format("  {:<28}{:.2f} Hz ({} samples, {} lost, {} restarts)\n", "rate", rate_hz(), samples_,
                     lost_, restarts_) +
         fmt::format("  {:<28}{:.1f} ms\n", "longest interval", milliseconds(max_interval_ns_)) +
         latency_row("exposure to here, ms", exposure_latencies_ms_) +
         latency_row("EM measurement to here, ms", em_latencies_ms_) + counts_rows("validity", validity_) +
         counts_rows("reason", reasons_) + counts_rows("event", events_);
}

}  // namespace tubed
