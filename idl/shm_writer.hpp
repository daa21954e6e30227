// Segment, ring and door of one writer in one object.
#pragma once

#include <cstdint>
#include <span>

#include "idl/shm_door.hpp"
#include "idl/shm_ring.hpp"
#include "idl/shm_segment.hpp"

namespace tubed {

/// Which thread wakes the readers.
enum class ShmWaking {
  kAll,    ///< the thread that publishes, all of them
  kFirst,  ///< the thread that publishes, the first ShmRingWriter::kMaxWoken; another one the rest
};

struct ShmWriterSettings {
  ShmDoorSettings door;
  ShmGeometry geometry;
  ShmIdentity identity;  ///< writer_start is drawn
  ShmWaking waking = ShmWaking::kAll;
};

/// Publishes to admitted readers. One thread, wake_sleepers() aside. After construction nothing waits,
/// allocates or throws; what readers do, and whether there are any, costs nothing but the wake and the
/// answers at the door. Publish or beat at least every 100 ms: that also lets readers in.
class ShmWriter {
 public:
  /// Throws ShmError: the socket cannot be served, no memory.
  ShmWriter(const ShmWriterSettings& settings, std::int64_t now_ns);
  ~ShmWriter();
  ShmWriter(const ShmWriter&) = delete;
  ShmWriter& operator=(const ShmWriter&) = delete;

  /// See ShmRingWriter.
  std::byte* begin() noexcept { return ring_.begin(); }
  void write(std::size_t offset, std::span<const std::byte> bytes) noexcept { ring_.write(offset, bytes); }
  std::uint64_t commit(std::size_t payload_bytes, std::int64_t now_ns) noexcept;
  std::uint64_t publish(std::span<const std::byte> payload, std::int64_t now_ns) noexcept;
  void beat(std::int64_t now_ns) noexcept;
  /// With ShmWaking::kFirst, see ShmRingWriter.
  [[nodiscard]] bool leaves_sleepers() const { return ring_.leaves_sleepers(); }
  void wake_sleepers() noexcept { ring_.wake_sleepers(); }

  [[nodiscard]] std::size_t payload_bytes() const { return ring_.payload_bytes(); }
  [[nodiscard]] const ShmDoorCounters& door_counters() const { return door_.counters(); }

 private:
  ShmSegment segment_;
  ShmWaking waking_;
  ShmRingWriter ring_;
  ShmDoor door_;  // last made, first closed: nobody is let in to a ring that is not there
};

}  // namespace tubed
