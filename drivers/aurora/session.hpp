// A conversation with an Aurora over a serial line, from an unknown state of both ends to measurements,
// through everything that goes wrong, and back.
#pragma once

#include <span>

#include "drivers/aurora/complaints.hpp"
#include "drivers/aurora/exchange.hpp"
#include "drivers/aurora/poller.hpp"
#include "drivers/aurora/tracker_search.hpp"
#include "drivers/aurora/tracker_setup.hpp"
#include "drivers/aurora/words.hpp"
#include "drivers/interface/tracker_identity.hpp"

namespace tubed::aurora {

struct SessionSettings {
  BaudRate baud = BaudRate::k115200;  ///< the rate to track at
  PollerSettings poller;
  std::size_t trace_capacity = std::size_t{512} << 10U;  ///< bytes of the wire trace
};

struct SessionCounts {
  std::uint64_t links = 0;        ///< times that the tracker was found
  std::uint64_t link_losses = 0;  ///< times that it fell silent while tracking
  std::uint64_t resets = 0;       ///< times that it said RESET
  std::uint64_t port_setups = 0;  ///< times that the ports were initialised
  std::uint64_t tracking_starts = 0;
  std::uint64_t resumptions = 0;  ///< times that it was found tracking as before the line was interrupted
};

/// One thread. Works in slices: run() goes on for as long as it is given and keeps its place, whatever state
/// the tracker is in; with a deadline in the past it does what is due and blocks for nothing but a serial
/// break and a line that takes no bytes. Never throws; allocates only when it is made.
///
///     find the rate -> INIT -> COMM -> ports -> TSTART -> BX, BX, BX ... -> TSTOP, COMM back
class Session {
 public:
  enum class Event {
    kQuiet,        ///< the deadline has come
    kMeasurement,  ///< the frame was filled
    kRefused,      ///< a reply that cannot be used
    kProblem,      ///< see problem(); run() goes on
    kGone          ///< the channel is gone: attach() another
  };
  enum class Phase {
    kSearch,  ///< TrackerSearch works
    kSetup,   ///< TrackerSetup
    kTrack    ///< Poller
  };

  /// `tools` (and their bytes) have to outlive the session.
  Session(const SessionSettings& settings, const CoilMap& coils, std::span<const ToolDefinition> tools);

  /// A new channel: everything begins anew. It has to outlive the session or the next attach().
  void attach(ByteChannel& channel) noexcept;
  /// Goes on until something happens or `deadline` has come.
  Event run(MonotonicTime deadline, EmFrame& frame) noexcept;
  /// When run() has something to do even if no byte comes until then: to ask, or to give up waiting for a
  /// reply. As of the last run() that gave kQuiet; in the past when there is something to do now.
  [[nodiscard]] MonotonicTime due() const noexcept;
  /// Stops tracking and sets the line back to 9600 baud, so that the next client finds it there. Takes 1.5 s
  /// at most; harmless when there is no channel.
  void close() noexcept;

  /// What is wrong and what to do, after kProblem.
  [[nodiscard]] const Problem& problem() const noexcept { return complaints_.last(); }
  /// What there is to say now, the cause first: while tracking what is lacking, otherwise what is wrong, or
  /// what is being done. Empty when all is well.
  [[nodiscard]] Problem describe() const noexcept;
  [[nodiscard]] Phase phase() const noexcept { return phase_; }
  /// What the tracker and its tools say of themselves, whole: as of the last start of tracking.
  [[nodiscard]] const TrackerIdentity& identity() const noexcept { return identity_; }
  /// "AURORA Rev 008", or empty when the tracker did not say.
  [[nodiscard]] std::string_view firmware() const noexcept { return identity_.firmware.text(); }
  [[nodiscard]] const std::optional<ApiRevision>& api_revision() const noexcept {
    return setup_.questions().api_revision();
  }
  /// Rate of the host's port, bits per second.
  [[nodiscard]] int baud() const noexcept { return exchange_.baud(); }
  /// What is plugged in, as of the last look.
  [[nodiscard]] std::span<const FoundCoil> found() const noexcept { return setup_.ports().found(); }
  /// Which coils of the configuration are not tracked and why; empty when all are. Also those pulled while
  /// tracking.
  [[nodiscard]] Problem missing() const noexcept;
  /// What keeps nothing from being tracked, but somebody may want to know: tools that are not in the
  /// configuration, what the tracker complains of.
  [[nodiscard]] Problem notes() const noexcept;
  [[nodiscard]] const CoilMap& coils() const noexcept { return setup_.ports().coils(); }
  [[nodiscard]] SessionCounts counts() const noexcept;
  [[nodiscard]] const Poller& poller() const noexcept { return poller_; }
  [[nodiscard]] const Exchange& exchange() const noexcept { return exchange_; }
  [[nodiscard]] WireTrace& trace() noexcept { return exchange_.trace(); }

 private:
  Event track(MonotonicTime deadline, EmFrame& frame) noexcept;
  void send_next() noexcept;
  void take(const Reply* reply) noexcept;
  void take_search(const Reply* reply) noexcept;
  void set_up() noexcept;
  void set_up_after_halt(TrackerSetup::Step step) noexcept;
  void start_tracking() noexcept;
  void search_again() noexcept;
  void was_reset() noexcept;
  [[nodiscard]] Problem contradiction() const noexcept;
  [[nodiscard]] Problem describe_tracking() const noexcept;
  bool command_and_wait(const CommandLine& command, std::chrono::nanoseconds timeout) noexcept;

  Exchange exchange_;
  TrackerSearch search_;
  TrackerSetup setup_;
  Poller poller_;
  Complaints complaints_;
  Phase phase_ = Phase::kSearch;
  int idle_starts_ = 0;       ///< of tracking, without a measurement, in a row
  TrackerIdentity identity_;  ///< as of the last start of tracking
  SessionCounts counts_;
};

}  // namespace tubed::aurora
