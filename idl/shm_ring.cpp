#include "idl/shm_ring.hpp"

#include <linux/futex.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <climits>
#include <cstring>
#include <ctime>

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

void check_geometry(const ShmGeometry& geometry) {
  if (geometry.slot_count < kShmFewestSlots || geometry.slot_count > kShmMostSlots) {
    throw ShmError("a shared memory ring has 2 to 1024 slots, not " + std::to_string(geometry.slot_count));
  }
  if (geometry.payload_bytes == 0 || geometry.payload_bytes > kShmMostPayloadBytes) {
    throw ShmError("a sample in shared memory has 1 byte to 256 MiB, not " +
                   std::to_string(geometry.payload_bytes));
  }
}

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
  wake_readers();
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
  wake_readers();
}

void ShmRingWriter::wake_readers() noexcept {
  // The writer alone changes the word. release: who sees the new count sees the news; pairs with the load in
  // wait().
  store(header_.wake, header_.wake + 1, std::memory_order_release);
  futex(header_.wake, FUTEX_WAKE, INT_MAX, nullptr);  // no count of sleepers: readers cannot write one
}

ShmSample::ShmSample(const tubed_shm_slot* slot, std::uint64_t number, std::uint64_t most_bytes)
    : slot_(slot), number_(number) {
  // acquire pairs with commit(): all words of this sample, or of later ones, are visible from here on.
  was_complete_ = number != 0 && load(slot->sequence, std::memory_order_acquire) == 2 * number;
  bytes_ = std::min(load(slot->payload_bytes, std::memory_order_acquire), most_bytes);
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
  if (bytes < TUBED_SHM_HEADER_BYTES || header_.magic != TUBED_SHM_MAGIC) {
    throw ShmError("the shared memory is none of tubed's");
  }
  if (header_.layout_version != TUBED_SHM_LAYOUT_VERSION) {
    throw ShmError("the writer lays shared memory out by version " + std::to_string(header_.layout_version) +
                   ", this program knows " + std::to_string(TUBED_SHM_LAYOUT_VERSION) +
                   ": install the same tubed for both");
  }
  // Loaded once: what is checked is what is kept, whatever the writer does meanwhile.
  geometry_ = {load(header_.slot_count, std::memory_order_relaxed),
               load(header_.payload_bytes, std::memory_order_relaxed)};
  check_geometry(geometry_);
  if (header_.slot_bytes != geometry_.slot_bytes() || bytes < geometry_.segment_bytes()) {
    throw ShmError("the shared memory is smaller than its header says");
  }
  identity_ = {header_.content, header_.content_version,
               std::string(header_.name, strnlen(header_.name, sizeof(header_.name))), header_.writer_start};
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
  if (newest() != seen || has_ended()) {
    return;
  }
  // An absolute time of CLOCK_MONOTONIC. The mapping is read-only, which the kernel allows for waiting. Once
  // only: whom a writer gone mad rings up without news, the caller's own clock ends.
  futex(header_.wake, FUTEX_WAIT_BITSET, rung, &until);
}

}  // namespace tubed
