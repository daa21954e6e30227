#include "drivers/aurora_can/aurora_can_source.hpp"

#include <algorithm>

#include "drivers/aurora/coil_map.hpp"
#include "drivers/aurora_can/aurora_can_driver.hpp"
#include "drivers/interface/monotonic_clock.hpp"

namespace tubed {

namespace {

using std::chrono::milliseconds;

constexpr milliseconds kBetweenTries{100};
/// Without a measurement for so long it is said what is missing.
constexpr milliseconds kSilence{1000};
/// A gateway says at least once a second whether its tracker is an emulated one. One that does not say
/// anything for so long has no STATUS.
constexpr milliseconds kTimeoutForStatus{1500};
/// A gateway that says nothing for so long is not there: it sends STATUS once a second.
constexpr milliseconds kStatusLasts{2500};
constexpr milliseconds kFollowUpsLast{4000};
constexpr int kMaxFramesAtOnce = 64;
/// What was lost is talked of for so long.
constexpr milliseconds kLossesLast{5000};

std::chrono::nanoseconds from_ms(double ms) {
  return std::chrono::nanoseconds(static_cast<std::int64_t>(ms * 1e6));
}

}  // namespace

AuroraCanSource::AuroraCanSource(const RoomDescription& room, const DriverSettings& settings,
                                 std::unique_ptr<CanPort> port)
    : port_(std::move(port)),
      latency_(from_ms(settings.get<double>("latency_ms"))),
      base_(can_base_of(settings)),
      coil_count_(std::clamp(aurora::CoilMap(room).coil_count(), 1, kMaxTrackerCoils)),
      assembler_(coil_count_, base_) {
  for (const CoilPlacement& coil : tracked_coils(room)) {
    if (coil.sensor >= 1 && coil.sensor <= kMaxTrackerCoils) {
      used_[static_cast<std::size_t>(coil.sensor - 1)] = true;
    }
  }
}

OpenResult AuroraCanSource::open() {
  next_try_ = {};
  return {true, {}};
}

bool AuroraCanSource::open_port(MonotonicTime now) noexcept {
  if (now < next_try_) {
    return false;
  }
  next_try_ = now + kBetweenTries;
  const int error = port_->open();
  if (error == 0) {
    silent_since_ = now;
    troubled_ = assembling_ = is_off_ = false;
    counts_when_silent_ = assembler_.counts();
    return true;
  }
  not_measuring(aurora::Problem(port_->name()) << " " << port_->describe(error));
  return false;
}

MonotonicTime AuroraCanSource::whole_until() const noexcept {
  return sync_received_ + aurora::CanCoilAssembler::kAssemblyTime + std::chrono::nanoseconds(1);
}

void AuroraCanSource::wait(MonotonicTime deadline) noexcept {
  if (!port_->is_open()) {
    sleep_until(next_try_, deadline);
    return;
  }
  const MonotonicTime until = assembling_ ? std::min(deadline, whole_until()) : deadline;
  port_->wait(std::min(until, silent_since_ + kSilence));
}

ReadOutcome AuroraCanSource::read(EmFrame& frame) noexcept {
  if (!port_->is_open() && !open_port(monotonic_now())) {
    return ReadOutcome::kNothing;
  }
  for (int frames = 0; frames < kMaxFramesAtOnce; ++frames) {
    const CanArrival arrival = port_->read(MonotonicTime{});
    ReadOutcome outcome = take(arrival, frame);
    if (outcome == ReadOutcome::kNothing && port_->is_open() && monotonic_now() - silent_since_ >= kSilence) {
      outcome = silent();
    }
    if (outcome != ReadOutcome::kNothing || arrival.kind == CanArrival::Kind::kNothing || !port_->is_open()) {
      return outcome;
    }
  }
  return ReadOutcome::kNothing;  // wait() ends at once: there is more
}

ReadOutcome AuroraCanSource::take(const CanArrival& arrival, EmFrame& frame) noexcept {
  switch (arrival.kind) {
    case CanArrival::Kind::kNothing:
      return take_nothing(frame);
    case CanArrival::Kind::kFrame:
      return take_frame(arrival, frame);
    case CanArrival::Kind::kErrorFrame:
      return take_trouble(arrival.trouble);
    case CanArrival::Kind::kUnreadable:
      ++counts_.unreadable;
      return ReadOutcome::kRefused;
    case CanArrival::Kind::kGone:
      break;
  }
  return lose_port(arrival.error);
}

ReadOutcome AuroraCanSource::take_nothing(EmFrame& frame) noexcept {
  const MonotonicTime now = monotonic_now();
  const auto measurement = assembler_.expire(now);
  assembling_ = assembling_ && now < whole_until();
  return measurement ? hand_on(*measurement, now, frame) : ReadOutcome::kNothing;
}

ReadOutcome AuroraCanSource::take_frame(const CanArrival& arrival, EmFrame& frame) noexcept {
  if (arrival.frame.id == base_.follow_up()) {
    return take_follow_up(arrival);
  }
  if (const auto sync = aurora::unpack_sync(arrival.frame, base_)) {
    sync_sequence_ = aurora::can_sequence(sync->frame);
    sync_received_ = arrival.received;
    assembling_ = true;
  }
  const std::uint64_t bad_before = assembler_.counts().bad_frames;
  const std::uint64_t statuses_before = assembler_.counts().statuses;
  if (const auto measurement = assembler_.accept(arrival.frame, arrival.received)) {
    assembling_ = arrival.frame.id == base_.sync();  // which ended the one before
    return hand_on(*measurement, arrival.received, frame);
  }
  if (assembler_.counts().statuses != statuses_before) {
    status_received_ = arrival.received;
  }
  return assembler_.counts().bad_frames != bad_before ? ReadOutcome::kRefused : ReadOutcome::kNothing;
}

// The stamp of the SYNC counts: this frame comes behind it.
ReadOutcome AuroraCanSource::take_follow_up(const CanArrival& arrival) noexcept {
  const auto follow_up = aurora::unpack_follow_up(arrival.frame, base_);
  if (!follow_up) {
    return ReadOutcome::kRefused;
  }
  if (!assembling_ || follow_up->sequence != sync_sequence_) {
    return ReadOutcome::kNothing;
  }
  if (arrival.received > follow_up_until_) {
    clock_.reset();  // until now it was learned from other times
  }
  follow_up_until_ = arrival.received + kFollowUpsLast;
  clock_.observe(follow_up->sent_us, sync_received_);
  return ReadOutcome::kNothing;
}

MonotonicTime AuroraCanSource::measured(const aurora::CanMeasurement& measurement) noexcept {
  const std::uint32_t time_us = measurement.sync.time_us;
  const MonotonicTime received = measurement.sync_received;
  const bool follows_up = received < follow_up_until_;
  if (!follows_up) {
    clock_.observe(time_us, received);
  }
  const MonotonicTime time = clock_.at(time_us, received) - (follows_up ? milliseconds(0) : latency_);
  return std::max(time, last_measured_ + std::chrono::microseconds(1));
}

// A gateway sends STATUS behind its first SYNC, also the first after its tracker was away; a receiver that
// joins later or has lost it waits for the next one, because nothing else says that a tracker is an emulated
// one.
bool AuroraCanSource::origin_known(MonotonicTime now) noexcept {
  if (assembler_.status() && assembler_.status()->is_measuring()) {
    heard_since_ = {};
    return true;
  }
  if (heard_since_ == MonotonicTime{}) {
    heard_since_ = now;
  }
  return now - heard_since_ > kTimeoutForStatus;
}

ReadOutcome AuroraCanSource::hand_on(const aurora::CanMeasurement& measurement, MonotonicTime now,
                                     EmFrame& frame) noexcept {
  const auto& status = assembler_.status();
  const bool simulated = status && status->is_simulated();
  EmFrame made;
  made.measured = measured(measurement);
  made.received = measurement.last_received;
  made.tracker_frame = measurement.sync.frame;
  made.origin = simulated ? Origin::kSimulated : Origin::kDevice;
  made.coil_count = measurement.coil_count;
  for (std::size_t i = 0; i < static_cast<std::size_t>(made.coil_count); ++i) {
    made.coils[i] = aurora::coil_sample(measurement.coils[i]);
    disabled_[i] = made.coils[i].status == CoilStatus::kDisabled;
  }
  look_at_losses(now);
  silent_since_ = now;
  troubled_ = is_off_ = false;
  counts_when_silent_ = assembler_.counts();
  if (!origin_known(now)) {
    return ReadOutcome::kNothing;
  }
  if (!guard_.believe(made)) {
    ++counts_.leaps;
    return ReadOutcome::kRefused;
  }
  last_measured_ = made.measured;
  frame = made;
  measures_ = has_measured_ = true;
  trouble_.clear();
  return ReadOutcome::kFrame;
}

AuroraCanSource::Losses AuroraCanSource::losses() const noexcept {
  const auto& seen = assembler_.counts();
  return {seen.lost_coils, seen.missed, counts().overflowed};
}

void AuroraCanSource::look_at_losses(MonotonicTime now) noexcept {
  const Losses newest = losses();
  if (newest == losses_) {
    return;
  }
  losses_at_beginning_ = now < losing_until_ ? losses_at_beginning_ : losses_;
  losses_ = newest;
  losing_until_ = now + kLossesLast;
}

SourceCondition AuroraCanSource::condition() noexcept {
  SourceCondition condition;
  condition.state = measures_       ? DeviceState::kRunning
                    : has_measured_ ? DeviceState::kReconnecting
                                    : DeviceState::kStarting;
  condition.words = measures_ ? losses_and_lacks() : trouble_;
  return condition;
}

// In the order in which a person has to look: coils that the gateway does not send are counted as lost, too.
aurora::Problem AuroraCanSource::losses_and_lacks() const noexcept {
  aurora::Problem words;
  const auto since = [](std::uint64_t newest, std::uint64_t beginning) {
    return static_cast<int>(std::min<std::uint64_t>(newest - beginning, 999'999'999));
  };
  const auto& status = assembler_.status();
  if (status && status->is_measuring() && status->coil_count < coil_count_) {
    return words << port_->name() << ": the gateway sends " << status->coil_count
                 << " coils, the configuration has sensors up to " << coil_count_;
  }
  if (sync_received_ < losing_until_) {
    const int coils = since(losses_.coils, losses_at_beginning_.coils);
    const int measurements = since(losses_.measurements, losses_at_beginning_.measurements);
    const int overflowed = since(losses_.overflowed, losses_at_beginning_.overflowed);
    if (overflowed > 0) {
      words << port_->name() << ": " << overflowed << " frames thrown away here, read too late";
    } else if (coils + measurements > 0) {
      words << port_->name() << " loses frames: " << coils << " coils, " << measurements
            << " measurements did not come whole";
    }
    return words;
  }
  for (std::size_t i = 0; i < static_cast<std::size_t>(coil_count_); ++i) {
    if (used_[i] && disabled_[i]) {
      words << (words.empty() ? "not plugged in at the gateway: sensor " : ", sensor ")
            << static_cast<int>(i + 1);
    }
  }
  return words;
}

ReadOutcome AuroraCanSource::take_trouble(const CanTrouble& trouble) noexcept {
  ++counts_.error_frames;
  last_trouble_ = trouble;
  troubled_ = true;
  counts_.overflowed += trouble.receive_overflow ? 1 : 0;
  if (trouble.restarted) {
    ++counts_.restarts;
    is_off_ = false;
  }
  if (!trouble.bus_off) {
    return ReadOutcome::kNothing;
  }
  ++counts_.bus_offs;
  is_off_ = true;
  return not_measuring(bus_off());
}

aurora::Problem AuroraCanSource::bus_off() const noexcept {
  CanTrouble off;
  off.bus_off = true;
  aurora::Problem problem(port_->name());
  if (counts_.restarts > 0) {
    problem << ", restarted " << static_cast<int>(counts_.restarts) << " times,";
  }
  return problem << " " << describe(off);
}

bool AuroraCanSource::tracker_is_away(MonotonicTime now) const noexcept {
  const auto& status = assembler_.status();
  return status && !status->is_measuring() && now - status_received_ < kStatusLasts;
}

ReadOutcome AuroraCanSource::silent() noexcept {
  const auto& now = assembler_.counts();
  const auto& before = counts_when_silent_;
  silent_since_ = monotonic_now();
  if (is_off_) {
    return not_measuring(bus_off());  // which is why nothing comes
  }
  aurora::Problem problem(port_->name());
  if (tracker_is_away(silent_since_)) {
    problem << ": the gateway " << describe(assembler_.status()->tracker_state());
  } else if (troubled_) {
    problem << " " << describe(last_trouble_);
  } else if (now.bad_frames > before.bad_frames) {
    problem << ": the check sums or sizes of all frames are wrong: is the gateway of another version?";
  } else if (now.empty > before.empty) {
    problem << ": measurements come without coils: CAN FD frames to a port that takes classic ones only?";
  } else if (now.duplicates + now.old_syncs > before.duplicates + before.old_syncs) {
    problem << ": the gateway repeats one measurement: the tracker does not measure";
  } else {
    problem
        << " carries no measurements: is `tubectl can-gateway` running, and the tracker on? Have both ends "
           "the same bit rates and base_id?";
  }
  counts_when_silent_ = now;
  troubled_ = false;
  return not_measuring(problem);
}

ReadOutcome AuroraCanSource::lose_port(int error) noexcept {
  port_->close();
  next_try_ = monotonic_now() + kBetweenTries;  // the words below are said until then
  aurora::Problem problem(port_->name());
  problem << " " << port_->describe(error);
  return not_measuring(problem);
}

ReadOutcome AuroraCanSource::not_measuring(const aurora::Problem& problem) noexcept {
  trouble_ = problem;
  measures_ = false;
  return ReadOutcome::kNothing;
}

void AuroraCanSource::close() noexcept {
  port_->close();
  measures_ = false;
}

AuroraCanCounts AuroraCanSource::counts() const noexcept {
  AuroraCanCounts counts = counts_;
  counts.overflowed += port_->overflowed();
  return counts;
}

}  // namespace tubed
