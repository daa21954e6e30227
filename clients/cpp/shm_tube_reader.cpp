#include "clients/cpp/shm_tube_reader.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <ctime>
#include <exception>
#include <iterator>
#include <span>

#include "idl/printable_text.hpp"

namespace tubed {

namespace {

constexpr std::int64_t kMillisecond = 1'000'000;
// The contract's, as DDS subscribers have them (dds_contract.hpp).
constexpr std::int64_t kDeadlineNs = 100 * kMillisecond;
constexpr std::int64_t kLivelinessNs = 250 * kMillisecond;
constexpr std::int64_t kLifespanNs = 200 * kMillisecond;
constexpr std::int64_t kRetryNs = 100 * kMillisecond;
constexpr std::int64_t kTimeoutNs = 300 * kMillisecond;

std::int64_t monotonic_ns() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<std::int64_t>(now.tv_sec) * 1'000'000'000 + now.tv_nsec;
}

/// What a C program would run beyond, or C++ may not read, were it believed.
bool is_sound(const tubed_shm_estimate& estimate) {
  const auto is_bool = [](const bool& value) {
    std::uint8_t byte = 0;
    std::memcpy(&byte, &value, 1);
    return byte <= 1;
  };
  return std::memchr(estimate.instrument_id, '\0', sizeof(estimate.instrument_id)) != nullptr &&
         is_bool(estimate.has_image) && is_bool(estimate.is_image_instant) &&
         estimate.point_count <= std::size(estimate.points) &&
         estimate.coefficient_count <= std::size(estimate.coefficients_mm) &&
         estimate.coil_count <= std::size(estimate.coils) &&
         estimate.view_count <= std::size(estimate.views) &&
         std::all_of(std::begin(estimate.views), std::end(estimate.views),
                     [&](const tubed_shm_view& view) { return is_bool(view.has_own_geometry); });
}

/// Also what comes from a future beyond the lifespan: it would never grow old.
bool is_history(std::int64_t published_ns, std::int64_t now_ns) {
  const auto age_ns = static_cast<std::int64_t>(static_cast<std::uint64_t>(now_ns) -
                                                static_cast<std::uint64_t>(published_ns));
  return age_ns > kLifespanNs || age_ns < -kLifespanNs;
}

}  // namespace

std::string_view name_of(ShmTubeEvent event) {
  switch (event) {
    case ShmTubeEvent::kTimeout:
      return "timeout";
    case ShmTubeEvent::kEstimate:
      return "estimate";
    case ShmTubeEvent::kDeadlineMissed:
      return "deadline missed";
    case ShmTubeEvent::kLivelinessLost:
      return "liveliness lost";
    case ShmTubeEvent::kWriterGone:
      return "writer gone";
  }
  return "unknown";
}

ShmTubeNews ShmTubeReader::wait_for(std::chrono::milliseconds timeout) noexcept {
  const std::int64_t until_ns = monotonic_ns() + std::chrono::nanoseconds(timeout).count();
  for (std::uint32_t skipped = 0; true;) {
    const std::int64_t now_ns = monotonic_ns();
    if (!reader_ && now_ns >= next_try_ns_) {
      connect(now_ns, until_ns);
    }
    const ShmNews ring = reader_ ? reader_->news(now_ns) : ShmNews::kNone;
    ShmTubeNews news;
    if (ring == ShmNews::kSample) {
      if (take(now_ns, news)) {
        return news;
      }
      if (now_ns >= until_ns && ++skipped > kShmMaxSlots) {
        return {};  // a writer that is faster than we can throw away
      }
      continue;
    }
    if (ring == ShmNews::kEnded || ring == ShmNews::kSilent) {
      reader_.reset();
      why_ = ring == ShmNews::kEnded ? "the daemon said goodbye" : "the daemon gives no sign of life";
      next_try_ns_ = now_ns + kRetryNs;
      if (told_ != Told::kLost) {
        return tell(ring == ShmNews::kEnded ? ShmTubeEvent::kWriterGone : ShmTubeEvent::kLivelinessLost);
      }
      continue;
    }
    const ShmTubeEvent event = silence(now_ns);
    if (event != ShmTubeEvent::kTimeout || now_ns >= until_ns) {
      return tell(event);
    }
    const std::int64_t look_ns = next_look_ns(until_ns);
    if (reader_) {
      reader_->sleep_until(look_ns);
    } else {
      const timespec until{static_cast<time_t>(look_ns / 1'000'000'000),
                           static_cast<long>(look_ns % 1'000'000'000)};
      clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr);
    }
  }
}

void ShmTubeReader::connect(std::int64_t now_ns, std::int64_t until_ns) {
  try {
    visit(now_ns, until_ns);
  } catch (const std::exception& error) {
    visit_.reset();
    why_ = error.what();
    next_try_ns_ = now_ns + kRetryNs;
  }
}

/// Goes on from call to call: a reader that waits 1 ms at a time is let in too.
void ShmTubeReader::visit(std::int64_t now_ns, std::int64_t until_ns) {
  if (!visit_) {
    visit_.emplace(settings_.socket, settings_.trusted);
    visit_ends_ns_ = now_ns + kTimeoutNs;
    why_ = "the daemon at '" + settings_.socket + "' has not answered yet";
  }
  const std::int64_t timeout_ns =
      std::max<std::int64_t>(std::min(until_ns, visit_ends_ns_) - now_ns + kMillisecond - 1, 0);
  if (const std::optional<int> descriptor = visit_->answer(static_cast<int>(timeout_ns / kMillisecond))) {
    visit_.reset();
    reader_.emplace(*descriptor, ShmReaderSettings{.path = settings_.socket,
                                                   .content = TUBED_SHM_ESTIMATES,
                                                   .content_version = TUBED_SHM_ESTIMATES_VERSION,
                                                   .trusted = settings_.trusted});
    why_.clear();
  } else if (monotonic_ns() >= visit_ends_ns_) {
    throw ShmError("the daemon at '" + settings_.socket + "' does not answer; it hangs or others besiege it");
  }
}

bool ShmTubeReader::take(std::int64_t now_ns, ShmTubeNews& news) {
  const std::uint64_t lost_before = reader_->lost();
  const ShmSample sample = reader_->take_next();
  lost_ += reader_->lost() - lost_before;
  const auto to = std::as_writable_bytes(std::span(&estimate_, 1));
  if (sample.bytes() != to.size() || !sample.copy(0, to) || !sample.whole() || !is_sound(estimate_) ||
      is_history(sample.published_ns(), now_ns)) {
    ++lost_;
    return false;
  }
  const std::array<char, sizeof(estimate_.instrument_id)> id = std::to_array(estimate_.instrument_id);
  copy_printable(id.data(), estimate_.instrument_id);
  if (!settings_.instrument_id.empty() && settings_.instrument_id != estimate_.instrument_id) {
    return false;
  }
  if (settings_.delivery == ShmDelivery::kNewest && is_superseded(sample.number())) {
    return false;  // on purpose, not lost
  }
  news = {.event = ShmTubeEvent::kEstimate,
          .estimate = &estimate_,
          .received_monotonic_ns = now_ns,
          .lost_before = lost_,
          .is_restart = daemon_start_ != 0 && daemon_start_ != estimate_.daemon_start};
  daemon_start_ = estimate_.daemon_start;
  newest_ns_ = now_ns;
  lost_ = 0;
  told_ = Told::kNothing;
  return true;
}

/// A later sample in the ring is of the same instrument as estimate_.
bool ShmTubeReader::is_superseded(std::uint64_t number) const noexcept {
  const ShmRingReader& ring = reader_->ring();
  // Newest first: as a rule one look is enough. Bounded, whatever the writer says is its newest.
  std::uint64_t later = ring.newest();
  for (std::uint32_t looks = 0; later > number && looks < ring.geometry().slot_count; --later, ++looks) {
    std::array<char, sizeof(estimate_.instrument_id)> id{};
    const ShmSample sample = ring.look(later);
    if (sample.copy(0, std::as_writable_bytes(std::span(id))) && sample.whole() &&
        std::strncmp(id.data(), estimate_.instrument_id, id.size()) == 0) {
      return true;
    }
  }
  return false;
}

ShmTubeNews ShmTubeReader::tell(ShmTubeEvent event) {
  if (event != ShmTubeEvent::kTimeout) {
    told_ = event == ShmTubeEvent::kDeadlineMissed ? Told::kDeadline : Told::kLost;
  }
  ShmTubeNews news;
  news.event = event;
  return news;
}

ShmTubeEvent ShmTubeReader::silence(std::int64_t now_ns) const {
  if (told_ != Told::kLost && now_ns - newest_ns_ >= kLivelinessNs) {
    return ShmTubeEvent::kLivelinessLost;
  }
  if (told_ == Told::kNothing && now_ns - newest_ns_ >= kDeadlineNs) {
    return ShmTubeEvent::kDeadlineMissed;
  }
  return ShmTubeEvent::kTimeout;
}

std::int64_t ShmTubeReader::next_look_ns(std::int64_t until_ns) const {
  std::int64_t look_ns = reader_ ? until_ns : std::min(until_ns, next_try_ns_);
  if (told_ != Told::kLost) {
    look_ns = std::min(look_ns, newest_ns_ + (told_ == Told::kNothing ? kDeadlineNs : kLivelinessNs));
  }
  return look_ns;
}

}  // namespace tubed
