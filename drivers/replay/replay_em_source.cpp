#include "drivers/replay/replay_em_source.hpp"

#include <exception>

#include "drivers/interface/monotonic_clock.hpp"
#include "drivers/replay/playhead_over.hpp"

namespace tubed {

ReplayEmSource::ReplayEmSource(const DriverSettings& settings)
    : settings_(settings), lease_(settings.get<std::string>("folder"), "") {}

OpenResult ReplayEmSource::open() {
  if (folder_ == nullptr) {
    try {
      folder_ = &lease_.open(settings_.get<std::int64_t>("memory_limit_mb"));
    } catch (const std::exception& error) {
      return {false, error.what()};
    }
    const auto& rows = folder_->sequence.measurements;
    playhead_ = playhead_over(rows, *folder_, settings_);
    numbers_a_lap_ = rows.empty() ? 1 : rows.back().em_frame - rows.front().em_frame + 1;
  }
  is_open_ = true;
  return {true, {}};
}

void ReplayEmSource::wait(MonotonicTime deadline) noexcept {
  if (is_open_ && !playhead_.ended()) {
    sleep_until(playhead_.due(), deadline);
  }
}

ReadOutcome ReplayEmSource::read(EmFrame& frame) noexcept {
  if (!is_open_) {
    return ReadOutcome::kLost;
  }
  if (playhead_.ended()) {
    return ReadOutcome::kEnded;
  }
  if (monotonic_now() < playhead_.due()) {
    return ReadOutcome::kNothing;
  }
  const SequenceMeasurement& measurement = folder_->sequence.measurements[playhead_.row()];
  frame.measured = playhead_.due();
  frame.received = monotonic_now();
  frame.tracker_frame = measurement.em_frame + playhead_.lap() * numbers_a_lap_;
  frame.origin = Origin::kReplayed;
  frame.coil_count = measurement.coil_count;
  frame.coils = measurement.coils;
  playhead_.advance();
  return ReadOutcome::kFrame;
}

}  // namespace tubed
