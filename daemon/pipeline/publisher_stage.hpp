#pragma once

#include <array>
#include <functional>
#include <span>
#include <string_view>
#include <vector>

#include "daemon/pipeline/em_acquisition_stage.hpp"
#include "daemon/pipeline/triple_buffer.hpp"

namespace tubed {

/// What a stage said last, with its name.
struct NamedReport {
  std::string_view name;
  const StageReport* report;
};

/// Where estimates leave the process. All calls come from the publisher thread, which may allocate, lock and
/// log.
class Outlet {
 public:
  virtual ~Outlet() = default;
  /// Returns when the write has returned.
  virtual void publish(const TubeEstimate& estimate) = 0;
  virtual void publish_em(const EmFrame& frame) = 0;
  /// `changed`: a state, or an instrument's validity, is another than last time; otherwise the second has
  /// passed.
  virtual void publish_status(std::span<const NamedReport> reports, bool changed) = 0;
  virtual void publish_health(std::span<const NamedReport> reports) = 0;
  /// Something that the status says, and no stage knows, is another since the last status.
  [[nodiscard]] virtual bool is_status_due() const { return false; }
};

/// Sends what is newest: estimates, EM samples, status on change and once a second, health once a second. See
/// Stage.
class PublisherStage final : public Stage {
 public:
  /// `gather` fills the newest report of every stage thread; called from this stage's thread.
  using Gather = std::function<void(std::vector<NamedReport>&)>;

  PublisherStage(std::vector<TripleBuffer<TubeEstimate>*> estimates, EmRing& em, Outlet& outlet,
                 Doorbell& own_bell)
      : estimates_(std::move(estimates)),
        newest_words_(estimates_.size()),
        em_(em),
        outlet_(outlet),
        bell_(own_bell) {}

  /// Before the thread starts.
  void set_gather(Gather gather) { gather_ = std::move(gather); }

  void wait(const Clock& clock) noexcept override {
    bell_.wait_until(clock.now() + std::chrono::milliseconds(100));
  }
  bool step(const Clock& clock) noexcept override;
  void wake() noexcept override { bell_.ring(); }
  void describe(StageReport& report) const noexcept override;

 private:
  struct Words {
    Validity validity = Validity::kNotAvailable;
    Reasons reasons;
    friend bool operator==(const Words&, const Words&) = default;
  };

  bool publish_estimates(MonotonicTime now);
  bool publish_em();
  void publish_reports(MonotonicTime now);

  std::vector<TripleBuffer<TubeEstimate>*> estimates_;
  std::vector<Words> newest_words_;
  EmRing& em_;
  Outlet& outlet_;
  Doorbell& bell_;
  Gather gather_;
  std::vector<NamedReport> reports_;
  std::vector<StageState> newest_states_;
  bool words_changed_ = false;
  MonotonicTime next_second_{};
  std::uint64_t outputs_ = 0;
  std::uint64_t too_old_ = 0;
  EmFrame em_frame_;
};

}  // namespace tubed
