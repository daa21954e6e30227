#include "drivers/simulation/simulated_em_source.hpp"

#include <algorithm>
#include <numbers>

#include "drivers/interface/monotonic_clock.hpp"
#include "drivers/simulation/em_noise.hpp"

namespace tubed {

namespace {

constexpr double kRadPerDeg = std::numbers::pi / 180;

SampleClock em_clock(const DriverSettings& settings) {
  return {from_ns(settings.get<std::int64_t>("epoch_ns")), settings.get<double>("em_rate_hz"),
          settings.get<double>("em_latency_ms")};
}

}  // namespace

SimulatedEmSource::SimulatedEmSource(const RoomDescription& room, const DriverSettings& settings)
    : world_(room, settings),
      clock_(em_clock(settings)),
      T_em_world_(room.T_world_em.inverse()),
      seed_(settings.get<std::int64_t>("seed")),
      lambda_mm_(settings.get<double>("lambda_mm")),
      psi_rad_(settings.get<double>("psi_deg") * kRadPerDeg),
      control_folder_(settings.get<std::string>("control_folder")) {}

OpenResult SimulatedEmSource::open() {
  if (!control_folder_.empty()) {
    OpenResult bound = control_.open(control_folder_, "em.sock");
    if (!bound.ok) {
      return bound;
    }
  }
  next_ = clock_.first_after(monotonic_now());
  is_open_ = true;
  return {true, {}};
}

void SimulatedEmSource::close() noexcept {
  control_.close();
  is_open_ = false;
}

ReadOutcome SimulatedEmSource::read(EmFrame& frame, MonotonicTime deadline) noexcept {
  if (!is_open_) {
    return ReadOutcome::kLost;
  }
  sleep_until(std::max(clock_.due(next_), faults_.stalled_until), deadline);
  const MonotonicTime now = monotonic_now();
  control_.poll(now, faults_);
  next_ = clock_.after_stall(next_, faults_.stalled_until, now);
  if (now < faults_.stalled_until || now < clock_.due(next_)) {
    return ReadOutcome::kTimeout;
  }
  shown_ = faults_.stuck ? shown_ : next_;
  measure(shown_, frame);
  spoil(frame);
  frame.measured = clock_.taken(next_);
  frame.tracker_frame = static_cast<std::uint32_t>(next_);
  frame.received = now;
  ++next_;
  return ReadOutcome::kFrame;
}

void SimulatedEmSource::measure(std::int64_t k, EmFrame& frame) const noexcept {
  frame.origin = Origin::kSimulated;
  frame.coil_count = 0;
  frame.coils.fill(CoilSample{});
  const auto& instruments = world_.room().instruments;
  for (std::size_t instrument = 0; instrument < instruments.size(); ++instrument) {
    for (const CoilPlacement& coil : instruments[instrument].coils) {
      if (coil.sensor >= 1 && coil.sensor <= kMaxTrackerCoils) {
        frame.coils[static_cast<std::size_t>(coil.sensor - 1)] =
            measure_coil(static_cast<int>(instrument), coil, k);
        frame.coil_count = std::max(frame.coil_count, coil.sensor);
      }
    }
  }
}

CoilSample SimulatedEmSource::measure_coil(int instrument, const CoilPlacement& coil,
                                           std::int64_t k) const noexcept {
  const double t_s = world_.seconds(clock_.taken(k));
  const Eigen::Vector3d p_em_mm = T_em_world_ * world_.point(instrument, t_s, coil.offset_from_tip_mm);
  const Eigen::Vector3d tangent_em =
      T_em_world_.linear() * world_.tangent(instrument, t_s, coil.offset_from_tip_mm);
  CounterRandom random(seed_, coil.sensor, k);
  CoilSample sample;
  sample.status = CoilStatus::kOk;
  sample.p_em_mm = noisy_position(p_em_mm, lambda_mm_, random);
  sample.tangent_em = noisy_tangent(tangent_em, psi_rad_, random) * (coil.flipped ? -1 : 1);
  return sample;
}

void SimulatedEmSource::spoil(EmFrame& frame) const noexcept {
  for (std::size_t coil = 0; coil < frame.coils.size(); ++coil) {
    frame.coils[coil].p_em_mm.x() += faults_.outlier_mm[coil];
    if (faults_.lost[coil]) {
      frame.coils[coil] = CoilSample{};
    }
  }
}

}  // namespace tubed
