#include "clients/cpp/shm_tube_reader.hpp"

#include <algorithm>
#include <ctime>
#include <exception>
#include <span>

namespace tubed {

namespace {

constexpr std::int64_t kMillisecond = 1'000'000;
// The contract's, as DDS subscribers have them (dds_contract.hpp).
constexpr std::int64_t kDeadlineNs = 100 * kMillisecond;
constexpr std::int64_t kLivelinessNs = 250 * kMillisecond;
constexpr std::int64_t kLifespanNs = 200 * kMillisecond;
constexpr std::int64_t kRetryNs = 100 * kMillisecond;
constexpr std::int64_t kPatienceNs = 300 * kMillisecond;

std::int64_t monotonic_ns() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<std::int64_t>(now.tv_sec) * 1'000'000'000 + now.tv_nsec;
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
      if (now_ns >= until_ns && ++skipped > kShmMostSlots) {
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
  const std::int64_t patience_ns = std::clamp<std::int64_t>(until_ns - now_ns, 0, kPatienceNs);
  try {
    reader_.emplace(ShmReaderSettings{.path = settings_.socket,
                                      .content = TUBED_SHM_ESTIMATES,
                                      .content_version = TUBED_SHM_ESTIMATES_VERSION,
                                      .patience_ms = static_cast<int>(patience_ns / kMillisecond) + 1,
                                      .trusted = settings_.trusted});
    why_.clear();
  } catch (const std::exception& error) {
    why_ = error.what();
    next_try_ns_ = now_ns + kRetryNs;
  }
}

bool ShmTubeReader::take(std::int64_t now_ns, ShmTubeNews& news) {
  const std::uint64_t lost_before = reader_->lost();
  const ShmSample sample =
      settings_.delivery == ShmDelivery::kEvery ? reader_->take_next() : reader_->take_newest();
  // Superseded on purpose is not lost.
  lost_ += settings_.delivery == ShmDelivery::kEvery ? reader_->lost() - lost_before : 0;
  const auto to = std::as_writable_bytes(std::span(&estimate_, 1));
  if (sample.bytes() != to.size() || !sample.copy(0, to) || !sample.whole() ||
      now_ns - sample.published_ns() > kLifespanNs) {
    ++lost_;
    return false;
  }
  estimate_.instrument_id[sizeof(estimate_.instrument_id) - 1] = '\0';
  if (!settings_.instrument_id.empty() && settings_.instrument_id != estimate_.instrument_id) {
    return false;
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
