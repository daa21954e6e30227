#include "clients/cpp/tube_subscriber.hpp"

#include <algorithm>
#include <ctime>
#include <list>
#include <string>
#include <vector>

#include "clients/cpp/delay_guard.hpp"
#include "clients/cpp/estimate_connection.hpp"
#include "clients/cpp/instrument_gate.hpp"
#include "clients/cpp/writer_choice.hpp"
#include "idl/dds_contract.hpp"
#include "idl/printable_sample.hpp"
#include "idl/writer_description.hpp"

namespace tubed {
namespace {

constexpr std::int64_t kDeadlineNs = std::chrono::nanoseconds(kEstimateDeadline).count();
constexpr std::int64_t kLivelinessNs = std::chrono::nanoseconds(kEstimateLiveliness).count();
constexpr std::int64_t kNever = DDS_NEVER;
constexpr std::int64_t kLifespanNs = std::chrono::nanoseconds(kEstimateLifespan).count();

std::int64_t monotonic_ns() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<std::int64_t>(now.tv_sec) * 1'000'000'000 + now.tv_nsec;
}

/// For intervals of the other side: goes on while this host sleeps.
std::int64_t boot_ns() {
  timespec now{};
  clock_gettime(CLOCK_BOOTTIME, &now);
  return static_cast<std::int64_t>(now.tv_sec) * 1'000'000'000 + now.tv_nsec;
}

SampleOrigin origin_of(const tubed_TubeEstimate& estimate, std::uint64_t writer) {
  return {.daemon_start = estimate.daemon_start,
          .sequence_number = estimate.sequence_number,
          .publish_monotonic_ns = estimate.stamps.publish_started_monotonic_ns,
          .writer = writer};
}

/// How far the silence of an instrument has been reported.
enum class Told { kNothing, kDeadline, kLost };

/// What is known of one instrument.
struct Tracked {
  Tracked(std::string name, double max_rate_hz) : id(std::move(name)), choice(max_rate_hz) {}

  std::string id;
  WriterChoice choice;
  DelayGuard delay{kLifespanNs};
  TubeSample newest;
  bool has_news = false;
  Told told = Told::kNothing;
  bool is_rival_told = false;
  std::string rival;  ///< the last one told
};

}  // namespace

std::string_view name_of(TubeEvent event) {
  switch (event) {
    case TubeEvent::kTimeout:
      return "timeout";
    case TubeEvent::kEstimate:
      return "estimate";
    case TubeEvent::kDeadlineMissed:
      return "deadline missed";
    case TubeEvent::kLivelinessLost:
      return "liveliness lost";
    case TubeEvent::kWriterGone:
      return "writer gone";
    case TubeEvent::kRivalSeen:
      return "rival writer";
    case TubeEvent::kRivalGone:
      return "rival writer gone";
  }
  return "unknown";
}

class TubeSubscriber::Reception {
 public:
  Reception(const Subscription& subscription, Delivery delivery)
      : subscription_(subscription),
        delivery_(delivery),
        gate_(subscription.instrument_id, subscription.max_instruments),
        connection_(std::make_unique<EstimateConnection>(subscription, gate_, DomainUse::kShared)),
        waitset_(dds_create_waitset(DDS_CYCLONEDDS_HANDLE), "a wait set") {
    be_woken_by(*connection_);
  }

  TubeNews wait_for(std::chrono::milliseconds timeout) {
    const std::int64_t until_ns = monotonic_ns() + std::chrono::nanoseconds(timeout).count();
    forget_replaced();
    while (true) {
      read_statuses();
      take_samples();
      const std::int64_t now_ns = monotonic_ns();
      const TubeNews news = next_news(now_ns);
      if (news.event != TubeEvent::kTimeout || now_ns >= until_ns) {
        return news;
      }
      renew_if_deaf(now_ns);
      const std::int64_t wake_ns = std::min({until_ns, next_silence_ns(), next_renewal_ns()});
      dds_waitset_wait(waitset_.get(), nullptr, 0, std::max<std::int64_t>(wake_ns - monotonic_ns(), 0));
    }
  }

  [[nodiscard]] SubscriberStatus status() const {
    SubscriberStatus status = counts_;
    status.refused_instruments = gate_.refused();
    const std::int64_t now_ns = monotonic_ns();
    const std::int64_t now_boot_ns = boot_ns();
    status.is_alive = !tracked_.empty();
    for (const Tracked& tube : tracked_) {
      const std::int64_t age_ns = now_ns - tube.newest.received_monotonic_ns;
      status.rivals += tube.choice.rival(now_boot_ns) ? 1 : 0;
      status.is_alive = status.is_alive && age_ns < kLivelinessNs && tube.told != Told::kLost;
      status.newest_age_ns = status.newest_age_ns < 0 ? age_ns : std::min(status.newest_age_ns, age_ns);
    }
    return status;
  }

 private:
  void be_woken_by(const EstimateConnection& connection) {
    require_dds(dds_waitset_attach(waitset_.get(), connection.reader().get(), 0), "wait for the reader");
  }

  void read_statuses() {
    const dds_entity_t reader = connection_->reader().get();
    dds_liveliness_changed_status_t liveliness{};
    if (dds_get_liveliness_changed_status(reader, &liveliness) == DDS_RETCODE_OK) {
      writer_hangs_ = liveliness.alive_count == 0 && (writer_hangs_ || liveliness.not_alive_count_change > 0);
    }
    // After liveliness: a writer that says goodbye is lost for both.
    dds_subscription_matched_status_t matched{};
    if (dds_get_subscription_matched_status(reader, &matched) == DDS_RETCODE_OK) {
      writer_gone_ = matched.current_count == 0 && (writer_gone_ || matched.current_count_change < 0);
      counts_.writers = matched.current_count;
      if (matched.current_count_change != 0 || matched.total_count_change != 0) read_matched_writers();
    }
  }

  void read_matched_writers() {
    matched_since_ns_ = monotonic_ns();
    const auto writers = connection_->matched_writers();
    if (!writers) return;
    for (Tracked& tube : tracked_) tube.choice.match(*writers);
  }

  /// Since when nothing was heard of a writer that is matched, over all instruments; far in the future when
  /// none is silent for a reason that a new connection could end.
  [[nodiscard]] std::int64_t silent_since_ns() const {
    if (tracked_.empty()) return counts_.writers > 0 ? matched_since_ns_ : kNever;
    std::int64_t since_ns = kNever;
    for (const Tracked& tube : tracked_) since_ns = std::min(since_ns, writer_heard_ns(tube));
    return since_ns;
  }

  /// When anything of the tube's writer was heard: an instrument that it publishes no more says nothing.
  [[nodiscard]] std::int64_t writer_heard_ns(const Tracked& tube) const {
    if (writer_gone_ || tube.choice.is_followed_gone()) return kNever;
    std::int64_t heard_ns = tube.newest.received_monotonic_ns;
    for (const Tracked& other : tracked_) {
      if (other.choice.followed() == tube.choice.followed()) {
        heard_ns = std::max(heard_ns, other.newest.received_monotonic_ns);
      }
    }
    return heard_ns;
  }

  [[nodiscard]] std::int64_t next_renewal_ns() const {
    const std::int64_t since_ns = silent_since_ns();
    return since_ns == kNever ? kNever : timer_.due_ns(since_ns);
  }

  /// A matched writer is silent: it hangs, or this connection is deaf to it. A second one finds out which.
  void renew_if_deaf(std::int64_t now_ns) {
    if (now_ns < next_renewal_ns()) return;
    timer_.renewed(now_ns);
    try {
      renewed_.reset();
      renewed_ = std::make_unique<EstimateConnection>(subscription_, gate_, DomainUse::kSeparate);
      be_woken_by(*renewed_);
    } catch (const DdsError&) {
      renewed_.reset();  // tried again
    }
  }

  /// Instruments that made room for others, after they had been silent for long.
  void forget_replaced() {
    if (gate_.replaced() == replaced_) return;
    replaced_ = gate_.replaced();
    tracked_.remove_if([&](const Tracked& tube) { return !gate_.has(tube.id); });
  }

  void take_samples() {
    const std::uint64_t accepted_before = counts_.accepted;
    while (take_from(*connection_)) accept_or_refuse();
    if (counts_.accepted != accepted_before) timer_.heard();
    if (renewed_ == nullptr) return;
    if (monotonic_ns() - silent_since_ns() < RenewalTimer::kDeafNs) {
      renewed_.reset();  // the writer said nothing, and says something again
    } else if (take_from(*renewed_)) {
      connection_ = std::move(renewed_);
      ++counts_.renewals;
      read_statuses();
      accept_or_refuse();
    }
  }

  /// One sample into scratch_ and scratch_writer_, if there is one and it can be delivered now.
  bool take_from(EstimateConnection& connection) {
    dds_sample_info_t about{};
    void* buffer = &scratch_;
    while (!(delivery_ == Delivery::kEvery && any_news())) {
      if (dds_take(connection.reader().get(), &buffer, &about, 1, 1) <= 0) return false;
      if (!about.valid_data) continue;
      make_printable(scratch_);
      scratch_writer_ = connection.writer_of(about.publication_handle);
      return true;
    }
    return false;
  }

  void accept_or_refuse() {
    Tracked& tube = tracked(scratch_.instrument_id);
    const std::uint64_t writer = scratch_writer_;
    const SampleOrigin origin = origin_of(scratch_, writer);
    const std::int64_t now_boot_ns = boot_ns();
    const Ruling ruling = tube.choice.judge(origin, now_boot_ns);
    if (!is_delivered(ruling)) {
      ++(ruling == Ruling::kBackward ? counts_.refused_backward
         : ruling == Ruling::kRival  ? counts_.refused_rival
                                     : counts_.refused_implausible);
      return;
    }
    const Delay delay = tube.delay.judge(origin.daemon_start, origin.publish_monotonic_ns, now_boot_ns);
    if (delay != Delay::kUsual) {
      ++(delay == Delay::kLate ? counts_.refused_late : counts_.refused_implausible);
      return;
    }
    tube.choice.accept(origin, ruling, now_boot_ns);
    take(tube, ruling == Ruling::kOtherWriter);
  }

  /// scratch_ is the newest sample of the instrument.
  void take(Tracked& tube, bool is_restart) {
    // Several of them may pass between two deliveries: nothing that was skipped may go uncounted.
    tube.newest.lost_before = (tube.has_news ? tube.newest.lost_before : 0) + tube.choice.lost_before();
    tube.newest.is_restart = (tube.has_news && tube.newest.is_restart) || is_restart;
    tube.newest.estimate = scratch_;
    tube.newest.received_monotonic_ns = monotonic_ns();
    tube.has_news = true;
    tube.told = Told::kNothing;
    writer_hangs_ = false;  // DDS may say so only after it has delivered the sample
    ++counts_.accepted;
    counts_.lost += tube.choice.lost_before();
    counts_.restarts += is_restart ? 1 : 0;
  }

  TubeNews next_news(std::int64_t now_ns) {
    for (Tracked& tube : tracked_) {
      if (tube.has_news) {
        tube.has_news = false;
        return {.event = TubeEvent::kEstimate, .sample = &tube.newest, .instrument_id = tube.id};
      }
    }
    for (Tracked& tube : tracked_) {
      TubeEvent event = silence_of(tube, now_ns);
      if (event == TubeEvent::kTimeout) event = rival_of(tube);
      if (event != TubeEvent::kTimeout) {
        const std::string_view rival = event == TubeEvent::kRivalSeen ? tube.rival : std::string_view();
        return {.event = event, .sample = nullptr, .instrument_id = tube.id, .rival = rival};
      }
    }
    return {};
  }

  /// Tells each rival once, from when it is seen to when it is gone.
  TubeEvent rival_of(Tracked& tube) {
    const auto rival = tube.choice.rival(boot_ns());
    if (rival.has_value() == tube.is_rival_told) return TubeEvent::kTimeout;
    tube.is_rival_told = rival.has_value();
    if (!rival) return TubeEvent::kRivalGone;
    tube.rival = description_of_writer(connection_->reader(), connection_->handle_of(*rival).value_or(0));
    return TubeEvent::kRivalSeen;
  }

  TubeEvent silence_of(Tracked& tube, std::int64_t now_ns) {
    const std::int64_t age_ns = now_ns - tube.newest.received_monotonic_ns;
    if (tube.told == Told::kLost) {
      return TubeEvent::kTimeout;
    }
    if (writer_gone_ || tube.choice.is_followed_gone()) {
      tube.told = Told::kLost;
      return TubeEvent::kWriterGone;
    }
    // DDS may say it late: just after a sample has ended the silence.
    if ((writer_hangs_ && age_ns >= kDeadlineNs) || age_ns >= kLivelinessNs) {
      tube.told = Told::kLost;
      tube.choice.find_silent();
      ++counts_.liveliness_lost;
      return TubeEvent::kLivelinessLost;
    }
    if (tube.told == Told::kNothing && age_ns >= kDeadlineNs) {
      tube.told = Told::kDeadline;
      ++counts_.deadlines_missed;
      return TubeEvent::kDeadlineMissed;
    }
    return TubeEvent::kTimeout;
  }

  /// When the next instrument becomes silent for too long, if nothing comes.
  [[nodiscard]] std::int64_t next_silence_ns() const {
    std::int64_t next_ns = DDS_INFINITY;
    for (const Tracked& tube : tracked_) {
      if (tube.told != Told::kLost) {
        const std::int64_t limit_ns = tube.told == Told::kNothing ? kDeadlineNs : kLivelinessNs;
        next_ns = std::min(next_ns, tube.newest.received_monotonic_ns + limit_ns);
      }
    }
    return next_ns;
  }

  [[nodiscard]] bool any_news() const {
    return std::any_of(tracked_.begin(), tracked_.end(), [](const Tracked& tube) { return tube.has_news; });
  }

  Tracked& tracked(const char* id) {
    for (Tracked& tube : tracked_) {
      if (tube.id == id) {
        return tube;
      }
    }
    return tracked_.emplace_back(id, subscription_.max_rate_hz);
  }

  Subscription subscription_;
  Delivery delivery_;
  InstrumentGate gate_;  // the readers' filter asks it
  std::unique_ptr<EstimateConnection> connection_;
  std::unique_ptr<EstimateConnection> renewed_;  // while the other one is silent
  DdsEntity waitset_;
  RenewalTimer timer_;
  tubed_TubeEstimate scratch_{};
  std::uint64_t scratch_writer_ = 0;
  std::list<Tracked> tracked_;  // a list: news points into it
  std::int64_t matched_since_ns_ = 0;
  std::uint64_t replaced_ = 0;
  bool writer_gone_ = false;
  bool writer_hangs_ = false;
  SubscriberStatus counts_;
};

TubeSubscriber::TubeSubscriber(const Subscription& subscription, Delivery delivery)
    : reception_(std::make_unique<Reception>(subscription, delivery)) {}
TubeSubscriber::~TubeSubscriber() = default;
TubeSubscriber::TubeSubscriber(TubeSubscriber&&) noexcept = default;
TubeSubscriber& TubeSubscriber::operator=(TubeSubscriber&&) noexcept = default;

TubeNews TubeSubscriber::wait_for(std::chrono::milliseconds timeout) { return reception_->wait_for(timeout); }

SubscriberStatus TubeSubscriber::status() const { return reception_->status(); }

}  // namespace tubed
