// tubectl check: does a recording, or a room that runs, fit how it is described?
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <iomanip>
#include <iostream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "clients/cpp/topic_reader.hpp"
#include "clients/evaluation/offline_reconstruction.hpp"
#include "clients/tubectl/check/live_findings.hpp"
#include "clients/tubectl/verbs.hpp"
#include "clients/tubectl/watch/dds_options.hpp"
#include "clients/tubectl/watch/silence.hpp"

namespace tubed {

namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr milliseconds kLongestSilence{3000};  // health comes once a second

struct CheckOptions {
  std::string recording;  ///< empty: what runs
  std::string config;
  std::string json;
  int seconds = 15;
  Subscription subscription;
};

using Findings = std::vector<RecordingFinding>;

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

nlohmann::json json_of(const Findings& findings) {
  nlohmann::json report = nlohmann::json::array();
  for (const RecordingFinding& finding : findings) {
    report.push_back({{"what", finding.what},
                      {"verdict", std::string(word_of(finding.verdict))},
                      {"evidence", finding.evidence},
                      {"advice", finding.advice}});
  }
  return report;
}

void print(const Findings& findings) {
  for (const RecordingFinding& finding : findings) {
    std::cout << std::left << std::setw(11) << word_of(finding.verdict) << std::setw(17) << finding.what
              << finding.evidence << '\n';
    if (!finding.advice.empty()) {
      std::cout << std::string(28, ' ') << "-> " << finding.advice << '\n';
    }
  }
}

bool any_wrong(const Findings& findings) {
  return std::any_of(findings.begin(), findings.end(), [](const RecordingFinding& finding) {
    return finding.verdict == RecordingFinding::Verdict::kWrong;
  });
}

/// Says on standard error what is being done; on a terminal in one line.
void say_progress(const std::string& what) {
  const bool is_terminal = isatty(STDERR_FILENO) == 1;
  std::cerr << (is_terminal ? "\r\033[K" : "") << what << (is_terminal || what.empty() ? "" : "\n")
            << std::flush;
}

int check_recording_of(const CheckOptions& options) {
  ConfiguredSequence run{read_sequence(options.recording), {}, {}, kUsualMaxImageTimeout};
  if (!options.config.empty()) {
    run = as_configured(std::move(run.sequence), std::filesystem::path(options.config));
  }
  const Findings findings =
      check_recording(run, [](const std::string& what) { say_progress(what + " ..."); });
  say_progress("");
  if (options.json == "-") {
    std::cout << json_of(findings).dump(2) << '\n';
  } else {
    print(findings);
  }
  return any_wrong(findings) ? kExitFailed : kExitOk;
}

/// What each instrument's topics say while one listens.
class Listener {
 public:
  explicit Listener(const Subscription& subscription)
      : identities_(std::make_unique<TopicReader<tubed_TubeIdentity>>(subscription)),
        em_(std::make_unique<TopicReader<tubed_EmSamples>>(subscription)),
        statuses_(std::make_unique<TopicReader<tubed_TubeStatus>>(subscription)),
        health_(std::make_unique<TopicReader<tubed_TubeHealth>>(subscription)) {}

  /// Takes what comes within `timeout`; false when no health was among it.
  bool listen(milliseconds timeout) {
    const tubed_TubeHealth* const health = health_->wait_for(timeout);
    take_all(*identities_);
    take_all(*em_);
    take_all(*statuses_);
    if (health != nullptr) instruments_[health->instrument_id].take(*health);
    std::erase_if(instruments_, [this](const auto& entry) { return !is_remembered(entry.first); });
    return health != nullptr;
  }

  [[nodiscard]] const std::map<std::string, LiveFindings>& instruments() const { return instruments_; }

 private:
  /// Others made room for instruments that came later.
  [[nodiscard]] bool is_remembered(const std::string& id) const {
    return identities_->has(id) || em_->has(id) || statuses_->has(id) || health_->has(id);
  }

  template <typename Sample>
  void take_all(TopicReader<Sample>& reader) {
    while (const Sample* const sample = reader.take()) instruments_[sample->instrument_id].take(*sample);
  }

  std::unique_ptr<TopicReader<tubed_TubeIdentity>> identities_;
  std::unique_ptr<TopicReader<tubed_EmSamples>> em_;
  std::unique_ptr<TopicReader<tubed_TubeStatus>> statuses_;
  std::unique_ptr<TopicReader<tubed_TubeHealth>> health_;
  std::map<std::string, LiveFindings> instruments_;
};

int report_live(const std::map<std::string, LiveFindings>& instruments, bool as_json) {
  nlohmann::json report = nlohmann::json::object();
  bool is_wrong = false;
  for (const auto& [id, instrument] : instruments) {
    if (instrument.seconds() == 0) continue;
    const Findings findings = instrument.findings();
    is_wrong = is_wrong || any_wrong(findings);
    if (as_json) {
      report[id] = json_of(findings);
    } else {
      std::cout << id << ", " << instrument.seconds() << " s\n";
      print(findings);
    }
  }
  if (as_json) {
    std::cout << report.dump(2) << '\n';
  }
  return is_wrong ? kExitFailed : kExitOk;
}

int check_live(const CheckOptions& options) {
  try {
    Listener listener(options.subscription);
    const auto begin = steady_clock::now();
    auto heard = begin;
    bool ever_heard = false;
    while (steady_clock::now() - begin < std::chrono::seconds(options.seconds)) {
      if (listener.listen(milliseconds{200})) {
        heard = steady_clock::now();
        ever_heard = true;
      }
      if (steady_clock::now() - heard > kLongestSilence) {
        break;
      }
      if (isatty(STDERR_FILENO) == 1) {
        const auto passed = std::chrono::duration_cast<std::chrono::seconds>(steady_clock::now() - begin);
        say_progress("listening, " + std::to_string(options.seconds - passed.count()) + " s left ...");
      }
    }
    say_progress("");
    if (!ever_heard) {
      SilenceTeller(options.subscription, "check").tell();
      return kExitUnavailable;
    }
    if (steady_clock::now() - heard > kLongestSilence) {
      std::cerr << "tubectl check: the daemon fell silent; what follows is what it said before\n";
    }
    return report_live(listener.instruments(), options.json == "-");
  } catch (const DdsError& error) {
    std::cerr << "tubectl: " << error.what() << '\n';
    return kExitUnavailable;
  }
}

int check(const CheckOptions& options) {
  if (!options.recording.empty()) {
    return check_recording_of(options);
  }
  if (!options.config.empty()) {
    std::cerr << "tubectl check: --config is for a recording; a daemon has a configuration of its own\n";
    return kExitUsage;
  }
  return check_live(options);
}

}  // namespace

CommandLine add_check(CommandLine app, int& exit_code) {
  auto options = std::make_shared<CheckOptions>();
  CommandLine verb = app.add_subcommand(
      "check",
      "Say whether a recording fits the room that is described for it, and what looks wrong; without a "
      "recording: whether the room of the daemon that runs does");
  verb.add_option("RECORDING", options->recording, "sequence folder, format 1; left out: listen");
  verb.add_option("--config", options->config,
                  "check it against this configuration instead of the folder's own room");
  verb.add_option("--for", options->seconds, "without a recording: listen for so many seconds")
      .positive()
      .capture_default_str();
  verb.add_option("--json", options->json, "- for the findings as JSON on standard output").is_member({"-"});
  add_dds_options(verb, options->subscription);
  verb.callback([options, &exit_code] { exit_code = check(*options); });
  return verb;
}

}  // namespace tubed
