#include "daemon/dds_outlet.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>

#include "daemon/config/published_room.hpp"
#include "daemon/log.hpp"
#include "daemon/pipeline/latency_histogram.hpp"
#include "daemon/publishing/tracker_words.hpp"
#include "idl/cyclone_log.hpp"
#include "idl/estimate_age.hpp"

namespace tubed {

namespace {

TrackerIdentityValues values_of(const TrackerIdentity& tracker) {
  TrackerIdentityValues values{.firmware = std::string(tracker.firmware.text()),
                               .api_revision = std::string(tracker.api_revision.text()),
                               .control_unit_serial = std::string(tracker.control_unit_serial.text()),
                               .field_generator = std::string(tracker.field_generator.text()),
                               .tools = {}};
  for (const ToolIdentity& tool :
       std::span(tracker.tools).first(static_cast<std::size_t>(tracker.tool_count))) {
    values.tools.push_back(
        {static_cast<std::uint32_t>(tool.port), tool.serial_number, std::string(tool.part_number.text())});
  }
  return values;
}

std::string_view word_of(StageState state) {
  switch (state) {
    case StageState::kStarting:
      return "starting";
    case StageState::kRunning:
      return "running";
    case StageState::kDegraded:
      return "degraded";
    case StageState::kReconnecting:
      return "reconnecting";
    case StageState::kEnded:
      return "ended";
    case StageState::kFailed:
      return "failed";
  }
  return "unknown";
}

}  // namespace

std::vector<TubeIdentityValues> identities_of(const Configuration& configuration) {
  std::vector<TubeIdentityValues> identities;
  for (std::size_t i = 0; i < configuration.room.instruments.size(); ++i) {
    TubeIdentityValues identity =
        identity_of(configuration.room, configuration.room.instruments[i], configuration.estimators[i].mode);
    identity.configuration_digest = configuration.digest;
    identities.push_back(std::move(identity));
  }
  return identities;
}

DdsOutlet::DdsOutlet(const Configuration& configuration)
    : configuration_(configuration),
      identities_(identities_of(configuration)),
      publisher_(configuration.dds, identities_),
      instruments_(configuration.room.instruments.size()),
      reference_(configuration.room.reference) {}

bool DdsOutlet::publish(const TubeEstimate& estimate) {
  // The publisher stage has asked, but the process may have been stopped since then. Asked here of the time
  // that is written on the sample: what is stopped later says itself how long it was under way.
  const ClockPair now = read_clocks();
  if (is_history(estimate, now.monotonic_ns) ||
      publisher_.publish(estimate, now) != PublishResult::kWritten) {
    return false;
  }
  InstrumentState& state = instruments_[estimate.instrument];
  ++state.health.estimates;
  state.health.agreement = estimate.agreement;
  ++state.health.validity_counts[static_cast<std::size_t>(estimate.validity)];
  if (estimate.has_image && estimate.stamps.exposure_ns != 0) {
    const std::int64_t latency_ns = read_clocks().monotonic_ns - estimate.stamps.exposure_ns;
    count_latency(state.health.exposure_to_publish, std::chrono::nanoseconds(latency_ns));
  }
  return true;
}

void DdsOutlet::publish_em(const EmFrame& frame) {
  const std::optional<EmPlacement> placement = reference_.take(frame);
  for (std::size_t i = 0; i < instruments_.size(); ++i) {
    em_values_.sequence_number = ++instruments_[i].em_samples;
    fill_coils(configuration_.room.instruments[i], frame, placement, em_values_);
    publisher_.publish_em(static_cast<std::uint32_t>(i), em_values_);
  }
}

void DdsOutlet::gather(std::span<const NamedReport> reports) {
  stages_.clear();
  for (const NamedReport& report :
       reports.first(std::min(reports.size(), static_cast<std::size_t>(kMaxStages)))) {
    stages_.push_back({report.name, *report.report});
  }
}

void DdsOutlet::publish_tracker(const TrackerIdentity& tracker) {
  const TrackerIdentityValues values = values_of(tracker);
  log_with_fields(
      spdlog::level::info, tracker_words(values),
      {{"TUBED_TRACKER_FIRMWARE", values.firmware}, {"TUBED_TRACKER_SERIAL", values.control_unit_serial}});
  for (std::size_t i = 0; i < identities_.size(); ++i) {
    identities_[i].tracker = values;
    if (publisher_.publish_identity(static_cast<std::uint32_t>(i), identities_[i]) !=
        PublishResult::kWritten) {
      spdlog::warn("{}: subscribers were not told which tracker it is, DDS refused the write",
                   identities_[i].instrument_id);
    }
  }
}

void DdsOutlet::publish_status(const PipelineStatus& status) {
  gather(status.stages);
  for (std::size_t i = 0; i < instruments_.size(); ++i) {
    publisher_.publish_status(static_cast<std::uint32_t>(i), status.instruments[i], stages_);
  }
}

/// Counted by Cyclone's threads and writers, which are no stages.
StageReport DdsOutlet::dds_report() const {
  const PublishCounters& written = publisher_.counters();
  StageReport report;
  report.state = StageState::kRunning;
  report.steps = written.written + written.timed_out + written.failed;
  report.outputs = written.written;
  report.dropped = written.timed_out + written.failed;
  report.refused = cyclone_log_counters().malformed_packets;
  return report;
}

void DdsOutlet::publish_health(std::span<const NamedReport> reports) {
  gather(reports);
  if (stages_.size() < static_cast<std::size_t>(kMaxStages)) {
    stages_.push_back({"dds", dds_report()});
  }
  for (std::size_t i = 0; i < instruments_.size(); ++i) {
    for (std::size_t stage = 0; stage < stages_.size(); ++stage) {
      instruments_[i].health.allocations_counted[stage] = stages_[stage].report.costs_counted;
    }
    publisher_.publish_health(static_cast<std::uint32_t>(i), instruments_[i].health, stages_);
  }
}

void DdsOutlet::log_stage(const NamedReport& named) {
  const StageReport& report = *named.report;
  const bool good = report.state == StageState::kRunning || report.state == StageState::kStarting;
  const std::string words = fmt::format("{} is {}{}{}", named.name, word_of(report.state),
                                        report.why[0] != '\0' ? ": " : "", report.why.data());
  log_with_fields(good ? spdlog::level::info : spdlog::level::warn, words,
                  {{"TUBED_STAGE", named.name},
                   {"TUBED_STATE", word_of(report.state)},
                   {"TUBED_WHY", report.why.data()}});
}

void DdsOutlet::log_validity(std::uint32_t instrument, const InstrumentStatus& status) {
  const std::string& id = configuration_.room.instruments[instrument].id;
  const std::string reasons = names_of(status.reasons);
  log_with_fields(
      status.validity == Validity::kValid ? spdlog::level::info : spdlog::level::warn,
      fmt::format("{} is {} ({})", id, name_of(status.validity), reasons),
      {{"TUBED_INSTRUMENT", id}, {"TUBED_VALIDITY", name_of(status.validity)}, {"TUBED_REASONS", reasons}});
}

}  // namespace tubed
