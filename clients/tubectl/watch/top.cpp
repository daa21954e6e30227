// tubectl top: stages, latencies, sources and validity of a running daemon, live.
#include <unistd.h>

#include <chrono>
#include <iostream>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "clients/cpp/topic_reader.hpp"
#include "clients/tubectl/verbs.hpp"
#include "clients/tubectl/watch/dds_options.hpp"
#include "clients/tubectl/watch/silence.hpp"
#include "clients/tubectl/watch/top_table.hpp"

namespace tubed {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

// The daemon reports once a second: so long without one means that nobody is there.
constexpr milliseconds kTimeout{3000};

struct TopArguments {
  Subscription subscription;
  std::uint64_t count = std::numeric_limits<std::uint64_t>::max();
};

/// The newest reports of one instrument.
struct Reports {
  tubed_TubeStatus status{};
  tubed_TubeHealth before{};
  tubed_TubeHealth after{};
  std::optional<steady_clock::time_point>
      heard{};  ///< of its health; nothing: it has said no word of that yet
};

using ReportsByInstrument = std::map<std::string, Reports>;

class Watch {
 public:
  explicit Watch(const TopArguments& arguments)
      : status_(std::make_unique<TopicReader<tubed_TubeStatus>>(arguments.subscription)),
        health_(std::make_unique<TopicReader<tubed_TubeHealth>>(arguments.subscription)),
        identity_(std::make_unique<TopicReader<tubed_TubeIdentity>>(arguments.subscription)) {}

  /// Takes what comes until reports of health have come, true, or the timeout is over. Those of a daemon's
  /// instruments come together: they are one picture.
  bool next() {
    const auto until = steady_clock::now() + kTimeout;
    bool has_come = false;
    while (steady_clock::now() < until) {
      const tubed_TubeHealth* const health = health_->wait_for(milliseconds{50});
      take_status();
      if (health == nullptr && has_come) break;
      if (health == nullptr) continue;
      Reports& reports = reports_[health->instrument_id];
      reports.before = reports.after;
      reports.after = *health;
      reports.heard = steady_clock::now();
      forget_replaced();
      has_come = true;
    }
    return has_come;
  }

  [[nodiscard]] std::string text() const {
    std::string text;
    for (const auto& [id, reports] : reports_) {
      if (!reports.heard) continue;
      const bool is_silent = steady_clock::now() - *reports.heard > kTimeout;
      text += is_silent ? id + "  SILENT: no report for more than 3 s\n"
                        : top_table(reports.status, reports.before, reports.after, identity_of(id));
      text += "\n";
    }
    return text;
  }

 private:
  /// nullptr: it has not said who it is.
  [[nodiscard]] const tubed_TubeIdentity* identity_of(const std::string& id) const {
    const auto found = identities_.find(id);
    return found == identities_.end() ? nullptr : &found->second;
  }

  /// Instruments that made room for others.
  void forget_replaced() {
    std::erase_if(identities_, [this](const auto& entry) { return !identity_->has(entry.first); });
    std::erase_if(reports_, [this](const auto& entry) { return !status_->has(entry.first); });
  }

  void take_status() {
    while (const tubed_TubeStatus* status = status_->take()) {
      reports_[status->instrument_id].status = *status;
    }
    while (const tubed_TubeIdentity* identity = identity_->take()) {
      identities_[identity->instrument_id] = *identity;
    }
  }

  std::unique_ptr<TopicReader<tubed_TubeStatus>> status_;
  std::unique_ptr<TopicReader<tubed_TubeHealth>> health_;
  std::unique_ptr<TopicReader<tubed_TubeIdentity>> identity_;
  ReportsByInstrument reports_;
  std::map<std::string, tubed_TubeIdentity> identities_;
};

int run_top(const TopArguments& arguments) {
  try {
    Watch watch(arguments);
    const bool is_terminal = isatty(STDOUT_FILENO) == 1;
    bool ever_heard = false;
    for (std::uint64_t shown = 0; shown < arguments.count;) {
      const bool heard = watch.next();
      ever_heard = ever_heard || heard;
      if (!ever_heard) {
        SilenceTeller(arguments.subscription, "top").tell();
        return kExitUnavailable;
      }
      std::cout << (is_terminal ? "\x1b[H\x1b[J" : "") << watch.text() << std::flush;
      ++shown;
    }
    return kExitOk;
  } catch (const DdsError& error) {
    std::cerr << "tubectl: " << error.what() << '\n';
    return kExitUnavailable;
  }
}

}  // namespace

CommandLine add_top(CommandLine app, int& exit_code) {
  auto arguments = std::make_shared<TopArguments>();
  CommandLine verb = app.add_subcommand("top", "Watch stages, latencies, sources and validity, live");
  verb.add_option("--count", arguments->count, "Stop after this many pictures; one a second")
      .positive()
      .default_str("never");
  add_dds_options(verb, arguments->subscription);
  verb.callback([arguments, &exit_code] { exit_code = run_top(*arguments); });
  return verb;
}

}  // namespace tubed
