#include "daemon/rival_outlet.hpp"

#include <spdlog/spdlog.h>

#include "daemon/log.hpp"
#include "daemon/publishing/clock_pair.hpp"

namespace tubed {

namespace {

std::vector<std::string> ids_of(const Configuration& configuration) {
  std::vector<std::string> ids;
  for (const InstrumentDescription& instrument : configuration.room.instruments) ids.push_back(instrument.id);
  return ids;
}

/// Of an estimate, or of an instrument's status.
template <typename Judged>
void flag(Judged& judged) {
  judged.reasons.add(Reason::kRivalWriter);
  if (judged.validity == Validity::kValid) judged.validity = Validity::kQuestionable;
}

}  // namespace

RivalOutlet::RivalOutlet(const Configuration& configuration, const DdsEntity& participant, Outlet& next)
    : ForwardingOutlet(next),
      configuration_(configuration),
      watch_(participant, configuration.dds, ids_of(configuration)),
      is_flagged_(configuration.room.instruments.size()) {}

bool RivalOutlet::publish(const TubeEstimate& estimate) {
  const bool has_rival = watch_.reports()[estimate.instrument].is_there;
  if (has_rival) {
    flagged_estimate_ = estimate;
    flag(flagged_estimate_);
  }
  const bool written = ForwardingOutlet::publish(has_rival ? flagged_estimate_ : estimate);
  is_status_due_ = is_status_due_ || has_rival != is_flagged_[estimate.instrument];
  is_flagged_[estimate.instrument] = has_rival;
  if (watch_.look(read_clocks().monotonic_ns)) log_changes();
  return written;
}

void RivalOutlet::publish_status(const PipelineStatus& status) {
  flagged_statuses_.assign(status.instruments.begin(), status.instruments.end());
  for (std::size_t i = 0; i < flagged_statuses_.size(); ++i) {
    if (watch_.reports()[i].is_there) flag(flagged_statuses_[i]);
  }
  ForwardingOutlet::publish_status({status.stages, flagged_statuses_});
  is_status_due_ = false;
}

void RivalOutlet::log_changes() const {
  for (std::size_t i = 0; i < watch_.reports().size(); ++i) {
    const RivalReport& report = watch_.reports()[i];
    const std::string& id = configuration_.room.instruments[i].id;
    if (report.has_changed && report.is_there) {
      log_with_fields(
          spdlog::level::warn,
          fmt::format("somebody else publishes {} too: {}. End one of the two, or give one another "
                      "[dds] partition or instrument id",
                      id, report.who),
          {{"TUBED_INSTRUMENT", id}, {"TUBED_RIVAL", report.who}});
    } else if (report.has_changed) {
      log_with_fields(spdlog::level::info, fmt::format("nobody else publishes {} any more", id),
                      {{"TUBED_INSTRUMENT", id}});
    }
  }
}

}  // namespace tubed
