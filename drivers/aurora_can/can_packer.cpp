#include "drivers/aurora_can/can_packer.hpp"

#include <algorithm>

namespace tubed {

namespace {

/// The newest reading of a handle, nullptr when it is not tracked.
const aurora::HandleReading* reading_of(const aurora::Session& session, std::uint8_t handle) noexcept {
  for (std::size_t i = 0; i < kMaxTrackerCoils; ++i) {
    const aurora::HandleReading& reading = session.poller().newest(i);
    if (reading.handle == handle) {
      return &reading;
    }
  }
  return nullptr;
}

}  // namespace

CanReport can_report(const aurora::Session& session, const EmFrame& frame) noexcept {
  CanReport report;
  report.sync = {frame.tracker_frame, can_time_us(frame.measured)};
  report.system_status = session.poller().system_status();
  report.gateway_error = frame.origin == Origin::kDevice ? 0 : aurora::kCanSimulated;
  aurora::HandleReading absent;
  absent.report = aurora::Report::kDisabled;
  report.coils.fill(absent);
  for (const aurora::FoundCoil& found : session.found()) {
    if (found.plug.port >= 1 && found.plug.port <= 16) {
      report.ports_present = static_cast<std::uint16_t>(report.ports_present | 1U << (found.plug.port - 1));
    }
    const auto coil = session.coils().coil_at(found.plug);
    const aurora::HandleReading* const reading = reading_of(session, found.handle);
    if (coil && found.usable && reading != nullptr) {
      report.coils[static_cast<std::size_t>(*coil)] = *reading;
      report.serial_numbers[static_cast<std::size_t>(*coil)] = found.serial_number;
    }
  }
  return report;
}

aurora::CanTrackerState can_tracker_state(const aurora::Session& session) noexcept {
  switch (session.phase()) {
    case aurora::Session::Phase::kSearch:
      return aurora::CanTrackerState::kNoTracker;
    case aurora::Session::Phase::kTrack:
      return aurora::CanTrackerState::kNotMeasuring;
    default:
      return aurora::CanTrackerState::kStarting;
  }
}

std::uint32_t can_time_us(MonotonicTime time) noexcept {
  constexpr std::int64_t kNsPerUs = 1000;
  return static_cast<std::uint32_t>(to_ns(time) / kNsPerUs);
}

CanPacker::CanPacker(CanLayout layout, int coil_count, aurora::CanBase base) noexcept
    : layout_(layout), coil_count_(std::clamp(coil_count, 1, aurora::kMaxCanCoils)), base_(base) {}

std::span<const aurora::CanFrame> CanPacker::pack(const CanReport& report, MonotonicTime now) noexcept {
  count_ = 0;
  put(aurora::pack_sync(report.sync, base_));
  put(aurora::pack_follow_up({aurora::can_sequence(report.sync.frame), can_time_us(now)}, base_));
  const aurora::CanFrame status = aurora::pack_status(
      {aurora::kCanProtocol, coil_count_, report.system_status, report.ports_present, report.gateway_error},
      base_);
  if (++since_status_ >= kStatusEvery || status.bytes != last_status_.bytes) {
    put(status);
    last_status_ = status;
    last_status_sent_ = now;
    since_status_ = 0;
  }
  for (int coil = 0; coil < coil_count_; ++coil) {
    const auto i = static_cast<std::size_t>(coil);
    if (layout_ == CanLayout::kFd) {
      put(pack_fd_coil(coil, report.coils[i], report.sync, report.system_status, report.serial_numbers[i],
                       base_));
    } else {
      for (const aurora::CanFrame& part : pack_classic_coil(coil, report.coils[i], report.sync, base_)) {
        put(part);
      }
    }
  }
  return {frames_.data(), count_};
}

std::span<const aurora::CanFrame> CanPacker::pack_away(aurora::CanTrackerState state,
                                                       MonotonicTime now) noexcept {
  count_ = 0;
  aurora::CanStatus away;
  away.gateway_error = static_cast<std::uint8_t>(state);
  const aurora::CanFrame status = aurora::pack_status(away, base_);
  const bool is_due = last_status_sent_ == MonotonicTime{} || now - last_status_sent_ >= kStatusPeriod;
  if (is_due || status.bytes != last_status_.bytes) {
    put(status);
    last_status_ = status;
    last_status_sent_ = now;
  }
  return {frames_.data(), count_};
}

}  // namespace tubed
