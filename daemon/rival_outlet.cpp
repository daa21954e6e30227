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

}  // namespace

RivalOutlet::RivalOutlet(const Configuration& configuration, const DdsEntity& participant, Outlet& next)
    : configuration_(configuration),
      watch_(participant, configuration.dds, ids_of(configuration)),
      next_(next),
      is_flagged_(configuration.room.instruments.size()) {}

void RivalOutlet::publish(const TubeEstimate& estimate) {
  const bool has_rival = watch_.reports()[estimate.instrument].is_there;
  if (has_rival) {
    flagged_estimate_ = estimate;
    flagged_estimate_.reasons.add(Reason::kRivalWriter);
    if (estimate.validity == Validity::kValid) flagged_estimate_.validity = Validity::kQuestionable;
  }
  next_.publish(has_rival ? flagged_estimate_ : estimate);
  is_status_due_ = is_status_due_ || has_rival != is_flagged_[estimate.instrument];
  is_flagged_[estimate.instrument] = has_rival;
  if (watch_.look(read_clocks().monotonic_ns)) log_changes();
}

void RivalOutlet::publish_status(std::span<const NamedReport> reports, bool changed) {
  next_.publish_status(reports, changed);
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
