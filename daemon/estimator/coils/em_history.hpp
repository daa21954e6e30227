// The EM measurements of the last seconds, looked up by time. Lives in the optimizer thread (or an offline
// run).
#pragma once

#include <array>
#include <cstddef>

#include "daemon/estimator/coils/em_timeout.hpp"
#include "daemon/estimator/reference/em_reference.hpp"
#include "drivers/interface/em_source.hpp"

namespace tubed {

/// Keeps the newest kCapacity measurements (6.4 s at 40 Hz) in order of their time, as they were measured,
/// and where the tracker's frame was at each. Those of which that is not known are not kept. Allocates only
/// when it is made.
class EmHistory {
 public:
  static constexpr std::size_t kCapacity = 256;

  /// `reference`: of the patient; nothing: the tracker's frame stays where it was registered.
  explicit EmHistory(const std::optional<ReferenceDescription>& reference = std::nullopt)
      : reference_(reference) {}

  /// Takes the next measurement. One that is not later than the newest is refused (false): time goes forward.
  bool add(const EmFrame& frame);

  /// Where the tracker's frame was when `frame` was measured; as registered for one that is not of this
  /// history. Valid until the next add().
  [[nodiscard]] const EmPlacement& placement(const EmFrame* frame) const;
  [[nodiscard]] const EmReference& reference() const { return reference_; }

  /// The newest measurement not later than `time`; nullptr when there is none. Valid until the next add().
  [[nodiscard]] const EmFrame* newest_until(MonotonicTime time) const;

  /// The measurement `steps` before `frame` (which must be of this history); nullptr when it is gone.
  [[nodiscard]] const EmFrame* before(const EmFrame* frame, std::size_t steps) const;

  /// Age of the newest measurement from which on they are stale, `most` at most: see EmTimeout.
  [[nodiscard]] std::chrono::nanoseconds timeout(std::chrono::nanoseconds most) const {
    return timeout_.timeout(most);
  }

  [[nodiscard]] std::size_t size() const { return size_; }
  void clear() {
    size_ = 0;
    newest_.reset();
  }

 private:
  [[nodiscard]] const EmFrame& from_newest(std::size_t age) const {
    return frames_[(next_ + kCapacity - 1 - age) % kCapacity];
  }

  std::array<EmFrame, kCapacity> frames_;
  std::array<EmPlacement, kCapacity> placements_;  ///< of frames_
  EmPlacement as_registered_;
  EmReference reference_;
  EmTimeout timeout_;
  std::optional<MonotonicTime> newest_;  ///< of all that came, kept or not
  std::size_t next_ = 0;
  std::size_t size_ = 0;
};

}  // namespace tubed
