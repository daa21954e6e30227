#pragma once

#include <memory>

#include "daemon/pipeline/source_session.hpp"
#include "daemon/pipeline/spsc_ring.hpp"
#include "drivers/interface/em_source.hpp"

namespace tubed {

inline constexpr std::size_t kEmRingCapacity = 256;  // 6.4 s at 40 Hz: longer than any stall that is survived
using EmRing = SpscRing<EmFrame, kEmRingCapacity>;

/// Reads the tracker and hands every measurement to the optimizer and to the publisher. See Stage.
class EmAcquisitionStage final : public Stage {
 public:
  EmAcquisitionStage(std::unique_ptr<EmSource> source, const PipelineSettings& settings, EmRing& to_optimizer,
                     EmRing& to_publisher, Doorbell& publisher_bell)
      : session_(std::move(source), settings),
        to_optimizer_(to_optimizer),
        to_publisher_(to_publisher),
        publisher_bell_(publisher_bell) {}

  void wait(const Clock& clock) noexcept override { has_frame_ = session_.read(frame_, clock); }
  bool step(const Clock& clock) noexcept override;
  void wake() noexcept override { session_.interrupt(); }
  void describe(StageReport& report) const noexcept override;

 private:
  SourceSession<EmSource, EmFrame> session_;
  EmRing& to_optimizer_;
  EmRing& to_publisher_;
  Doorbell& publisher_bell_;
  EmFrame frame_;
  bool has_frame_ = false;
  std::uint64_t outputs_ = 0;
};

}  // namespace tubed
