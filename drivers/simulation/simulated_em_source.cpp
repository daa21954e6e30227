#include "drivers/simulation/simulated_em_source.hpp"

#include <algorithm>
#include <cmath>

#include "drivers/interface/monotonic_clock.hpp"

namespace tubed {

namespace {

/// Late stamps come from a delay that nobody knows of: what is stamped late is delivered late.
SampleClock em_clock(const DriverSettings& settings, const SimulatedWorld& world) {
  return {from_ns(settings.get<std::int64_t>("epoch_ns")), settings.get<double>("em_rate_hz"),
          settings.get<double>("em_latency_ms") + 1e3 * world.mistakes().em_stamp_error_s()};
}

std::chrono::nanoseconds stamp_error(const SimulatedWorld& world) {
  const Scenario* scenario = world.scenario();
  const double of_preset_s = scenario == nullptr ? 0 : scenario->em_clock_error_s;
  return std::chrono::nanoseconds(std::llround(1e9 * (of_preset_s + world.mistakes().em_stamp_error_s())));
}

}  // namespace

SimulatedEmSource::SimulatedEmSource(const RoomDescription& room, const DriverSettings& settings)
    : world_(room, settings),
      clock_(em_clock(settings, world_)),
      stamp_error_(stamp_error(world_)),
      tracker_(world_, settings, 1 / settings.get<double>("em_rate_hz")),
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

void SimulatedEmSource::wait(MonotonicTime deadline) noexcept {
  if (is_open_) {
    sleep_until(std::max(clock_.due(next_), faults_.stalled_until), deadline);
  }
}

ReadOutcome SimulatedEmSource::read(EmFrame& frame) noexcept {
  if (!is_open_) {
    return ReadOutcome::kLost;
  }
  const MonotonicTime now = monotonic_now();
  control_.poll(now, faults_);
  next_ = clock_.after_stall(next_, faults_.stalled_until, now);
  if (now < faults_.stalled_until || now < clock_.due(next_)) {
    return ReadOutcome::kNothing;
  }
  shown_ = faults_.stuck ? shown_ : next_;
  measure(shown_, frame);
  spoil(frame);
  frame.measured = clock_.taken(next_) + stamp_error_;
  frame.tracker_frame = static_cast<std::uint32_t>(next_);
  frame.received = now;
  ++next_;
  return ReadOutcome::kFrame;
}

void SimulatedEmSource::measure(std::int64_t k, EmFrame& frame) const noexcept {
  frame.origin = Origin::kSimulated;
  frame.coils.fill(CoilSample{});
  frame.coil_count = tracker_.measure_all(world_, k, world_.seconds(clock_.taken(k)), frame.coils);
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
