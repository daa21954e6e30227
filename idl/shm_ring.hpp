// A ring of sequence-locked slots in memory that somebody else has mapped: one writer, any number of readers
// that write nothing, hold no lock and may die anywhere. Modelled in tests/models/shm_ring.pml.
//
// Why a torn sample cannot be taken for a whole one. The writer marks the slot (odd sequence), stores every
// word with release, then the even sequence with release. A reader loads the even sequence with acquire,
// every word with acquire, then the sequence again. If one of its words came from a later sample, that
// acquire load read a release store that comes after the later mark, so the mark happens before the reader's
// second look, which then cannot return the old sequence. If a word came from an earlier sample, it would
// have been read before the acquire of the even sequence, whose release comes after all its words:
// impossible. No fence is needed, no plain access races, so that the argument holds in the C++ memory model
// and ThreadSanitizer can check it; on x86-64 acquire loads and release stores are plain moves.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "idl/shm_layout.hpp"

namespace tubed {

/// The writer's half. One thread, wake_sleepers() aside. Never waits, allocates or throws after construction.
class ShmRingWriter {
 public:
  /// Readers that commit() wakes at most: each costs a few microseconds, and a reader may sleep in thousands
  /// of threads.
  static constexpr int kMaxWoken = 16;

  /// Lays the ring out. `memory` is zero, writable, aligned to 64 and has geometry.segment_bytes(). Throws
  /// ShmError for a geometry out of the limits or a name too long.
  ShmRingWriter(std::byte* memory, const ShmGeometry& geometry, const ShmIdentity& identity,
                std::int64_t now_ns);

  /// Marks the next slot as being written and returns its payload, payload_bytes() long, aligned to 64. A
  /// grabber may let its hardware fill it in place; a second begin() before commit() starts over. Filling in
  /// place is outside the C++ memory model and relies on a barrier in begin(); write() is inside.
  std::byte* begin() noexcept;
  /// After begin(): copies into the payload. Preconditions: `offset` a multiple of 8, the end within
  /// payload_bytes().
  void write(std::size_t offset, std::span<const std::byte> bytes) noexcept;
  /// Makes what was written since begin() the newest sample and wakes the first kMaxWoken readers, in one
  /// call of the kernel; its number.
  std::uint64_t commit(std::size_t payload_bytes, std::int64_t now_ns) noexcept;
  /// The newest commit() woke as many readers as it wakes at most: more may be asleep, until wake_sleepers().
  [[nodiscard]] bool leaves_sleepers() const { return leaves_sleepers_; }
  /// Wakes the readers that still sleep, in calls of kMaxWoken readers each and never more than 4096 in all,
  /// so that readers that go back to sleep at once do not hold it up. Any thread, also while the writer's own
  /// goes on.
  void wake_sleepers() noexcept;
  /// begin, write, commit.
  std::uint64_t publish(std::span<const std::byte> payload, std::int64_t now_ns) noexcept;

  /// Shows that the writer works though it has nothing to say: at least every 100 ms.
  void beat(std::int64_t now_ns) noexcept;
  /// The writer says goodbye; readers are told at once.
  void end() noexcept;

  [[nodiscard]] std::size_t payload_bytes() const { return geometry_.payload_bytes; }

 private:
  [[nodiscard]] tubed_shm_slot& slot_of(std::uint64_t number) const;
  void ring() noexcept;
  /// How many were woken, of at most kMaxWoken.
  int wake_some() noexcept;

  tubed_shm_header& header_;
  std::byte* slots_;
  ShmGeometry geometry_;
  std::uint64_t number_ = 1;  ///< of the sample that comes next
  bool leaves_sleepers_ = false;
};

/// A sample in place. What copy() gave may be used only if whole() is true afterwards.
class ShmSample {
 public:
  ShmSample() = default;
  ShmSample(const tubed_shm_slot* slot, std::uint64_t number, std::uint64_t max_bytes);

  [[nodiscard]] std::uint64_t number() const { return number_; }
  /// Of the payload; never more than the segment allows.
  [[nodiscard]] std::size_t bytes() const { return bytes_; }
  [[nodiscard]] std::int64_t published_ns() const { return published_ns_; }
  /// Copies the payload from `offset` on, a multiple of 8. False, and nothing is copied, when it has not so
  /// many bytes.
  [[nodiscard]] bool copy(std::size_t offset, std::span<std::byte> to) const noexcept;
  /// Nothing of it was overwritten since it was looked up.
  [[nodiscard]] bool whole() const noexcept;

 private:
  const tubed_shm_slot* slot_ = nullptr;
  std::uint64_t number_ = 0;
  std::size_t bytes_ = 0;
  std::int64_t published_ns_ = 0;
  bool was_complete_ = false;
};

/// The reader's half over a read-only mapping. Believes nothing of what a hostile writer may put there later:
/// the geometry is checked once and kept here. Never allocates or throws after construction.
class ShmRingReader {
 public:
  /// Throws ShmError when `memory` of `bytes` is no segment of this layout.
  ShmRingReader(const std::byte* memory, std::size_t bytes);

  [[nodiscard]] const ShmIdentity& identity() const { return identity_; }
  [[nodiscard]] const ShmGeometry& geometry() const { return geometry_; }
  [[nodiscard]] std::uint64_t newest() const noexcept;
  [[nodiscard]] std::int64_t heartbeat_ns() const noexcept;
  [[nodiscard]] bool has_ended() const noexcept;
  /// Sample `number`; look at whole() before believing it.
  [[nodiscard]] ShmSample look(std::uint64_t number) const noexcept;
  /// Sleeps until there is a newer sample than `seen`, the writer says goodbye, or CLOCK_MONOTONIC
  /// `deadline_ns`. May come back early, and does when it is rung up without news: look, and wait again.
  void wait(std::uint64_t seen, std::int64_t deadline_ns) const noexcept;

 private:
  const tubed_shm_header& header_;
  const std::byte* slots_;
  ShmGeometry geometry_;
  ShmIdentity identity_;
};

}  // namespace tubed
