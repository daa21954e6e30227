#include "clients/tubectl/see/demo_figures.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "clients/cpp/centreline.hpp"
#include "clients/evaluation/statistics.hpp"
#include "clients/tubectl/run/simulation_settings.hpp"
#include "idl/estimate.hpp"
#include "idl/validity.hpp"

namespace tubed {

namespace {

double ms_between(std::int64_t from_ns, std::int64_t to_ns) {
  return static_cast<double>(to_ns - from_ns) * 1e-6;
}

constexpr float kMaxLength_mm = 10'000;

nlohmann::json quantiles(const std::vector<double>& values) {
  if (values.empty()) {
    return nullptr;
  }
  return {{"p50", quantile(values, 0.5)}, {"p90", quantile(values, 0.9)}, {"p99", quantile(values, 0.99)}};
}

template <typename T>
std::vector<T> last_of(const std::vector<T>& values, std::size_t count) {
  return {values.end() - static_cast<std::ptrdiff_t>(std::min(count, values.size())), values.end()};
}

}  // namespace

DemoFigures::DemoFigures(const Configuration& configuration)
    : world_(configuration.room, *simulation_in(configuration)), camera_(world_.room().cameras.front()) {}

double DemoFigures::exposed_s(std::int64_t valid_time_monotonic_ns) const {
  return world_.seconds(from_ns(valid_time_monotonic_ns)) - world_.mistakes().image_stamp_error_s();
}

SampledCentreline DemoFigures::truth_at(std::int64_t valid_time_monotonic_ns) const {
  const double t_s = exposed_s(valid_time_monotonic_ns);
  SampledCentreline truth;
  constexpr int kLength_mm = 380;
  truth.p_world_mm.resize(3, kLength_mm + 1);
  for (int s = 0; s <= kLength_mm; ++s) {
    truth.s_mm.push_back(s);
    truth.p_world_mm.col(s) = world_.point(0, t_s, s);
  }
  return truth;
}

SampledCentreline DemoFigures::centreline_of(const tubed_TubeEstimate& estimate) {
  SampledCentreline centreline;
  // Whatever a sample states: no more points than any instrument needs.
  if (!has_shape(estimate) || estimate.length_mm > kMaxLength_mm) {
    return centreline;
  }
  const int length = static_cast<int>(estimate.length_mm);
  centreline.p_world_mm.resize(3, length + 1);
  for (int s = 0; s <= length; ++s) {
    const Vector3 p = point_at(estimate, s);
    centreline.s_mm.push_back(s);
    centreline.p_world_mm.col(s) = Eigen::Vector3d(p[0], p[1], p[2]);
  }
  return centreline;
}

void DemoFigures::take(const TubeSample& sample) {
  const tubed_TubeEstimate& estimate = sample.estimate;
  const bool fused = std::string_view(estimate.instrument_id) == "cath-1";
  if (fused) {
    take_times(sample);
  }
  const bool valid =
      estimate.validity == tubed_VALIDITY_VALID || estimate.validity == tubed_VALIDITY_QUESTIONABLE;
  if (!valid || !estimate.is_image_instant) {
    return;
  }
  Camera view = camera_;
  if (world_.view_motion().moves_at_all()) {
    const double t_s = exposed_s(estimate.valid_time_monotonic_ns);
    view.look_from(world_.view(camera_.calibration(), t_s));
  }
  ShapeErrorSettings settings;
  settings.part = JudgedPart::kInView;
  const auto error = shape_error(centreline_of(estimate), truth_at(estimate.valid_time_monotonic_ns),
                                 {camera_, view}, settings);
  if (error) {
    rms_mm_[fused ? 0 : 1].push_back(error->rms_mm);
  }
}

void DemoFigures::take_times(const TubeSample& sample) {
  const tubed_TubeEstimate& estimate = sample.estimate;
  ++validity_[std::string(name_of(static_cast<Validity>(estimate.validity)))];
  for (int bit = 0; bit < kReasonCount; ++bit) {
    if ((estimate.reasons & (1U << bit)) != 0) {
      ++reasons_[std::string(name_of(static_cast<Reason>(1U << bit)))];
    }
  }
  if (received_ns_.empty() && estimate.validity != tubed_VALIDITY_VALID) {
    return;  // figures begin with the first valid shape; until then the daemon is starting
  }
  received_ns_.push_back(sample.received_monotonic_ns);
  lost_ += sample.lost_before;
  const tubed_StageStamps& stamps = estimate.stamps;
  stages_ms_["optimizer"].push_back(
      ms_between(stamps.optimizer_started_monotonic_ns, stamps.optimizer_finished_monotonic_ns));
  stages_ms_["to_publisher"].push_back(
      ms_between(stamps.optimizer_finished_monotonic_ns, stamps.publish_started_monotonic_ns));
  stages_ms_["dds"].push_back(ms_between(stamps.publish_started_monotonic_ns, sample.received_monotonic_ns));
  if (estimate.has_image) {
    latencies_ms_.push_back(ms_between(stamps.exposure_monotonic_ns, sample.received_monotonic_ns));
    stages_ms_["image_source"].push_back(
        ms_between(stamps.exposure_monotonic_ns, stamps.image_grabbed_monotonic_ns));
    stages_ms_["to_frangi"].push_back(
        ms_between(stamps.image_grabbed_monotonic_ns, stamps.frangi_started_monotonic_ns));
    stages_ms_["frangi"].push_back(
        ms_between(stamps.frangi_started_monotonic_ns, stamps.frangi_finished_monotonic_ns));
    stages_ms_["to_optimizer"].push_back(
        ms_between(stamps.frangi_finished_monotonic_ns, stamps.optimizer_started_monotonic_ns));
  }
}

void DemoFigures::take(const tubed_TubeHealth& health) {
  if (std::string_view(health.instrument_id) != "cath-1" || received_ns_.size() < 30) {
    return;
  }
  if (!first_health_) {
    first_health_ = std::make_unique<tubed_TubeHealth>(health);
  }
  newest_health_ = std::make_unique<tubed_TubeHealth>(health);
}

std::optional<double> DemoFigures::newest_rms_mm(std::size_t instrument) const {
  return rms_mm_[instrument].empty() ? std::nullopt : std::optional(rms_mm_[instrument].back());
}

double DemoFigures::recent_rate_hz(std::size_t window) const {
  const auto times = last_of(received_ns_, window);
  return times.size() < 2 ? 0
                          : static_cast<double>(times.size() - 1) /
                                (static_cast<double>(times.back() - times.front()) * 1e-9);
}

double DemoFigures::latency_ms(double q, std::size_t window) const {
  const auto latencies = last_of(latencies_ms_, window);
  return latencies.empty() ? std::nan("") : quantile(latencies, q);
}

nlohmann::json DemoFigures::summary() const {
  nlohmann::json report;
  report["samples"] = received_ns_.size();
  report["rate_hz"] = recent_rate_hz(received_ns_.size());
  report["latency_ms"] = quantiles(latencies_ms_);
  for (const auto& [stage, values] : stages_ms_) {
    report["stages_ms"][stage] = quantiles(values);
  }
  report["rms_mm"] = {
      {"fused", rms_mm_[0].empty() ? nlohmann::json() : nlohmann::json(quantile(rms_mm_[0], 0.5))},
      {"em", rms_mm_[1].empty() ? nlohmann::json() : nlohmann::json(quantile(rms_mm_[1], 0.5))}};
  report["validity"] = validity_;
  report["reasons"] = reasons_;
  report["events"] = events_;
  report["lost"] = lost_;
  report["allocations_per_frame"] = nlohmann::json::object();
  if (!first_health_) {
    return report;
  }
  for (std::size_t i = 0; i < std::min<std::size_t>(newest_health_->stage_count, kMaxStages); ++i) {
    const tubed_StageHealth& first = first_health_->stages[i];
    const tubed_StageHealth& newest = newest_health_->stages[i];
    const auto steps = static_cast<double>(newest.steps - first.steps);
    const auto per_frame = [steps](std::uint64_t before, std::uint64_t after) {
      return steps > 0 ? nlohmann::json(static_cast<double>(after - before) / steps) : nlohmann::json();
    };
    if (newest.allocations_counted) {
      report["allocations_per_frame"][newest.name] = per_frame(first.allocations, newest.allocations);
      report["locks_per_frame"][newest.name] = per_frame(first.locks, newest.locks);
      report["exceptions"][newest.name] = newest.exceptions - first.exceptions;
    }
    report["dropped"][newest.name] = newest.dropped;
  }
  return report;
}

}  // namespace tubed
