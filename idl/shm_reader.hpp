// One reader of one start of a writer, and what it has taken so far.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "idl/shm_door.hpp"
#include "idl/shm_ring.hpp"
#include "idl/shm_segment.hpp"

namespace tubed {

struct ShmReaderSettings {
  std::string path;           ///< of the writer's socket
  std::uint32_t content = 0;  ///< what is expected there, enum tubed_shm_content
  std::uint32_t content_version = 0;
  std::uint32_t oldest_content_version = 0;               ///< that is read as well; 0: no older one
  int timeout_ms = 300;                                   ///< for the writer's answer
  std::vector<uid_t> trusted;                             ///< users the writer may run as; empty = any
  std::uint64_t max_segment_bytes = kShmMaxSegmentBytes;  ///< of the writer's memory; more is refused
};

/// What there is to know now.
enum class ShmNews {
  kNone,    ///< nothing new; the writer works
  kSample,  ///< at least one sample that was not taken yet
  kSilent,  ///< no sign of life for 200 ms: the writer hangs or is dead. Connect again.
  kEnded,   ///< the writer said goodbye
};

/// Reads what is published after it has connected. One thread. After construction nothing allocates or
/// throws. A writer that starts anew has new memory: make another reader.
class ShmReader {
 public:
  /// Connects. Throws ShmError.
  explicit ShmReader(const ShmReaderSettings& settings);
  /// With the descriptor that a visit of settings.path brought; takes it over, also when it throws. Throws
  /// ShmError.
  ShmReader(int descriptor, const ShmReaderSettings& settings);

  [[nodiscard]] const ShmIdentity& identity() const { return ring_.identity(); }
  [[nodiscard]] ShmNews news(std::int64_t now_ns) const noexcept;
  /// Sleeps until there is news or until `deadline_ns`, but not beyond the instant at which silence begins.
  /// May come back early: ask news() with the time it is then.
  void sleep_until(std::int64_t deadline_ns) const noexcept;
  /// The newest sample; those before it count as lost when nobody took them. Precondition: kSample.
  ShmSample take_newest() noexcept { return take(ring_.newest()); }
  /// The oldest not taken yet that the ring still has. Precondition: kSample.
  ShmSample take_next() noexcept;
  /// For samples by number, taken or not.
  [[nodiscard]] const ShmRingReader& ring() const noexcept { return ring_; }
  /// Samples never looked at since the reader connected.
  [[nodiscard]] std::uint64_t lost() const { return lost_; }

 private:
  [[nodiscard]] std::uint64_t oldest() const noexcept;
  ShmSample take(std::uint64_t number) noexcept;

  ShmSegment segment_;
  ShmRingReader ring_;
  std::uint64_t taken_ = 0;  ///< number of the newest one looked at
  std::uint64_t lost_ = 0;
};

}  // namespace tubed
