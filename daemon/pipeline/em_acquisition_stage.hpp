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

/// Reads the tracker and hands every measurement to the optimizer and to the publisher, and to the publisher
/// which tracker it is whenever that has changed. See Stage.
class EmAcquisitionStage final : public Stage {
 public:
  EmAcquisitionStage(std::unique_ptr<EmSource> source, const PipelineSettings& settings, EmRing& to_optimizer,
                     EmRing& to_publisher, TripleBuffer<TrackerIdentity>& tracker, Doorbell& publisher_bell)
      : identity_(dynamic_cast<HasIdentity*>(source.get())),
        session_(std::move(source), settings),
        to_optimizer_(to_optimizer),
        to_publisher_(to_publisher),
        tracker_(tracker),
        publisher_bell_(publisher_bell) {}

  void wait(const Clock& clock) noexcept override { has_frame_ = session_.read(frame_, clock); }
  bool step(const Clock& clock) noexcept override;
  void wake() noexcept override { session_.interrupt(); }
  void describe(StageReport& report) const noexcept override;

 private:
  void hand_over_identity() noexcept;

  HasIdentity* identity_;  ///< of session_'s source, when it says which tracker it is
  SourceSession<EmSource, EmFrame> session_;
  EmRing& to_optimizer_;
  EmRing& to_publisher_;
  TripleBuffer<TrackerIdentity>& tracker_;
  TrackerIdentity handed_over_;
  Doorbell& publisher_bell_;
  EmFrame frame_;
  bool has_frame_ = false;
  std::uint64_t outputs_ = 0;
};

}  // namespace tubed
