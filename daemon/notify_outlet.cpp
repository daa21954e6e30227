#include "daemon/notify_outlet.hpp"

#include <algorithm>

namespace tubed {

namespace {

std::string_view word_of_trouble(StageState state) {
  switch (state) {
    case StageState::kStarting:
      return "starting";
    case StageState::kRunning:
      return "";
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

std::string status_words(const std::vector<std::string>& instruments, const std::vector<Validity>& validities,
                         const std::vector<Reasons>& reasons, std::span<const NamedReport> reports) {
  std::string words;
  for (std::size_t i = 0; i < instruments.size(); ++i) {
    words += (i == 0 ? "" : "; ") + instruments[i] + " " + std::string(name_of(validities[i])) + " (" +
             names_of(reasons[i]) + ")";
  }
  for (const NamedReport& report : reports) {
    const std::string_view trouble = word_of_trouble(report.report->state);
    if (!trouble.empty()) {
      const std::string_view why = report.report->why.data();
      words += "; " + std::string(report.name) + " is " + std::string(trouble);
      words += why.empty() ? "" : ": " + std::string(why);
    }
  }
  return words;
}

NotifyOutlet::NotifyOutlet(const Configuration& configuration, SystemdNotify& notify, Outlet& next)
    : ForwardingOutlet(next), notify_(notify) {
  for (const InstrumentDescription& instrument : configuration.room.instruments) {
    instruments_.push_back(instrument.id);
  }
  validities_.resize(instruments_.size(), Validity::kNotAvailable);
  reasons_.resize(instruments_.size());
  has_left_.resize(instruments_.size(), false);
}

void NotifyOutlet::publish(const TubeEstimate& estimate) {
  ForwardingOutlet::publish(estimate);
  validities_[estimate.instrument] = estimate.validity;
  reasons_[estimate.instrument] = estimate.reasons;
  has_left_[estimate.instrument] = true;
  if (std::find(has_left_.begin(), has_left_.end(), false) == has_left_.end()) {
    has_left_.assign(has_left_.size(), false);
    notify_.estimate_published(std::chrono::steady_clock::now());
  }
}

void NotifyOutlet::publish_status(std::span<const NamedReport> reports) {
  ForwardingOutlet::publish_status(reports);
  notify_.status(status_words(instruments_, validities_, reasons_, reports));
}

}  // namespace tubed
