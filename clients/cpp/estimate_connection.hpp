// The DDS reader of TubeEstimate, and everything that Cyclone DDS remembers for it.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "TubeEstimate.h"
#include "clients/cpp/instrument_gate.hpp"
#include "clients/cpp/subscription.hpp"
#include "idl/dds_entity.hpp"

namespace tubed {

/// Whether a connection shares the DDS domain of the process with its other participants.
enum class DomainUse { kShared, kSeparate };

/// A connection to the estimates. One forged or damaged heartbeat under the real writer's GUID that says
/// "numbers below 2^40 are gone" (RTPS 2.2 Sec. 8.3.7.5), and everything that the real writer sends counts as
/// old. Cyclone DDS keeps this state of a writer in the domain of the process, so that a new reader is as
/// deaf as the old one; a connection with a separate domain knows nothing of it. One thread at a time.
class EstimateConnection {
 public:
  /// `gate` is asked by Cyclone's receiving thread, and outlives the connection. Throws DdsError.
  EstimateConnection(const Subscription& subscription, InstrumentGate& gate, DomainUse domain);

  [[nodiscard]] const DdsEntity& reader() const { return reader_; }

  /// Which writer that is: made of its GUID, so that it is the same in every connection. The handle is DDS's.
  std::uint64_t writer_of(dds_instance_handle_t handle);
  /// DDS's handle of a writer that writer_of() named; it may have gone since.
  [[nodiscard]] std::optional<dds_instance_handle_t> handle_of(std::uint64_t writer) const;
  /// The writers matched now; empty while their list changes too fast to be read.
  std::optional<std::span<const std::uint64_t>> matched_writers();

 private:
  DdsEntity participant_;                        // of the shared domain, or
  std::optional<SeparateParticipant> separate_;  // with its own
  DdsEntity reader_;
  std::vector<dds_instance_handle_t> handles_;
  std::vector<std::pair<dds_instance_handle_t, std::uint64_t>> known_;
  std::vector<std::uint64_t> matched_;
};

/// When a connection that hears nothing of a matched writer is made anew. Pure: time comes as a value.
class RenewalTimer {
 public:
  static constexpr std::int64_t kDeafNs = 150'000'000;         ///< silence of a writer that is matched
  static constexpr std::int64_t kMinIntervalNs = 500'000'000;  ///< long enough to find the writer again
  static constexpr std::int64_t kMaxIntervalNs =
      10'000'000'000;  ///< a daemon that hangs is not asked more often

  /// When to renew next, after a silence since `silent_since_ns`.
  [[nodiscard]] std::int64_t due_ns(std::int64_t silent_since_ns) const {
    return std::max(silent_since_ns + kDeafNs, next_ns_);
  }
  void renewed(std::int64_t now_ns) {
    next_ns_ = now_ns + interval_ns_;
    interval_ns_ = std::min(2 * interval_ns_, kMaxIntervalNs);
  }
  /// A shape came: the next silence is another one.
  void heard() { interval_ns_ = kMinIntervalNs; }

 private:
  std::int64_t next_ns_ = 0;
  std::int64_t interval_ns_ = kMinIntervalNs;
};

}  // namespace tubed
