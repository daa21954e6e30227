#pragma once

#include <algorithm>
#include <chrono>
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
  std::chrono::nanoseconds max_silence = kSilence;  ///< Stage::max_silence()
};

/// What is said of all stages and instruments at one time. Whoever gave no sign of life for kSilence is
/// failed here, and an instrument without an estimate for so long is NOT_AVAILABLE, whatever was said of them
/// last.
struct PipelineStatus {
  std::span<const NamedReport> stages;
  std::span<const InstrumentStatus> instruments;
};

/// Where estimates leave the process. All calls come from the publisher thread, which may allocate, lock and
/// log.
class Outlet {
 public:
  virtual ~Outlet() = default;
  /// Returns when the write has returned; false when it was refused.
  virtual bool publish(const TubeEstimate& estimate) = 0;
  virtual void publish_em(const EmFrame& frame) = 0;
  /// The tracker, or a tool of it, is another than before, or has said for the first time which it is.
  virtual void publish_tracker(const TrackerIdentity& tracker) = 0;
  /// At once when a state or an instrument's validity is another, within a tenth of a second when a stage's
  /// words are, and once a second.
  virtual void publish_status(const PipelineStatus& status) = 0;
  /// Once a second.
  virtual void publish_health(std::span<const NamedReport> reports) = 0;
  /// Something that the status says, and no stage knows, is another since the last status.
  [[nodiscard]] virtual bool is_status_due() const { return false; }
  /// A stage's state or words are others: worth a line of the log. What flaps comes once a second.
  virtual void log_stage(const NamedReport& report) = 0;
  /// An instrument's validity or reasons are others, likewise.
  virtual void log_validity(std::uint32_t instrument, const InstrumentStatus& status) = 0;
};

/// Sends what is newest: estimates, EM samples, which tracker it is, status on change and once a second,
/// health once a second; says which changes are worth a line of the log, and that a stage or an instrument is
/// silent. See Stage.
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
        bell_(own_bell),
        statuses_(estimates_.size()),
        published_(estimates_.size()) {}

  /// Before the thread starts.
  void set_gather(Gather gather) { gather_ = std::move(gather); }

  /// Until somebody falls silent, if that is sooner.
  void wait(const Clock& clock) noexcept override {
    bell_.wait_until(std::min(clock.now() + std::chrono::milliseconds(100), next_silence_));
  }
  bool step(const Clock& clock) noexcept override;
  void wake() noexcept override { bell_.ring(); }
  void describe(StageReport& report) const noexcept override;

 private:
  struct Instrument {
    Validity validity = Validity::kNotAvailable;  ///< of the newest estimate that was written
    Reasons reasons;
    MonotonicTime written{};  ///< when that was; zero = never
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
  void gather_stages(MonotonicTime now);
  void judge_instruments(MonotonicTime now);
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
  std::vector<StageReport> silent_;         ///< what is said in the place of a silent stage
  std::vector<InstrumentStatus> statuses_;  ///< of the instruments, as of now
  std::vector<InstrumentStatus> published_;
  MonotonicTime next_silence_ = MonotonicTime::max();  ///< when the next one falls silent, unless it speaks
  std::vector<PublishedStage> stages_;
  MonotonicTime next_words_{};
  MonotonicTime next_second_{};
  std::uint64_t outputs_ = 0;
  std::uint64_t too_old_ = 0;
  std::uint64_t not_written_ = 0;
  EmFrame em_frame_;
};

}  // namespace tubed
