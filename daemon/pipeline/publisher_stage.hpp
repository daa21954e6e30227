#pragma once

#include <array>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/pipeline/em_acquisition_stage.hpp"
#include "daemon/pipeline/line_limit.hpp"
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
  /// The tracker, or a tool of it, is another than before, or has said for the first time which it is.
  virtual void publish_tracker(const TrackerIdentity& tracker) = 0;
  /// At once when a state or an instrument's validity is another, within a tenth of a second when a stage's
  /// words are, and once a second.
  virtual void publish_status(std::span<const NamedReport> reports) = 0;
  /// Once a second.
  virtual void publish_health(std::span<const NamedReport> reports) = 0;
  /// Something that the status says, and no stage knows, is another since the last status.
  [[nodiscard]] virtual bool is_status_due() const { return false; }
  /// A stage's state or words are others: worth a line of the log. What flaps comes once a second.
  virtual void log_stage(const NamedReport& report) = 0;
  /// An instrument's validity or reasons are others, likewise.
  virtual void log_validity(std::uint32_t instrument, Validity validity, Reasons reasons) = 0;
};

/// Sends what is newest: estimates, EM samples, which tracker it is, status on change and once a second,
/// health once a second; and says which changes are worth a line of the log. See Stage.
class PublisherStage final : public Stage {
 public:
  /// `gather` fills the newest report of every stage thread; called from this stage's thread.
  using Gather = std::function<void(std::vector<NamedReport>&)>;

  PublisherStage(std::vector<TripleBuffer<TubeEstimate>*> estimates, EmRing& em,
                 TripleBuffer<TrackerIdentity>& tracker, Outlet& outlet, Doorbell& own_bell)
      : estimates_(std::move(estimates)),
        instruments_(estimates_.size()),
        em_(em),
        tracker_(tracker),
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
  struct Instrument {
    Validity validity = Validity::kNotAvailable;
    Reasons reasons;
    LineLimit<Validity, Reasons> lines;
  };
  /// As it was last published.
  struct PublishedStage {
    StageState state = StageState::kStarting;
    std::string words;
    LineLimit<StageState, std::string> lines;
  };

  bool publish_estimates(MonotonicTime now);
  bool publish_em();
  void publish_tracker();
  void publish_reports(MonotonicTime now);
  [[nodiscard]] bool status_is_due(MonotonicTime now) const;
  void log_changes(MonotonicTime now);

  std::vector<TripleBuffer<TubeEstimate>*> estimates_;
  std::vector<Instrument> instruments_;
  EmRing& em_;
  TripleBuffer<TrackerIdentity>& tracker_;
  Outlet& outlet_;
  Doorbell& bell_;
  Gather gather_;
  std::vector<NamedReport> reports_;
  std::vector<PublishedStage> stages_;
  bool validity_changed_ = false;
  MonotonicTime next_words_{};
  MonotonicTime next_second_{};
  std::uint64_t outputs_ = 0;
  std::uint64_t too_old_ = 0;
  EmFrame em_frame_;
};

}  // namespace tubed
