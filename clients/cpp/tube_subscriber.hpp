// Receives the shape of the tube and, as important, is told when there is none: a subscriber that only waits
// for samples keeps showing the last shape of a daemon that hangs.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string_view>

#include "TubeEstimate.h"
#include "clients/cpp/subscription.hpp"

namespace tubed {

/// What wait_for() came back with. Everything but kEstimate, kTimeout and the two of a rival means: stop
/// showing the last shape as current.
enum class TubeEvent {
  kTimeout,         ///< nothing happened within the time asked for
  kEstimate,        ///< a new shape; look at its validity
  kDeadlineMissed,  ///< no new shape for 100 ms (three periods); said once a gap
  kLivelinessLost,  ///< no new shape for 250 ms, or DDS says the writer hangs or died; said once a gap
  kWriterGone,      ///< the daemon said goodbye
  kRivalSeen,       ///< somebody else publishes this instrument too, see TubeNews::rival; it is not delivered
  kRivalGone,       ///< nobody else does any more
};

/// "estimate", "deadline missed", ...
std::string_view name_of(TubeEvent event);

/// One shape as it arrived.
struct TubeSample {
  tubed_TubeEstimate estimate{};
  std::int64_t received_monotonic_ns = 0;  ///< of this host, when it was taken from DDS
  std::uint64_t lost_before = 0;           ///< sequence numbers missing since the sample before
  bool is_restart = false;  ///< first one of another writer: a restarted daemon, or the one a rival left
};

/// The answer of wait_for().
struct TubeNews {
  TubeEvent event = TubeEvent::kTimeout;
  /// Null unless event is kEstimate, so that an old shape cannot be mistaken for a new one.
  /// Points into the subscriber, until its next call.
  const TubeSample* sample = nullptr;
  std::string_view
      instrument_id{};  ///< the instrument it is about; empty with kTimeout. Until the next call.
  /// With kRivalSeen: who it is, as far as DDS tells: "tubed, process 4711 on host or-3, DDS writer 0110...".
  /// Until the next call.
  std::string_view rival{};
};

/// Counted since construction, over all instruments subscribed to.
struct SubscriberStatus {
  bool is_alive =
      false;  ///< every instrument seen so far sent a shape within the last 250 ms, and one was seen
  std::uint32_t writers = 0;        ///< daemons matched now
  std::int64_t newest_age_ns = -1;  ///< since the newest accepted sample came, -1: never one
  std::uint64_t accepted = 0;
  std::uint64_t lost = 0;                 ///< by sequence number
  std::uint64_t refused_backward = 0;     ///< replayed samples, dropped
  std::uint64_t refused_rival = 0;        ///< of writers that are not followed: a second daemon, a forger
  std::uint64_t refused_implausible = 0;  ///< numbers that outrun rate times time, times ahead of now
  std::uint64_t refused_instruments = 0;  ///< of instruments beyond Subscription::max_instruments
  std::uint32_t rivals = 0;               ///< instruments that somebody else publishes too, now
  std::uint64_t refused_late =
      0;  ///< waited longer than a shape lives, in this host or on the way; dropped, and lost
  std::uint64_t restarts = 0;  ///< changes of the writer that is followed
  std::uint64_t deadlines_missed = 0;
  std::uint64_t liveliness_lost = 0;
  /// Connections made anew because the old one heard nothing of a writer that publishes: somebody sends
  /// damaged or forged packets under the daemon's own DDS identity (estimate_connection.hpp).
  std::uint64_t renewals = 0;
};

/// Which samples wait_for() hands over when several came since the last call.
enum class Delivery {
  kNewest,  ///< the newest of each instrument: what a display wants
  kEvery,   ///< all that the history (32 an instrument) still has: what a recorder wants
};

/// Subscribes to TubeEstimate. Of several writers of one instrument it follows one as long as that is alive,
/// says that there are others, and follows another when that one ended: see writer_choice.hpp. One thread at
/// a time. The times of kDeadlineMissed and kLivelinessLost are measured against accepted samples, so
/// replayed packets do not keep a dead daemon alive. They are noticed inside wait_for().
class TubeSubscriber {
 public:
  /// Throws DdsError: no such network interface, domain out of range, keys that cannot be used.
  explicit TubeSubscriber(const Subscription& subscription, Delivery delivery = Delivery::kNewest);
  ~TubeSubscriber();
  TubeSubscriber(TubeSubscriber&&) noexcept;
  TubeSubscriber& operator=(TubeSubscriber&&) noexcept;

  /// The next thing that happens, at the latest after `timeout`. Never throws.
  TubeNews wait_for(std::chrono::milliseconds timeout);

  /// What has happened already: wait_for(0).
  TubeNews take() { return wait_for(std::chrono::milliseconds{0}); }

  [[nodiscard]] SubscriberStatus status() const;

 private:
  class Reception;
  std::unique_ptr<Reception> reception_;
};

}  // namespace tubed
