// What a demonstration measures at the subscriber: rate, latency, error against the simulation's truth.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "TubeHealth.h"
#include "clients/cpp/tube_subscriber.hpp"
#include "clients/evaluation/shape_error.hpp"
#include "daemon/config/configuration.hpp"
#include "drivers/laboratory/simulated_world.hpp"

namespace tubed {

/// Collects figures of two instruments of one demonstration: index 0 is fused, index 1 the coils alone. One
/// thread.
class DemoFigures {
 public:
  /// `configuration`: the daemon's own, from which the same simulated world is made.
  explicit DemoFigures(const Configuration& configuration);

  void take(const TubeSample& sample);
  void take(const tubed_TubeHealth& health);
  void count_event(TubeEvent event) { ++events_[std::string(name_of(event))]; }

  /// The true centreline when the image of an estimate was exposed, whatever its stamp says.
  [[nodiscard]] SampledCentreline truth_at(std::int64_t valid_time_monotonic_ns) const;
  /// The estimated one, every 1 mm; empty without a shape.
  static SampledCentreline centreline_of(const tubed_TubeEstimate& estimate);

  /// Newest error of each, mm, nothing before the first.
  [[nodiscard]] std::optional<double> newest_rms_mm(std::size_t instrument) const;
  /// Of the fused instrument over the last `window` samples.
  [[nodiscard]] double recent_rate_hz(std::size_t window = 60) const;
  [[nodiscard]] double latency_ms(double quantile, std::size_t window = 300) const;
  [[nodiscard]] std::size_t samples() const { return received_ns_.size(); }

  /// The summary: rate_hz, latency_ms, stages_ms, rms_mm, validity, allocations_per_frame, ...
  [[nodiscard]] nlohmann::json summary() const;
  [[nodiscard]] const Camera& camera() const { return camera_; }

 private:
  void take_times(const TubeSample& sample);
  /// The world's time at which the image with that stamp was exposed.
  [[nodiscard]] double exposed_s(std::int64_t valid_time_monotonic_ns) const;

  SimulatedWorld world_;
  Camera camera_;
  std::vector<std::int64_t> received_ns_;  ///< of the fused instrument
  std::vector<double> latencies_ms_;       ///< exposure to subscriber, image-bearing
  std::map<std::string, std::vector<double>> stages_ms_;
  std::array<std::vector<double>, 2> rms_mm_;  ///< at instants with an image
  std::map<std::string, int> validity_;
  std::map<std::string, int> reasons_;
  std::map<std::string, int> events_;
  std::uint64_t lost_ = 0;
  std::unique_ptr<tubed_TubeHealth> first_health_;  ///< the first one a second after the first valid shape
  std::unique_ptr<tubed_TubeHealth> newest_health_;
};

}  // namespace tubed
