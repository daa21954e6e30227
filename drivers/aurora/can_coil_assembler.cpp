#include "drivers/aurora/can_coil_assembler.hpp"

#include <algorithm>

namespace tubed::aurora {

namespace {

constexpr std::uint8_t kAllParts = (1U << kClassicParts) - 1;

}  // namespace

CanCoilAssembler::CanCoilAssembler(int coil_count, CanBase base) noexcept
    : base_(base), coil_count_(std::clamp(coil_count, 1, kMaxCanCoils)) {}

std::optional<CanMeasurement> CanCoilAssembler::accept(const CanFrame& frame,
                                                       MonotonicTime received) noexcept {
  if (frame.id == base_.sync()) {
    return accept_sync(frame, received);
  }
  if (is_fd_coil(frame.id, base_)) {
    return accept_fd(frame, received);
  }
  if (is_classic_coil(frame.id, base_)) {
    return accept_classic(frame, received);
  }
  if (frame.id == base_.status()) {
    accept_status(frame);
  } else {
    ++counts_.foreign;
  }
  return std::nullopt;
}

std::optional<CanMeasurement> CanCoilAssembler::expire(MonotonicTime now) noexcept {
  return open_ && now - measurement_.sync_received > kAssemblyTime ? finish() : std::nullopt;
}

std::optional<CanMeasurement> CanCoilAssembler::accept_sync(const CanFrame& frame,
                                                            MonotonicTime received) noexcept {
  const auto sync = unpack_sync(frame, base_);
  if (!sync) {
    ++counts_.bad_frames;
    return std::nullopt;
  }
  const FrameStep step = frames_.observe(sync->frame);
  if (step.kind == FrameKind::kDuplicate || step.kind == FrameKind::kOld) {
    ++(step.kind == FrameKind::kOld ? counts_.old_syncs : counts_.duplicates);
    return std::nullopt;
  }
  auto before = finish();
  counts_.missed += step.missed;
  measurement_ = CanMeasurement{};
  measurement_.sync = *sync;
  measurement_.step = step;
  measurement_.sync_received = received;
  measurement_.last_received = received;
  measurement_.coil_count = coil_count_;
  for (int i = 0; i < coil_count_; ++i) {
    measurement_.coils[static_cast<std::size_t>(i)].coil = i;
  }
  coils_ = {};
  whole_ = 0;
  open_ = true;
  return before;
}

std::optional<CanMeasurement> CanCoilAssembler::accept_fd(const CanFrame& frame,
                                                          MonotonicTime received) noexcept {
  const auto fd = unpack_fd_coil(frame, base_);
  if (!fd) {
    ++counts_.bad_frames;
    return std::nullopt;
  }
  const CanSync& sync = measurement_.sync;
  const bool matches = fd->measurement.frame == sync.frame && fd->measurement.time_us == sync.time_us &&
                       fd->sequence == can_sequence(sync.frame);
  return belongs(fd->coil.coil, matches, received) ? put(fd->coil, received) : std::nullopt;
}

std::optional<CanMeasurement> CanCoilAssembler::accept_classic(const CanFrame& frame,
                                                               MonotonicTime received) noexcept {
  const auto part = unpack_classic_part(frame, base_);
  if (!part) {
    ++counts_.bad_frames;
    return std::nullopt;
  }
  const bool matches = part->sequence == (can_sequence(measurement_.sync.frame) & 0x0F);
  if (!belongs(part->coil, matches, received)) {
    return std::nullopt;
  }
  Coil& coil = coils_[static_cast<std::size_t>(part->coil)];
  const auto bit = static_cast<std::uint8_t>(1U << part->part);
  if ((coil.parts_seen & bit) != 0) {
    ++counts_.duplicates;
    return std::nullopt;
  }
  coil.parts_seen |= bit;
  coil.parts[static_cast<std::size_t>(part->part)] = *part;
  if (coil.parts_seen != kAllParts) {
    return std::nullopt;
  }
  const auto joined = join_classic_parts(coil.parts);
  if (!joined) {
    ++counts_.bad_frames;
    return std::nullopt;
  }
  return put(*joined, received);
}

void CanCoilAssembler::accept_status(const CanFrame& frame) noexcept {
  if (const auto status = unpack_status(frame, base_)) {
    status_ = status;
    ++counts_.statuses;
  } else {
    ++counts_.bad_frames;
  }
}

bool CanCoilAssembler::belongs(int coil, bool matches, MonotonicTime received) noexcept {
  if (coil >= coil_count_) {
    ++counts_.unexpected_coils;
    return false;
  }
  if (!open_ || !matches || received - measurement_.sync_received > kAssemblyTime) {
    ++counts_.unmatched;
    return false;
  }
  if (coils_[static_cast<std::size_t>(coil)].whole) {
    ++counts_.duplicates;
    return false;
  }
  return true;
}

std::optional<CanMeasurement> CanCoilAssembler::put(const CanCoil& coil, MonotonicTime received) noexcept {
  const auto index = static_cast<std::size_t>(coil.coil);
  coils_[index].whole = true;
  measurement_.coils[index] = coil;
  measurement_.last_received = received;
  ++whole_;
  return whole_ == coil_count_ ? finish() : std::nullopt;
}

std::optional<CanMeasurement> CanCoilAssembler::finish() noexcept {
  if (!open_) {
    return std::nullopt;
  }
  open_ = false;
  measurement_.coils_lost = coil_count_ - whole_;
  counts_.lost_coils += static_cast<std::uint64_t>(measurement_.coils_lost);
  for (const Coil& coil : coils_) {
    counts_.partial_coils += !coil.whole && coil.parts_seen != 0 ? 1 : 0;
  }
  if (whole_ == 0) {
    ++counts_.empty;
    return std::nullopt;
  }
  ++counts_.measurements;
  return measurement_;
}

}  // namespace tubed::aurora
