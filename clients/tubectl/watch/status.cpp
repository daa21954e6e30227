// tubectl status: one line an instrument, and an exit code, for scripts.
#include <algorithm>
#include <chrono>
#include <iostream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "clients/cpp/topic_reader.hpp"
#include "clients/cpp/tube_subscriber.hpp"
#include "clients/tubectl/verbs.hpp"
#include "clients/tubectl/watch/dds_options.hpp"
#include "clients/tubectl/watch/silence.hpp"
#include "clients/tubectl/watch/status_line.hpp"
#include "idl/printable_text.hpp"

namespace tubed {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

// TubeStatus comes once a second, and on change.
constexpr milliseconds kStatusTimeout{1500};

struct StatusArguments {
  Subscription subscription;
  double timeout_s = 2;
  bool as_json = false;
};

using LinesByInstrument = std::map<std::string, StatusLine>;

/// The newest of each instrument, over half a second of estimates.
void listen_to_estimates(const StatusArguments& arguments, LinesByInstrument& lines) {
  TubeSubscriber subscriber(arguments.subscription, Delivery::kEvery);
  auto until = steady_clock::now() + std::chrono::duration_cast<steady_clock::duration>(
                                         std::chrono::duration<double>(arguments.timeout_s));
  while (steady_clock::now() < until) {
    const TubeNews news = subscriber.wait_for(milliseconds{20});
    if (news.event == TubeEvent::kTimeout) {
      continue;
    }
    if (lines.empty()) {
      until = std::min(until, steady_clock::now() + milliseconds{500});
    }
    StatusLine& line = lines[printable_text(news.instrument_id)];
    if (news.sample != nullptr) {
      line.add(*news.sample);
    } else {
      line.add(news);
    }
  }
}

void listen_to_stages(const StatusArguments& arguments, LinesByInstrument& lines) {
  const auto reader = std::make_unique<TopicReader<tubed_TubeStatus>>(arguments.subscription);
  const auto until = steady_clock::now() + kStatusTimeout;
  std::size_t known = 0;
  while (known < lines.size() && steady_clock::now() < until) {
    const tubed_TubeStatus* const status = reader->wait_for(milliseconds{50});
    const auto line = status == nullptr ? lines.end() : lines.find(printable_text(status->instrument_id));
    if (line != lines.end() && line->second.add(*status)) {
      ++known;
    }
  }
}

int run_status(const StatusArguments& arguments) {
  try {
    LinesByInstrument lines;
    listen_to_estimates(arguments, lines);
    listen_to_stages(arguments, lines);
    bool all_valid = true;
    for (const auto& [id, line] : lines) {
      std::cout << (arguments.as_json ? line.to_json(id).dump() : line.text(id)) << '\n';
      all_valid = all_valid && line.is_valid();
    }
    if (lines.empty()) {
      std::cout << "no estimate in " << arguments.timeout_s << " s: no tubed in domain "
                << arguments.subscription.domain << " on " << arguments.subscription.network_interface
                << std::endl;
      SilenceTeller(arguments.subscription, "status").tell();
      return kExitUnavailable;
    }
    return all_valid ? kExitOk : kExitFailed;
  } catch (const DdsError& error) {
    std::cerr << "tubectl: " << error.what() << '\n';
    return kExitUnavailable;
  }
}

}  // namespace

CommandLine add_status(CommandLine app, int& exit_code) {
  auto arguments = std::make_shared<StatusArguments>();
  CommandLine verb = app.add_subcommand(
      "status",
      "One line an instrument, for scripts; exit 0 all VALID, 1 some are not, 69 nothing is published");
  verb.add_option("--seconds", arguments->timeout_s, "How long to wait for a first estimate")
      .positive()
      .capture_default_str();
  verb.add_flag("--json", arguments->as_json, "One JSON object a line");
  add_dds_options(verb, arguments->subscription);
  verb.callback([arguments, &exit_code] { exit_code = run_status(*arguments); });
  return verb;
}

}  // namespace tubed
