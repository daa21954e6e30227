#include "tests/second_aurora/field.hpp"

#include <cmath>
#include <utility>

namespace tubed::second_aurora {

namespace {

constexpr std::uint32_t kCountsPerMeasurement = 8;
// More than report_delay_ns may hold back.
constexpr std::size_t kKept = 64;

bool inside(const Volume& volume, const Pose& pose) {
  return pose.x_mm >= volume.min_x_mm && pose.x_mm <= volume.max_x_mm && pose.y_mm >= volume.min_y_mm &&
         pose.y_mm <= volume.max_y_mm && pose.z_mm >= volume.min_z_mm && pose.z_mm <= volume.max_z_mm;
}

std::int64_t duration_or(const Fault& fault, std::int64_t otherwise_ns) {
  return fault.duration_ns > 0 ? fault.duration_ns : otherwise_ns;
}

}  // namespace

Field::Field(const Settings& settings, Motion motion, Mischief& mischief)
    : settings_(settings), motion_(std::move(motion)), mischief_(mischief) {}

void Field::start(std::int64_t now_ns, std::uint32_t first_frame) {
  start_ns_ = next_ns_ = now_ns;
  tick_ = 0;
  frame_ = first_frame;
  recent_.clear();
  coil_faults_.clear();
  stands_until_ns_ = stuck_until_ns_ = INT64_MIN;
}

const Truth* Field::measure(const PortTable& ports, bool tracking) {
  const std::int64_t now_ns = next_ns_;
  const auto coils = ports.list(HandleQuery::Enabled);
  if (tracking && !counter_stands()) {
    for (const Fault& fault : mischief_.on_measurement()) {
      begin(fault, coils);
    }
  }
  const bool stands = counter_stands();
  ++tick_;
  next_ns_ =
      start_ns_ + std::llround(static_cast<double>(tick_) * 1e9 / settings_.timing.measurements_per_second);
  if (stands || (!tracking && settings_.firmware.counter_stops_with_tstop)) {
    return nullptr;
  }
  const std::uint32_t frame = frame_;
  frame_ += kCountsPerMeasurement;
  if (!tracking) {
    return nullptr;
  }
  Truth truth{count_++, frame, now_ns, {}};
  std::erase_if(coil_faults_, [now_ns](const CoilFault& fault) { return fault.until_ns < now_ns; });
  for (const Handle* handle : coils) {
    const CoilTruth coil = measured(*handle, now_ns);
    truth.coils.push_back(now_ns < stuck_until_ns_ ? before(coil) : coil);
  }
  recent_.push_back(std::move(truth));
  if (recent_.size() > kKept) {
    recent_.pop_front();
  }
  return &recent_.back();
}

CoilTruth Field::measured(const Handle& handle, std::int64_t time_ns) {
  CoilTruth coil{handle.port, handle.channel, CoilState::Valid, motion_(handle.port, handle.channel, time_ns),
                 time_ns};
  if ((handle.tool.broken_coils >> handle.channel & 1u) != 0) {
    coil.state = CoilState::Broken;
  } else if (!generator_plugged_ || std::isnan(coil.pose.x_mm)) {
    coil.state = CoilState::Missing;
  } else if (!inside(settings_.volume, coil.pose)) {
    coil.state = mischief_.uniform() < settings_.volume.missing_share ? CoilState::OutOfVolumeMissing
                                                                      : CoilState::OutOfVolume;
  }
  for (const CoilFault& fault : coil_faults_) {
    if (fault.port == handle.port && fault.channel == handle.channel) {
      coil.state = fault.state;
    }
  }
  if (coil.state == CoilState::OutOfVolume && std::isnan(coil.pose.x_mm)) {
    coil.state = CoilState::OutOfVolumeMissing;
  }
  return coil;
}

CoilTruth Field::before(const CoilTruth& coil) const {
  if (!recent_.empty()) {
    for (const CoilTruth& old : recent_.back().coils) {
      if (old.port == coil.port && old.channel == coil.channel) {
        return old;
      }
    }
  }
  return coil;
}

void Field::begin(const Fault& fault, const std::vector<const Handle*>& coils) {
  const auto coil_fault = [&](CoilState state) {
    if (!coils.empty()) {
      const std::size_t index = fault.parameter > 0
                                    ? static_cast<std::size_t>(fault.parameter - 1) % coils.size()
                                    : mischief_.below(coils.size());
      coil_faults_.push_back(
          {coils[index]->port, coils[index]->channel, state, next_ns_ + duration_or(fault, 0)});
    }
  };
  switch (fault.kind) {
    case FaultKind::CoilMissing:
      return coil_fault(CoilState::Missing);
    case FaultKind::CoilOutOfVolume:
      return coil_fault(CoilState::OutOfVolume);
    case FaultKind::CoilBroken:
      return coil_fault(CoilState::Broken);
    case FaultKind::PosesStuck:
      stuck_until_ns_ = next_ns_ + duration_or(fault, kSecond_ns);
      return;
    case FaultKind::CounterStands:
      stands_until_ns_ = next_ns_ + duration_or(fault, 12 * kSecond_ns);
      return;
    case FaultKind::CounterJumps:
      frame_ +=
          kCountsPerMeasurement * static_cast<std::uint32_t>(fault.parameter != 0 ? fault.parameter : -100);
      return;
    default:
      return;
  }
}

const Truth* Field::newest(std::int64_t now_ns) const {
  for (auto truth = recent_.rbegin(); truth != recent_.rend(); ++truth) {
    if (truth->time_ns + settings_.timing.report_delay_ns <= now_ns) {
      return &*truth;
    }
  }
  return nullptr;
}

void Field::tracking_starts(bool counter_restarts) {
  if (counter_stands()) {
    return;
  }
  recent_.clear();
  if (counter_restarts) {
    frame_ = kCountsPerMeasurement;
  }
}

}  // namespace tubed::second_aurora
