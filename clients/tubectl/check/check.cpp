// tubectl check: does a recording fit the room that is described for it?
#include <unistd.h>

#include <algorithm>
#include <iomanip>
#include <iostream>
#include <nlohmann/json.hpp>

#include "clients/evaluation/offline_reconstruction.hpp"
#include "clients/evaluation/recording_check.hpp"
#include "clients/tubectl/verbs.hpp"

namespace tubed {

namespace {

struct CheckOptions {
  std::string recording;
  std::string config;
  std::string json;
};

std::string_view word_of(RecordingFinding::Verdict verdict) {
  switch (verdict) {
    case RecordingFinding::Verdict::kFine:
      return "fine";
    case RecordingFinding::Verdict::kWrong:
      return "WRONG";
    case RecordingFinding::Verdict::kNotJudged:
      return "not judged";
  }
  return "";
}

int check(const CheckOptions& options) {
  ConfiguredSequence run{read_sequence(options.recording), {}, {}, kUsualMaxImageTimeout};
  if (!options.config.empty()) {
    run = as_configured(std::move(run.sequence), std::filesystem::path(options.config));
  }
  const bool is_terminal = isatty(STDERR_FILENO) == 1;
  const auto findings = check_recording(run, [is_terminal](const std::string& what) {
    std::cerr << (is_terminal ? "\r\033[K" : "") << what << " ..." << (is_terminal ? "" : "\n") << std::flush;
  });
  std::cerr << (is_terminal ? "\r\033[K" : "") << std::flush;
  nlohmann::json report = nlohmann::json::array();
  bool is_wrong = false;
  for (const RecordingFinding& finding : findings) {
    is_wrong = is_wrong || finding.verdict == RecordingFinding::Verdict::kWrong;
    report.push_back({{"what", finding.what},
                      {"verdict", std::string(word_of(finding.verdict))},
                      {"evidence", finding.evidence},
                      {"advice", finding.advice}});
  }
  if (options.json == "-") {
    std::cout << report.dump(2) << '\n';
    return is_wrong ? kExitFailed : kExitOk;
  }
  for (const RecordingFinding& finding : findings) {
    std::cout << std::left << std::setw(11) << word_of(finding.verdict) << std::setw(17) << finding.what
              << finding.evidence << '\n';
    if (!finding.advice.empty()) {
      std::cout << std::string(28, ' ') << "-> " << finding.advice << '\n';
    }
  }
  return is_wrong ? kExitFailed : kExitOk;
}

}  // namespace

CommandLine add_check(CommandLine app, int& exit_code) {
  auto options = std::make_shared<CheckOptions>();
  CommandLine verb = app.add_subcommand(
      "check", "Say whether a recording fits the room that is described for it, and what looks wrong");
  verb.add_option("RECORDING", options->recording, "sequence folder, format 1").required();
  verb.add_option("--config", options->config,
                  "check it against this configuration instead of the folder's own room");
  verb.add_option("--json", options->json, "- for the findings as JSON on standard output").is_member({"-"});
  verb.callback([options, &exit_code] { exit_code = check(*options); });
  return verb;
}

}  // namespace tubed
