// Receives the shape of the tube from a daemon on the same machine through shared memory, and is told when
// there is none. Needs no DDS; beside it tube_subscriber.hpp, which works across machines.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "idl/shm_reader.hpp"

namespace tubed {

/// What wait_for() came back with. Everything but kEstimate and kTimeout means: stop showing the last shape
/// as current.
enum class ShmTubeEvent {
  kTimeout,         ///< nothing happened within the time asked for
  kEstimate,        ///< a new shape; look at its validity
  kDeadlineMissed,  ///< no new shape for 100 ms (three periods); said once a gap
  kLivelinessLost,  ///< no new shape for 250 ms: the daemon hangs or died; said once a gap
  kWriterGone,      ///< the daemon said goodbye
};

/// "estimate", "deadline missed", ... as TubeEvent is named.
std::string_view name_of(ShmTubeEvent event);

/// Which samples wait_for() hands over when several came since the last call: all that the ring still has, or
/// of each instrument the newest.
enum class ShmDelivery { kNewest, kEvery };

struct ShmTubeReaderSettings {
  std::string socket;         ///< [shm] estimates_socket of the daemon
  std::string instrument_id;  ///< empty: every instrument
  ShmDelivery delivery = ShmDelivery::kNewest;
  std::vector<uid_t>
      trusted;  ///< users the daemon may run as; empty: any user that can create a socket there
};

/// The answer of wait_for().
struct ShmTubeNews {
  ShmTubeEvent event = ShmTubeEvent::kTimeout;
  /// Null unless event is kEstimate. Points into the reader, until its next call.
  const tubed_shm_estimate* estimate = nullptr;
  std::int64_t received_monotonic_ns = 0;
  std::uint64_t lost_before = 0;  ///< samples of the ring never seen since the estimate before
  bool is_restart = false;        ///< first one of another start of the daemon
};

/// One thread at a time. Connects inside wait_for(), again and again: the daemon may start later and more
/// than once. A sample that was published more than 200 ms ago is history, counts as lost and is not handed
/// over; nor is one that contradicts itself: every count of a sample handed over is within its array.
class ShmTubeReader {
 public:
  explicit ShmTubeReader(ShmTubeReaderSettings settings) : settings_(std::move(settings)) {}

  /// The next thing that happens, at the latest after `timeout`. Never throws.
  ShmTubeNews wait_for(std::chrono::milliseconds timeout) noexcept;
  /// Why it is not connected, in words; empty when it is.
  [[nodiscard]] const std::string& why() const { return why_; }

 private:
  enum class Told { kNothing, kDeadline, kLost };

  void connect(std::int64_t now_ns, std::int64_t until_ns);
  void visit(std::int64_t now_ns, std::int64_t until_ns);
  bool take(std::int64_t now_ns, ShmTubeNews& news);
  [[nodiscard]] bool is_superseded(std::uint64_t number) const noexcept;
  ShmTubeNews tell(ShmTubeEvent event);
  [[nodiscard]] ShmTubeEvent silence(std::int64_t now_ns) const;
  [[nodiscard]] std::int64_t next_look_ns(std::int64_t until_ns) const;

  ShmTubeReaderSettings settings_;
  std::optional<ShmVisit> visit_;  ///< while the daemon has not answered yet
  std::int64_t visit_ends_ns_ = 0;
  std::optional<ShmReader> reader_;
  std::string why_ = "not tried yet";
  std::int64_t next_try_ns_ = 0;
  tubed_shm_estimate estimate_{};
  std::int64_t newest_ns_ = 0;      ///< when the newest sample came
  std::uint64_t daemon_start_ = 0;  ///< of it; 0: never one
  std::uint64_t lost_ = 0;          ///< since it
  Told told_ = Told::kLost;
};

}  // namespace tubed
