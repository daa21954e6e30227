// What `tubectl stat` counts over a stretch of a stream of estimates. Pure: time comes as a value.
#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "clients/cpp/tube_subscriber.hpp"

namespace tubed {

/// p50, p90 and p99 of something, by nearest rank.
struct Percentiles {
  double p50 = 0;
  double p90 = 0;
  double p99 = 0;
};

/// Nearest rank: the smallest value that at least p percent of all do not exceed. Empty without values.
std::optional<Percentiles> percentiles_of(std::vector<double> values);

/// Of one instrument.
class StreamStatistics {
 public:
  void add(const TubeSample& sample);
  void add(TubeEvent event);

  /// Samples a second between the first and the last one; 0 with fewer than two.
  [[nodiscard]] double rate_hz() const;

  /// rate_hz, samples, lost, latency_ms of exposure and em, interval_ms.max, validity by word, reasons,
  /// events.
  [[nodiscard]] nlohmann::json to_json() const;

  /// The same as a table.
  [[nodiscard]] std::string table() const;

 private:
  std::uint64_t samples_ = 0;
  std::uint64_t lost_ = 0;
  std::uint64_t restarts_ = 0;
  std::int64_t first_received_ns_ = 0;
  std::int64_t last_received_ns_ = 0;
  std::int64_t max_interval_ns_ = 0;
  std::vector<double>
      exposure_latencies_ms_;            ///< mid exposure to here, samples with an image of their instant
  std::vector<double> em_latencies_ms_;  ///< newest EM measurement to here, the other samples
  std::map<std::string, std::uint64_t> validity_;
  std::map<std::string, std::uint64_t> reasons_;
  std::map<std::string, std::uint64_t> events_;
};

}  // namespace tubed
