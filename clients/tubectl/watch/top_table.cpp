#include "clients/tubectl/watch/top_table.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string_view>

#include "clients/tubectl/watch/published_agreement.hpp"
#include "clients/tubectl/watch/sample_text.hpp"
#include "clients/tubectl/watch/status_line.hpp"
#include "idl/printable_text.hpp"
#include "idl/validity.hpp"

namespace tubed {

namespace {

/// Names are unique in a report.
template <typename Stages>
const auto* stage_called(std::string_view name, const Stages& stages, std::uint32_t count) {
  const auto* const end = stages + std::min<std::size_t>(count, std::size(stages));
  const auto* const found = std::find_if(stages, end, [&](const auto& stage) { return name == stage.name; });
  return found == end ? nullptr : found;
}

std::string milliseconds_text(double ms) { return ms < 0 ? "-" : fmt::format("{:.2f}", ms); }

std::string percentiles_text(const tubed_LatencyHistogram& histogram) {
  return fmt::format("{:>8} {:>8} {:>8}", milliseconds_text(quantile_ms(histogram, 0.5)),
                     milliseconds_text(quantile_ms(histogram, 0.9)),
                     milliseconds_text(quantile_ms(histogram, 0.99)));
}

std::string rate_text(std::uint64_t before, std::uint64_t after, double seconds) {
  return seconds > 0 && after >= before ? fmt::format("{:.1f}", static_cast<double>(after - before) / seconds)
                                        : "-";
}

std::string duration_text(std::int64_t now_ns, std::int64_t since_ns) {
  // Neither overflows nor runs backward, whatever a report states.
  const std::int64_t s = since_ns >= 0 && since_ns < now_ns ? (now_ns - since_ns) / 1'000'000'000 : 0;
  if (s < 120) return fmt::format("{}s", s);
  return s < 7200 ? fmt::format("{}min", s / 60) : fmt::format("{}h", s / 3600);
}

std::string stage_line(const tubed_StageStatus& state, const tubed_StageHealth* before,
                       const tubed_StageHealth* after, double seconds, std::int64_t now_ns) {
  std::string line = fmt::format("{:<14} {:<13} {:>6} ", printable_text(state.name),
                                 name_of_stage_state(state.state), duration_text(now_ns, state.since_ns));
  if (after != nullptr) {
    const tubed_StageHealth none{};
    const tubed_StageHealth& earlier = before == nullptr ? none : *before;
    line += fmt::format("{:>8} {:>8} {:>8} {:>8} {:>6} {}", rate_text(earlier.steps, after->steps, seconds),
                        rate_text(earlier.outputs, after->outputs, seconds), after->dropped, after->refused,
                        after->reconnects, percentiles_text(between(earlier.busy, after->busy)));
  }
  return line + (state.why[0] != '\0' ? "  " + printable_text(state.why) : "") + "\n";
}

}  // namespace

tubed_LatencyHistogram between(const tubed_LatencyHistogram& before, const tubed_LatencyHistogram& after) {
  tubed_LatencyHistogram difference = after;
  if (after.count < before.count) {
    return difference;
  }
  difference.count = after.count - before.count;
  for (std::size_t i = 0; i < std::size(after.buckets); ++i) {
    difference.buckets[i] = after.buckets[i] - std::min<std::uint32_t>(before.buckets[i], after.buckets[i]);
  }
  return difference;
}

double quantile_ms(const tubed_LatencyHistogram& histogram, double quantile) {
  double total = 0;
  for (const std::uint32_t count : histogram.buckets) total += count;
  if (total == 0) {
    return -1;
  }
  double counted = 0;
  std::size_t bucket = 0;
  while (counted + histogram.buckets[bucket] < std::max(1.0, std::ceil(quantile * total))) {
    counted += histogram.buckets[bucket++];
  }
  return 1e-3 * std::exp2((static_cast<double>(bucket) + 1) / 4);
}

std::string top_table(const tubed_TubeStatus& status, const tubed_TubeHealth& before,
                      const tubed_TubeHealth& after, const tubed_TubeIdentity* identity) {
  const bool is_continued = before.daemon_start == after.daemon_start && before.time_ns < after.time_ns;
  const double seconds =
      is_continued ? (static_cast<double>(after.time_ns) - static_cast<double>(before.time_ns)) * 1e-9 : 0;
  const tubed_TubeHealth none{};
  const tubed_TubeHealth& earlier = is_continued ? before : none;
  std::string table = fmt::format(
      "{}  {}  {}  newest estimate: {}  {} estimates/s\nexposure to publish  p50 {} ms  p90 {} ms  p99 {} "
      "ms\n",
      printable_text(status.instrument_id), name_of(static_cast<Validity>(status.validity)),
      names_of(Reasons(status.reasons)), age_text(status.estimate_age_ns),
      rate_text(earlier.estimates, after.estimates, seconds),
      milliseconds_text(quantile_ms(between(earlier.exposure_to_publish, after.exposure_to_publish), 0.5)),
      milliseconds_text(quantile_ms(between(earlier.exposure_to_publish, after.exposure_to_publish), 0.9)),
      milliseconds_text(quantile_ms(between(earlier.exposure_to_publish, after.exposure_to_publish), 0.99)));
  if (after.agreement.probability > 0) {
    table += agreement_line(after.agreement, identity) + "\n";
  }
  table += "\n";
  if (Reasons(status.reasons).has(Reason::kRivalWriter)) {
    table += "RIVAL: somebody else publishes this instrument too; tubectl doctor says who\n\n";
  }
  table +=
      fmt::format("{:<14} {:<13} {:>6} {:>8} {:>8} {:>8} {:>8} {:>6} {:>8} {:>8} {:>8}\n", "stage", "state",
                  "for", "steps/s", "out/s", "dropped", "refused", "recon", "p50 ms", "p90 ms", "p99 ms");
  for (std::size_t i = 0; i < std::min<std::size_t>(status.stage_count, std::size(status.stages)); ++i) {
    const char* const name = status.stages[i].name;
    table += stage_line(status.stages[i], stage_called(name, earlier.stages, earlier.stage_count),
                        stage_called(name, after.stages, after.stage_count), seconds, status.time_ns);
  }
  return table;
}

}  // namespace tubed
