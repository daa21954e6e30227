// What `tubectl latency` counts: where the time between an exposure and its shape goes, from the stamps in
// the samples. Pure: the clocks come as values.
#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "clients/cpp/tube_subscriber.hpp"

namespace tubed {

/// The clocks of the host that listens.
struct HostClock {
  std::int64_t realtime_minus_monotonic_ns = 0;
  std::int64_t max_error_ns = 0;  ///< the kernel's bound of the real-time clock's error
  bool is_synchronised = false;   ///< somebody (NTP, PTP) disciplines it
};

/// Of one instrument.
class LatencyStatistics {
 public:
  /// Both hosts have booted at the same instant to so much: they are one host, with one monotonic clock.
  static constexpr std::int64_t kSameBootNs = 1'000'000;

  /// `clock` as it was when the sample came.
  void add(const TubeSample& sample, const HostClock& clock);

  [[nodiscard]] bool is_empty() const { return sample_count_ == 0; }
  /// The daemon runs on this host: then latencies until here have no clock error. As of the newest sample.
  [[nodiscard]] bool is_same_host() const { return is_same_host_; }
  /// How wrong latencies until here may be, ms, as far as this host can know: 0 on one host, else the bound
  /// of this host's clock (the daemon's comes on top, it is not told).
  [[nodiscard]] double clock_error_ms() const;

  /// "rows" with name, unit, n, min, p50, p90, p99, max, and "mm" by percentile at `speed_mm_s` for latencies
  /// from a measurement to a place where somebody sees the shape; and what the clock is worth.
  [[nodiscard]] nlohmann::json to_json(double speed_mm_s) const;
  /// The same for people.
  [[nodiscard]] std::string table(double speed_mm_s) const;

 private:
  void add_span(const char* name, std::int64_t from_ns, std::int64_t to_ns);
  void add_image_stages(const TubeSample& sample, std::int64_t here_ns);
  void add_em_stages(const TubeSample& sample, std::int64_t here_ns);
  [[nodiscard]] std::string clock_words() const;

  std::uint64_t sample_count_ = 0;
  std::uint64_t image_count_ = 0;
  std::uint64_t lost_ = 0;
  bool is_same_host_ = false;
  HostClock clock_;
  std::map<std::string, std::vector<double>> spans_ms_;
};

}  // namespace tubed
