#include "daemon/pipeline/doorbell.hpp"

#include <linux/futex.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <climits>
#include <ctime>

namespace tubed {

namespace {

static_assert(sizeof(std::atomic<std::uint32_t>) == 4 && std::atomic<std::uint32_t>::is_always_lock_free,
              "a futex word is 32 plain bits");

// 0 or an errno value. FUTEX_WAIT_BITSET takes an absolute time of CLOCK_MONOTONIC.
int futex_wait(std::atomic<std::uint32_t>* word, std::uint32_t expected, MonotonicTime deadline) {
  const std::int64_t ns = to_ns(deadline);
  const timespec until{static_cast<time_t>(ns / 1'000'000'000), static_cast<long>(ns % 1'000'000'000)};
  const long result =
      syscall(SYS_futex, word, FUTEX_WAIT_BITSET_PRIVATE, expected, &until, nullptr, FUTEX_BITSET_MATCH_ANY);
  return result == 0 ? 0 : errno;
}

}  // namespace

void Doorbell::ring() noexcept {
  // seq_cst with the sleeper's increment and first look: either we see the sleeper, or it sees the new count.
  // Modelled in tests/models/doorbell.pml, which shows that each order below is needed.
  count_.fetch_add(1, std::memory_order_seq_cst);
  if (sleepers_.load(std::memory_order_seq_cst) != 0) {
    syscall(SYS_futex, &count_, FUTEX_WAKE_PRIVATE, INT_MAX, nullptr, nullptr, 0);
  }
}

bool Doorbell::wait_until(MonotonicTime deadline) noexcept {
  sleepers_.fetch_add(1, std::memory_order_seq_cst);  // pairs with the load in ring()
  std::uint32_t count = count_.load(std::memory_order_seq_cst);
  while (count == seen_) {
    // acquire, here and below: what was written before ring() is visible. The kernel has ordered the rest.
    if (futex_wait(&count_, seen_, deadline) == ETIMEDOUT) {
      count = count_.load(std::memory_order_acquire);
      break;
    }
    count = count_.load(std::memory_order_acquire);
  }
  // relaxed: late, it costs ring() a system call in vain.
  sleepers_.fetch_sub(1, std::memory_order_relaxed);
  const bool rung = count != seen_;
  seen_ = count;
  return rung;
}

}  // namespace tubed
