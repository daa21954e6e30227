#include "clients/evaluation/latency_statistics.hpp"

#include <spdlog/fmt/fmt.h>

#include <array>
#include <cstdint>
#include <nlohmann/json.hpp>

#include "clients/evaluation/statistics.hpp"

namespace tubed {
namespace {

using nlohmann::json;

/// A row of the report: its key, its words, and whether it is the age of what somebody sees.
struct Span {
  const char* key;
  const char* words;
  bool is_age;
};

constexpr std::array<Span, 14> kSpans{{{"grab", "  exposure to grabbed", false},
                                       {"wake_frangi", "  waiting for the Frangi filter", false},
                                       {"frangi", "  Frangi filter", false},
                                       {"wake_optimizer", "  waiting for the optimizer", false},
                                       {"optimizer", "  optimizer", false},
                                       {"wake_publisher", "  waiting for the publisher", false},
                                       {"way_image", "  published to here", false},
                                       {"exposure_to_publish", "exposure to published", true},
                                       {"exposure_to_here", "exposure to here", true},
                                       {"em_delivery", "  EM measured to received", false},
                                       {"em_wait", "  received to published", false},
                                       {"way_em", "  published to here", false},
                                       {"em_to_publish", "EM measurement to published", true},
                                       {"em_to_here", "EM measurement to here", true}}};

std::string row_text(const Span& span, const std::vector<double>& values, double speed_mm_s) {
  const double p50 = quantile(values, 0.5);
  std::string text =
      fmt::format("  {:<34}{:>9.3f}{:>9.3f}{:>9.3f}{:>9.3f}{:>8}", span.words, p50, quantile(values, 0.9),
                  quantile(values, 0.99), quantile(values, 1), values.size());
  if (span.is_age) text += fmt::format("   {:.3f} mm", p50 / 1000 * speed_mm_s);
  return text + "\n";
}

/// a - b of times that a sample may have made up: wraps instead of overflowing.
std::int64_t difference(std::int64_t a, std::int64_t b) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) - static_cast<std::uint64_t>(b));
}

}  // namespace

void LatencyStatistics::add_span(const char* name, std::int64_t from_ns, std::int64_t to_ns) {
  // As doubles: whatever a sample states, nothing overflows.
  if (from_ns != 0 && to_ns != 0)
    spans_ms_[name].push_back((static_cast<double>(to_ns) - static_cast<double>(from_ns)) / 1e6);
}

void LatencyStatistics::add_image_stages(const TubeSample& sample, std::int64_t here_ns) {
  const tubed_StageStamps& stamps = sample.estimate.stamps;
  add_span("grab", stamps.exposure_monotonic_ns, stamps.image_grabbed_monotonic_ns);
  add_span("wake_frangi", stamps.image_grabbed_monotonic_ns, stamps.frangi_started_monotonic_ns);
  add_span("frangi", stamps.frangi_started_monotonic_ns, stamps.frangi_finished_monotonic_ns);
  add_span("wake_optimizer", stamps.frangi_finished_monotonic_ns, stamps.optimizer_started_monotonic_ns);
  add_span("optimizer", stamps.optimizer_started_monotonic_ns, stamps.optimizer_finished_monotonic_ns);
  add_span("wake_publisher", stamps.optimizer_finished_monotonic_ns, stamps.publish_started_monotonic_ns);
  add_span("way_image", stamps.publish_started_monotonic_ns, here_ns);
  add_span("exposure_to_publish", stamps.exposure_monotonic_ns, stamps.publish_started_monotonic_ns);
  add_span("exposure_to_here", stamps.exposure_monotonic_ns, here_ns);
}

void LatencyStatistics::add_em_stages(const TubeSample& sample, std::int64_t here_ns) {
  const tubed_StageStamps& stamps = sample.estimate.stamps;
  add_span("em_delivery", stamps.em_measured_monotonic_ns, stamps.em_received_monotonic_ns);
  add_span("em_wait", stamps.em_received_monotonic_ns, stamps.publish_started_monotonic_ns);
  add_span("way_em", stamps.publish_started_monotonic_ns, here_ns);
  add_span("em_to_publish", stamps.em_measured_monotonic_ns, stamps.publish_started_monotonic_ns);
  add_span("em_to_here", stamps.em_measured_monotonic_ns, here_ns);
}

void LatencyStatistics::add(const TubeSample& sample, const HostClock& clock) {
  const tubed_TubeEstimate& estimate = sample.estimate;
  const std::int64_t daemons_ns =
      difference(estimate.publish_time_ns, estimate.stamps.publish_started_monotonic_ns);
  clock_ = clock;
  const std::int64_t apart_ns = difference(daemons_ns, clock.realtime_minus_monotonic_ns);
  is_same_host_ = apart_ns < kSameBootNs && apart_ns > -kSameBootNs;
  // "Here" on the daemon's monotonic clock: the same clock on one host, else by both real-time clocks.
  const std::int64_t here_ns =
      is_same_host_ ? sample.received_monotonic_ns : difference(sample.received_monotonic_ns, apart_ns);
  lost_ += sample_count_ > 0 ? sample.lost_before : 0;
  ++sample_count_;
  if (estimate.has_image) {
    ++image_count_;
    add_image_stages(sample, here_ns);
  } else {
    add_em_stages(sample, here_ns);
  }
}

double LatencyStatistics::clock_error_ms() const {
  return is_same_host_ ? 0 : static_cast<double>(clock_.max_error_ns) / 1e6;
}

std::string LatencyStatistics::clock_words() const {
  if (is_same_host_) return "daemon and listener share one monotonic clock: no clock error";
  std::string words = fmt::format(
      "the daemon runs on another host: times until here compare two real-time clocks; this one is right to "
      "{:.1f} ms, the other's error comes on top",
      clock_error_ms());
  if (!clock_.is_synchronised) words += "; NOT SYNCHRONISED here: do not believe times until here";
  const auto way = spans_ms_.find("way_image");
  if (way != spans_ms_.end() && quantile(way->second, 0) < 0) {
    words += fmt::format(
        "; samples came up to {:.3f} ms before they were sent: at least so far are the clocks apart",
        -quantile(way->second, 0));
  }
  return words;
}

json LatencyStatistics::to_json(double speed_mm_s) const {
  json report{{"samples", sample_count_},
              {"with_image", image_count_},
              {"lost", lost_},
              {"clock",
               {{"same_host", is_same_host_},
                {"error_ms", clock_error_ms()},
                {"synchronised", is_same_host_ || clock_.is_synchronised},
                {"words", clock_words()}}},
              {"speed_mm_s", speed_mm_s},
              {"rows", json::array()}};
  for (const Span& span : kSpans) {
    const auto found = spans_ms_.find(span.key);
    if (found == spans_ms_.end()) continue;
    const std::vector<double>& values = found->second;
    json row{{"name", std::string("latency/") + span.key},
             {"unit", "ms"},
             {"n", values.size()},
             {"min", quantile(values, 0)},
             {"p50", quantile(values, 0.5)},
             {"p90", quantile(values, 0.9)},
             {"p99", quantile(values, 0.99)},
             {"max", quantile(values, 1)}};
    if (span.is_age) {
      row["p50_mm"] = quantile(values, 0.5) / 1000 * speed_mm_s;
      row["p99_mm"] = quantile(values, 0.99) / 1000 * speed_mm_s;
    }
    report["rows"].push_back(std::move(row));
  }
  return report;
}

std::string LatencyStatistics::table(double speed_mm_s) const {
  std::string text = fmt::format("  {} samples, {} with an image, {} lost\n  clock: {}\n", sample_count_,
                                 image_count_, lost_, clock_words());
  text += fmt::format("  {:<34}{:>9}{:>9}{:>9}{:>9}{:>8}   at {:g} mm/s\n", "ms", "p50", "p90", "p99", "max",
                      "n", speed_mm_s);
  for (const Span& span : kSpans) {
    const auto found = spans_ms_.find(span.key);
    if (found != spans_ms_.end()) text += row_text(span, found->second, speed_mm_s);
  }
  return text;
}

}  // namespace tubed
