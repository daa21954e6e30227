#include "idl/shm_ring.hpp"

#include <linux/futex.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstring>
#include <ctime>

#include "idl/shm_header.hpp"

namespace tubed {

namespace {

using Word = std::uint64_t;
static_assert(std::atomic_ref<Word>::is_always_lock_free &&
                  std::atomic_ref<std::uint32_t>::is_always_lock_free,
              "an atomic that is a lock in disguise cannot be shared between processes");

template <typename T>
void store(T& place, T value, std::memory_order order) {
  std::atomic_ref<T>(place).store(value, order);
}

/// Of read-only memory: a lock-free load writes nothing, atomic_ref only cannot say so.
template <typename T>
T load(const T& place, std::memory_order order) {
  return std::atomic_ref<T>(const_cast<T&>(place)).load(order);
}

const std::byte* payload_of(const tubed_shm_slot& slot) {
  return reinterpret_cast<const std::byte*>(&slot) + sizeof(tubed_shm_slot);
}

/// Later plain stores (a grabber filling the slot in place) do not overtake the mark. In a build with
/// ThreadSanitizer, which knows no fences, the atomic stores of write() are all there is.
void keep_behind_the_mark() {
#ifndef __SANITIZE_THREAD__
  std::atomic_thread_fence(std::memory_order_release);
#endif
}

long futex(const std::uint32_t& word, int operation, std::uint32_t value, const timespec* until) {
  return syscall(SYS_futex, &word, operation, value, until, nullptr, FUTEX_BITSET_MATCH_ANY);
}

// Of one call after a sample: beyond so many a reader is woken with the next one, or by its own time limit.
constexpr int kMaxWokenInAll = 4096;

}  // namespace

ShmRingWriter::ShmRingWriter(std::byte* memory, const ShmGeometry& geometry, const ShmIdentity& identity,
                             std::int64_t now_ns)
    : header_(*reinterpret_cast<tubed_shm_header*>(memory)),
      slots_(memory + TUBED_SHM_HEADER_BYTES),
      geometry_(geometry) {
  check_geometry(geometry);
  if (identity.name.size() >= sizeof(header_.name)) {
    throw ShmError("the name '" + identity.name + "' is longer than 63 bytes");
  }
  header_.layout_version = TUBED_SHM_LAYOUT_VERSION;
  header_.content = identity.content;
  header_.content_version = identity.content_version;
  header_.slot_count = geometry.slot_count;
  header_.slot_bytes = geometry.slot_bytes();
  header_.payload_bytes = geometry.payload_bytes;
  header_.segment_bytes = geometry.segment_bytes();
  header_.writer_start = identity.writer_start;
  header_.writer_pid = static_cast<std::uint32_t>(getpid());
  std::copy(identity.name.begin(), identity.name.end(), header_.name);
  store(header_.heartbeat_ns, now_ns, std::memory_order_release);
  store(header_.writer_state, std::uint32_t{TUBED_SHM_WRITING}, std::memory_order_release);
  header_.magic = TUBED_SHM_MAGIC;  // nobody sees the segment before it is handed out, complete
}

tubed_shm_slot& ShmRingWriter::slot_of(std::uint64_t number) const {
  return *reinterpret_cast<tubed_shm_slot*>(slots_ +
                                            (number % geometry_.slot_count) * geometry_.slot_bytes());
}

std::byte* ShmRingWriter::begin() noexcept {
  tubed_shm_slot& slot = slot_of(number_);
  // release: everything of the samples before is out before this mark is. What makes the mark itself come
  // before the words are their own releases; see the head of shm_ring.hpp. Pairs with the second look in
  // whole().
  store(slot.sequence, Word{2 * number_ - 1}, std::memory_order_release);
  keep_behind_the_mark();
  return reinterpret_cast<std::byte*>(&slot) + sizeof(slot);
}

void ShmRingWriter::write(std::size_t offset, std::span<const std::byte> bytes) noexcept {
  auto* words = reinterpret_cast<Word*>(reinterpret_cast<std::byte*>(&slot_of(number_)) +
                                        sizeof(tubed_shm_slot) + offset);
  const std::size_t whole_words = bytes.size() / sizeof(Word);
  for (std::size_t i = 0; i < whole_words; ++i) {
    Word word = 0;
    std::memcpy(&word, bytes.data() + i * sizeof(Word), sizeof(Word));
    store(words[i], word, std::memory_order_release);  // pairs with the acquire in ShmSample::copy()
  }
  const std::size_t rest = bytes.size() % sizeof(Word);
  if (rest != 0) {
    Word word = 0;
    std::memcpy(&word, bytes.data() + whole_words * sizeof(Word), rest);
    store(words[whole_words], word, std::memory_order_release);
  }
}

std::uint64_t ShmRingWriter::commit(std::size_t payload_bytes, std::int64_t now_ns) noexcept {
  tubed_shm_slot& slot = slot_of(number_);
  store(slot.payload_bytes, Word{std::min(payload_bytes, this->payload_bytes())}, std::memory_order_release);
  store(slot.published_ns, now_ns, std::memory_order_release);
  store(slot.sequence, Word{2 * number_},
        std::memory_order_release);  // pairs with the acquire in ShmSample()
  store(header_.heartbeat_ns, now_ns, std::memory_order_release);
  store(header_.newest, number_, std::memory_order_release);  // pairs with newest()
  ring();
  leaves_sleepers_ = wake_some() == kMaxWoken;
  return number_++;
}

std::uint64_t ShmRingWriter::publish(std::span<const std::byte> payload, std::int64_t now_ns) noexcept {
  begin();
  write(0, payload);
  return commit(payload.size(), now_ns);
}

void ShmRingWriter::beat(std::int64_t now_ns) noexcept {
  store(header_.heartbeat_ns, now_ns, std::memory_order_release);
}

void ShmRingWriter::end() noexcept {
  store(header_.writer_state, std::uint32_t{TUBED_SHM_ENDED}, std::memory_order_release);
  ring();
  wake_sleepers();
}

void ShmRingWriter::ring() noexcept {
  // The writer alone changes the word. release: a reader that sees the new count sees the new data; pairs
  // with the load in wait().
  store(header_.wake, header_.wake + 1, std::memory_order_release);
}

int ShmRingWriter::wake_some() noexcept {
  // No count of sleepers: readers cannot write one. Below 0 the kernel refuses the address: a bug, nobody
  // sleeps.
  return static_cast<int>(futex(header_.wake, FUTEX_WAKE, kMaxWoken, nullptr));
}

void ShmRingWriter::wake_sleepers() noexcept {
  // In small portions: on a kernel that is not preempted inside a call, real-time threads of this CPU wait
  // for its end. A reader that fell asleep after ring() has seen the new data, so that a portion that is not
  // full is the last.
  for (int woken = 0; woken < kMaxWokenInAll; woken += kMaxWoken) {
    if (wake_some() < kMaxWoken) {
      return;
    }
  }
}

ShmSample::ShmSample(const tubed_shm_slot* slot, std::uint64_t number, std::uint64_t max_bytes)
    : slot_(slot), number_(number) {
  // acquire pairs with commit(): all words of this sample, or of later ones, are visible from here on.
  was_complete_ = number != 0 && load(slot->sequence, std::memory_order_acquire) == 2 * number;
  bytes_ = std::min(load(slot->payload_bytes, std::memory_order_acquire), max_bytes);
  published_ns_ = load(slot->published_ns, std::memory_order_acquire);
}

bool ShmSample::copy(std::size_t offset, std::span<std::byte> to) const noexcept {
  if (!was_complete_ || offset > bytes_ || to.size() > bytes_ - offset) {
    return false;
  }
  const auto* words = reinterpret_cast<const Word*>(payload_of(*slot_) + offset);
  const std::size_t whole_words = to.size() / sizeof(Word);
  for (std::size_t i = 0; i < whole_words; ++i) {
    const Word word = load(words[i], std::memory_order_acquire);  // pairs with write()
    std::memcpy(to.data() + i * sizeof(Word), &word, sizeof(Word));
  }
  const std::size_t rest = to.size() % sizeof(Word);
  if (rest != 0) {
    const Word word = load(words[whole_words], std::memory_order_acquire);
    std::memcpy(to.data() + whole_words * sizeof(Word), &word, rest);
  }
  return true;
}

bool ShmSample::whole() const noexcept {
  // The acquire loads before it keep this one behind them; any mark they have seen is visible here.
  return was_complete_ && load(slot_->sequence, std::memory_order_relaxed) == 2 * number_;
}

ShmRingReader::ShmRingReader(const std::byte* memory, std::size_t bytes)
    : header_(*reinterpret_cast<const tubed_shm_header*>(memory)), slots_(memory + TUBED_SHM_HEADER_BYTES) {
  if (bytes < TUBED_SHM_HEADER_BYTES) {
    throw ShmError("the shared memory is none of tubed's");
  }
  // The part that never changes, copied once: what is checked is what is kept, whatever the writer does
  // meanwhile.
  tubed_shm_header header{};
  std::memcpy(&header, &header_, offsetof(tubed_shm_header, wake));
  geometry_ = checked_geometry(header, bytes);
  identity_ = {header.content, header.content_version,
               std::string(header.name, strnlen(header.name, sizeof(header.name))), header.writer_start};
}

std::uint64_t ShmRingReader::newest() const noexcept {
  return load(header_.newest, std::memory_order_acquire);
}

std::int64_t ShmRingReader::heartbeat_ns() const noexcept {
  return load(header_.heartbeat_ns, std::memory_order_acquire);
}

bool ShmRingReader::has_ended() const noexcept {
  return load(header_.writer_state, std::memory_order_acquire) != TUBED_SHM_WRITING;
}

ShmSample ShmRingReader::look(std::uint64_t number) const noexcept {
  const std::byte* place = slots_ + (number % geometry_.slot_count) * geometry_.slot_bytes();
  return {reinterpret_cast<const tubed_shm_slot*>(place), number, geometry_.payload_bytes};
}

void ShmRingReader::wait(std::uint64_t seen, std::int64_t deadline_ns) const noexcept {
  const timespec until{static_cast<time_t>(deadline_ns / 1'000'000'000),
                       static_cast<long>(deadline_ns % 1'000'000'000)};
  // Before looking for news: what comes after this load changes the word, and the kernel does not put us to
  // sleep.
  const std::uint32_t rung = load(header_.wake, std::memory_order_acquire);
  if (newest() > seen || has_ended()) {
    return;
  }
  // An absolute time of CLOCK_MONOTONIC. The mapping is read-only, which the kernel allows for waiting. Once
  // only: when a faulty writer rings without new data, the caller's own deadline ends the wait.
  futex(header_.wake, FUTEX_WAIT_BITSET, rung, &until);
}

}  // namespace tubed
