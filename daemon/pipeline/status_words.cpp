#include "daemon/pipeline/status_words.hpp"

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

std::string age_words(std::int64_t age_ns) {
  return age_ns < 0 ? "no estimate yet" : "estimate " + std::to_string(age_ns / 1'000'000) + " ms old";
}

}  // namespace

std::string status_words(const std::vector<std::string>& instruments, const PipelineStatus& status) {
  std::string words;
  for (std::size_t i = 0; i < instruments.size(); ++i) {
    const InstrumentStatus& instrument = status.instruments[i];
    words += (i == 0 ? "" : "; ") + instruments[i] + " " + std::string(name_of(instrument.validity)) + " (" +
             names_of(instrument.reasons) + "), " + age_words(instrument.estimate_age_ns);
  }
  for (const NamedReport& report : status.stages) {
    const std::string_view trouble = word_of_trouble(report.report->state);
    if (!trouble.empty()) {
      const std::string_view why = report.report->why.data();
      words += "; " + std::string(report.name) + " is " + std::string(trouble);
      words += why.empty() ? "" : ": " + std::string(why);
    }
  }
  return words;
}

}  // namespace tubed
