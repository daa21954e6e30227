#pragma once

#include <memory>

#include "daemon/pipeline/source_session.hpp"
#include "daemon/pipeline/spsc_ring.hpp"
#include "daemon/pipeline/triple_buffer.hpp"
#include "drivers/interface/em_source.hpp"
#include "drivers/interface/tracker_identity.hpp"

namespace tubed {

inline constexpr std::size_t kEmRingCapacity = 256;  // 6.4 s at 40 Hz: longer than any stall that is survived
using EmRing = SpscRing<EmFrame, kEmRingCapacity>;

/// Where measurements go, and who is woken for them.
struct EmHandOver {
  EmRing& ring;
  Doorbell& bell;
};

/// Reads the tracker and hands every measurement to the optimizer and to the publisher, and to the publisher
/// which tracker it is whenever that has changed. See Stage.
class EmAcquisitionStage final : public Stage {
 public:
  EmAcquisitionStage(std::unique_ptr<EmSource> source, const PipelineSettings& settings,
                     EmHandOver to_optimizer, EmHandOver to_publisher, TripleBuffer<TrackerIdentity>& tracker)
      : identity_(dynamic_cast<HasIdentity*>(source.get())),
        session_(std::move(source), settings),
        to_optimizer_(to_optimizer),
        to_publisher_(to_publisher),
        tracker_(tracker) {}

  void wait(const Clock& clock) noexcept override { session_.wait(clock); }
  bool step(const Clock& clock) noexcept override;
  void wake() noexcept override { session_.interrupt(); }
  void describe(StageReport& report) const noexcept override;

 private:
  void hand_over() noexcept;
  void hand_over_identity() noexcept;

  HasIdentity* identity_;  ///< of session_'s source, when it says which tracker it is
  SourceSession<EmSource, EmFrame> session_;
  EmHandOver to_optimizer_;
  EmHandOver to_publisher_;
  TripleBuffer<TrackerIdentity>& tracker_;
  TrackerIdentity handed_over_;
  EmFrame frame_;
  std::uint64_t outputs_ = 0;
};

}  // namespace tubed
