// Between the pipeline, which knows no DDS, and publishing, which knows no pipeline.
#pragma once

#include <array>
#include <vector>

#include "daemon/config/configuration.hpp"
#include "daemon/estimator/reference/em_reference.hpp"
#include "daemon/pipeline/publisher_stage.hpp"
#include "daemon/publishing/dds_publisher.hpp"

namespace tubed {

/// Everything TubeIdentity says about each instrument of a configuration.
std::vector<TubeIdentityValues> identities_of(const Configuration& configuration);

/// Writes what the publisher stage hands out to DDS, and logs what it calls worth a line. All calls come from
/// the publisher thread.
class DdsOutlet final : public Outlet {
 public:
  /// `configuration` outlives this object. Throws what DdsPublisher throws.
  explicit DdsOutlet(const Configuration& configuration);

  /// What tells this start of the daemon from others, in every sample.
  [[nodiscard]] std::uint64_t daemon_start() const { return publisher_.daemon_start(); }

  [[nodiscard]] const DdsEntity& participant() const { return publisher_.participant(); }

  bool publish(const TubeEstimate& estimate) override;
  /// In the tracker's frame as it was registered, so that T_world_em of the identity takes coils to the world
  /// wherever the field generator is now; without pose while the patient's reference does not say where.
  void publish_em(const EmFrame& frame) override;
  /// Writes the identity of every instrument again.
  void publish_tracker(const TrackerIdentity& tracker) override;
  void publish_status(const PipelineStatus& status) override;
  /// With "dds" among the stages: samples written and refused, packets that Cyclone could not read.
  void publish_health(std::span<const NamedReport> reports) override;
  void log_stage(const NamedReport& report) override;
  void log_validity(std::uint32_t instrument, const InstrumentStatus& status) override;

 private:
  struct InstrumentState {
    std::uint64_t em_samples = 0;
    InstrumentHealthValues health;
  };

  void gather(std::span<const NamedReport> reports);
  [[nodiscard]] StageReport dds_report() const;

  const Configuration& configuration_;
  std::vector<TubeIdentityValues> identities_;
  DdsPublisher publisher_;
  std::vector<InstrumentState> instruments_;
  std::vector<NamedStageReport> stages_;
  EmSamplesValues em_values_;
  EmReference reference_;  ///< of its own: the optimizer's is in another thread, and finds the same
};

}  // namespace tubed
