#include "drivers/laboratory/aurora_emulator/measurements.hpp"

#include <cmath>
#include <utility>

#include "drivers/aurora/frame_counter.hpp"

namespace tubed::aurora::emulator {

namespace {

constexpr std::uint32_t kOutOfVolumeBit = 1U << 6;
constexpr std::uint32_t kCoilBrokenBit = 1U << 8;

CoilFault lasting(Fault fault) {
  return fault == Fault::kCoilBroken ? CoilFault::kBroken : CoilFault::kOutOfVolume;
}

}  // namespace

Measurements::Measurements(Motion motion, double rate_hz, std::uint32_t first_frame, Faults& faults)
    : motion_(std::move(motion)), period_ns_(1e9 / rate_hz), power_on_frame_(first_frame), faults_(faults) {}

void Measurements::power_on(MonotonicTime now) {
  begin_count(now);
  tracking_ = false;
  have_one_ = false;
  still_until_ = {};
}

void Measurements::begin_count(MonotonicTime now) {
  epoch_ = now;
  epoch_frame_ = power_on_frame_;
}

void Measurements::count_anew(MonotonicTime now) {
  epoch_ = now;
  epoch_frame_ = 0;
}

void Measurements::start(MonotonicTime now) {
  next_ = newest_count(now) + 1;
  tracking_ = true;
  have_one_ = have_one_ && now < still_until_;
}

const Measurement* Measurements::newest(MonotonicTime now) {
  if (!tracking_) {
    return nullptr;
  }
  for (const std::int64_t last = newest_count(now); next_ <= last; ++next_) {
    measure(next_);
  }
  return have_one_ ? &newest_ : nullptr;
}

MonotonicTime Measurements::taken(std::int64_t count) const {
  return epoch_ + std::chrono::nanoseconds(std::llround(static_cast<double>(count) * period_ns_));
}

std::int64_t Measurements::newest_count(MonotonicTime now) const {
  auto count =
      static_cast<std::int64_t>(std::floor(static_cast<double>((now - epoch_).count()) / period_ns_));
  count += taken(count + 1) <= now ? 1 : 0;
  return count - (taken(count) > now ? 1 : 0);
}

void Measurements::measure(std::int64_t count) {
  const MonotonicTime time = taken(count);
  if (time < still_until_) {
    ++taken_altogether_;
    return;
  }
  const std::optional<Fault> fault = faults_.strike_measurement();
  if (strike_counter(fault, time)) {
    take(count, time, fault);
  } else {
    ++taken_altogether_;
  }
}

bool Measurements::strike_counter(std::optional<Fault> fault, MonotonicTime time) {
  const std::uint32_t jump =
      static_cast<std::uint32_t>(faults_.amounts.jump_measurements) * kCountsPerMeasurement;
  if (fault == Fault::kStandstill) {
    still_until_ = time + faults_.amounts.standstill;
    return !have_one_;  // there has to be something to stand still at
  }
  if (fault == Fault::kCountBack) {
    epoch_frame_ -= jump;
  } else if (fault == Fault::kCountOn) {
    epoch_frame_ += jump;
  }
  return true;
}

void Measurements::take(std::int64_t count, MonotonicTime time, std::optional<Fault> fault) {
  const MeasuredCoils measured = motion_(taken_altogether_++, time);
  const MeasuredCoils coils = faults_.conditions.field_generator_present ? measured : MeasuredCoils{};
  const bool stuck = fault == Fault::kStuck && have_one_;
  int struck_sensor = 0;
  if (fault == Fault::kCoilBroken || fault == Fault::kOutOfVolume) {
    int last = 0;
    for (int sensor = 1; sensor <= kMaxTrackerCoils; ++sensor) {
      last = coils[static_cast<std::size_t>(sensor - 1)].status == CoilStatus::kOk ? sensor : last;
    }
    struck_sensor = last == 0 ? 1 : 1 + static_cast<int>(faults_.below(static_cast<std::size_t>(last)));
  }
  newest_.time = time;
  newest_.frame = epoch_frame_ + static_cast<std::uint32_t>(count) * kCountsPerMeasurement;
  for (std::size_t i = 0; i < coils.size(); ++i) {
    const int sensor = static_cast<int>(i) + 1;
    HandleReading& reading = newest_.coils[i];
    if (!stuck) {
      report(coils[i], sensor == struck_sensor ? lasting(*fault) : faults_.coil(sensor), reading);
    }
    reading.frame = newest_.frame;
  }
  have_one_ = true;
  if (on_measurement) {
    on_measurement(newest_);
  }
}

void Measurements::report(const CoilSample& coil, CoilFault fault, HandleReading& reading) const {
  reading = HandleReading{};
  if (coil.status == CoilStatus::kOutOfVolume || fault == CoilFault::kOutOfVolume) {
    reading.port_status.bits |= kOutOfVolumeBit;
  }
  if (fault == CoilFault::kBroken) {
    reading.port_status.bits |= kCoilBrokenBit;
  }
  const bool seen = coil.p_em_mm.allFinite() && coil.tangent_em.allFinite() &&
                    (coil.status == CoilStatus::kOk || coil.status == CoilStatus::kOutOfVolume);
  if (seen && (fault == CoilFault::kNone || fault == CoilFault::kOutOfVolume)) {
    reading.report = Report::kValid;
    reading.rotation = min_rotation(coil.tangent_em.normalized());
    reading.p_em_mm = coil.p_em_mm;
    reading.indicator = std::isfinite(coil.indicator) ? coil.indicator : 0;
  }
}

}  // namespace tubed::aurora::emulator
