// Newest-wins hand-over of one value from one thread to another. Wait-free on both sides.
// Modelled in tests/models/triple_buffer.pml, which shows that each barrier below is needed.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

namespace tubed {

/// Three slots: the writer owns one, the reader one, the third waits in the middle. Exactly one thread calls
/// the writer's methods and exactly one the reader's; neither ever waits, allocates or copies a T.
template <typename T>
class TripleBuffer {
 public:
  /// Writer: the slot to fill. Its old content is unspecified.
  T& back() { return slots_[back_]; }

  /// Writer: hands back() over. True when this superseded a value that the reader never saw.
  bool publish() {
    // release: the slot's content is visible to the acquire in fetch(); acquire: the slot we get back was
    // left by the reader, whose reads end before its release in fetch().
    const std::uint8_t previous =
        middle_.exchange(static_cast<std::uint8_t>(back_ | kFresh), std::memory_order_acq_rel);
    back_ = previous & kIndex;
    return (previous & kFresh) != 0;
  }

  /// Reader: takes the newest value if there is a new one; front() stays as it was otherwise.
  bool fetch() {
    // relaxed is enough to look: the exchange below orders what is read.
    if ((middle_.load(std::memory_order_relaxed) & kFresh) == 0) {
      return false;
    }
    // acquire pairs with the release in publish(); release hands the old front to the writer's acquire there.
    const std::uint8_t previous = middle_.exchange(front_, std::memory_order_acq_rel);
    front_ = previous & kIndex;
    return true;
  }

  /// Reader: the value taken by the last fetch(). Unchanged until the next one.
  T& front() { return slots_[front_]; }
  const T& front() const { return slots_[front_]; }

  /// Before the threads start: reaches every slot, e.g. to reserve memory.
  template <typename Function>
  void for_each_slot(Function&& function) {
    for (T& slot : slots_) {
      function(slot);
    }
  }

 private:
  static constexpr std::uint8_t kIndex = 3;
  static constexpr std::uint8_t kFresh = 4;
  std::array<T, 3> slots_{};
  alignas(64) std::uint8_t back_ = 0;
  alignas(64) std::atomic<std::uint8_t> middle_{1};
  alignas(64) std::uint8_t front_ = 2;
};

}  // namespace tubed
