// Writes estimates into shared memory, as DDS carries them. The publisher thread alone uses it after
// construction, wake_sleepers() aside.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "daemon/publishing/clock_pair.hpp"
#include "daemon/publishing/shm_settings.hpp"
#include "idl/estimate.hpp"
#include "idl/shm_writer.hpp"

namespace tubed {

class ShmPublisher {
 public:
  /// `instrument_ids`: by TubeEstimate::instrument, each 1 to 64 bytes; `daemon_start`: what DDS says, so
  /// that both say the same. Throws ShmError: the socket cannot be served, no such group.
  ShmPublisher(const ShmSettings& settings, std::vector<std::string> instrument_ids,
               std::uint64_t daemon_start, const ClockPair& now = read_clocks());
  ~ShmPublisher();
  ShmPublisher(const ShmPublisher&) = delete;
  ShmPublisher& operator=(const ShmPublisher&) = delete;

  /// Publishes and lets readers in; readers cannot make it wait. It is also the heartbeat: nothing but an
  /// estimate that was really made says that the daemon works. Ignores an instrument it was not told of.
  /// Wakes the first readers itself; true when more may be asleep, which another thread has to wake.
  bool publish(const TubeEstimate& estimate, const ClockPair& now = read_clocks()) noexcept;
  /// Any thread without a real-time priority, also while the publisher's goes on: it takes as long as there
  /// are readers.
  void wake_sleepers() noexcept { writer_.wake_sleepers(); }

  [[nodiscard]] const ShmDoorCounters& door_counters() const { return writer_.door_counters(); }

 private:
  struct Scratch;
  std::vector<std::string> instrument_ids_;
  std::unique_ptr<Scratch> scratch_;
  ShmWriter writer_;
};

}  // namespace tubed
