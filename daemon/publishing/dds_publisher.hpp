// Writes the five topics of the contract. The publisher thread alone uses it after construction.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "daemon/publishing/clock_pair.hpp"
#include "daemon/publishing/dds_settings.hpp"
#include "daemon/publishing/published_values.hpp"
#include "idl/estimate.hpp"

namespace tubed {

class DdsEntity;

/// What became of one write. A bad one is a value, never an exception: the next estimate is due in 33 ms.
enum class PublishResult { kWritten, kTimedOut, kFailed };

/// Of all topics since construction.
struct PublishCounters {
  std::uint64_t written = 0;
  std::uint64_t timed_out = 0;  ///< gave up after kMaxWrite (2 ms)
  std::uint64_t failed = 0;
};

/// One participant, one writer a topic, one key an instrument. Not thread-safe; never locks or allocates by
/// itself after construction, but dds_write does both, which is why this has a thread to itself.
class DdsPublisher {
 public:
  /// Joins the domain, writes the identity of every instrument (kept for late joiners). Element i of
  /// `identities` is instrument i of every other call; identity.world_frame empty = settings.world_frame,
  /// world_axes too. Throws DdsError: no such network interface, domain out of range, keys that cannot be
  /// used; std::invalid_argument: instrument id empty, longer than 64 characters or given twice, more than
  /// kMaxInstruments.
  DdsPublisher(const DdsSettings& settings, const std::vector<TubeIdentityValues>& identities);
  ~DdsPublisher();
  DdsPublisher(DdsPublisher&&) noexcept;
  DdsPublisher& operator=(DdsPublisher&&) noexcept;

  /// Writes an estimate of instrument estimate.instrument and thereby, and only thereby, asserts the
  /// liveliness of TubeEstimate: call it only with an estimate that was really made just now.
  PublishResult publish(const TubeEstimate& estimate, const ClockPair& now = read_clocks()) noexcept;

  PublishResult publish_em(std::uint32_t instrument, const EmSamplesValues& samples,
                           const ClockPair& now = read_clocks()) noexcept;

  /// On change and once a second.
  PublishResult publish_status(std::uint32_t instrument, const InstrumentStatus& status,
                               std::span<const NamedStageReport> stages,
                               const ClockPair& now = read_clocks()) noexcept;

  PublishResult publish_health(std::uint32_t instrument, const InstrumentHealthValues& health,
                               std::span<const NamedStageReport> stages,
                               const ClockPair& now = read_clocks()) noexcept;

  /// Writes the identity of an instrument again after a change; its instrument_id must be the one it had.
  PublishResult publish_identity(std::uint32_t instrument, const TubeIdentityValues& identity) noexcept;

  /// Drawn at construction, never 0: tells a restart from a replayed sample.
  [[nodiscard]] std::uint64_t daemon_start() const;
  [[nodiscard]] const PublishCounters& counters() const;
  /// For readers that are not to hear these writers.
  [[nodiscard]] const DdsEntity& participant() const;

 private:
  struct Writers;
  std::unique_ptr<Writers> writers_;
};

}  // namespace tubed
