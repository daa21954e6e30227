// tubectl stat: rate, latency, loss and validity over some seconds.
#include <chrono>
#include <iostream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "clients/cpp/tube_subscriber.hpp"
#include "clients/tubectl/verbs.hpp"
#include "clients/tubectl/watch/dds_options.hpp"
#include "clients/tubectl/watch/silence.hpp"
#include "clients/tubectl/watch/stream_statistics.hpp"
#include "idl/dds_entity.hpp"
#include "idl/printable_text.hpp"

namespace tubed {
namespace {

using std::chrono::steady_clock;

struct StatArguments {
  Subscription subscription;
  double duration_s = 10;
  bool as_json = false;
};

using StatisticsByInstrument = std::map<std::string, StreamStatistics>;

/// Listens for the time asked for, counted from the first sample; gives up when none comes in that time.
StatisticsByInstrument listen(TubeSubscriber& subscriber, SilenceTeller& silence, double duration_s) {
  const auto duration =
      std::chrono::duration_cast<steady_clock::duration>(std::chrono::duration<double>(duration_s));
  StatisticsByInstrument statistics;
  auto until = steady_clock::now() + duration;
  while (steady_clock::now() < until) {
    const TubeNews news = subscriber.wait_for(std::chrono::milliseconds{20});
    if (news.event == TubeEvent::kTimeout) {
      silence.tell_when_due();
      continue;
    }
    silence.heard();
    if (statistics.empty()) {
      until = steady_clock::now() + duration;
    }
    StreamStatistics& instrument = statistics[printable_text(news.instrument_id)];
    if (news.sample != nullptr) {
      instrument.add(*news.sample);
    } else {
      instrument.add(news.event);
    }
  }
  return statistics;
}

void print(const StatisticsByInstrument& statistics, const SubscriberStatus& status,
           const StatArguments& arguments) {
  if (arguments.as_json) {
    nlohmann::json report{{"seconds", arguments.duration_s},
                          {"refused_backward", status.refused_backward},
                          {"refused_rival", status.refused_rival},
                          {"refused_implausible", status.refused_implausible},
                          {"refused_instruments", status.refused_instruments},
                          {"renewals", status.renewals}};
    report["instruments"] = nlohmann::json::object();
    for (const auto& [id, stream] : statistics) report["instruments"][id] = stream.to_json();
    std::cout << report.dump(2) << '\n';
    return;
  }
  for (const auto& [id, stream] : statistics) std::cout << id << '\n' << stream.table();
  const auto tell = [](std::uint64_t count, const char* what) {
    if (count > 0) std::cout << count << " samples " << what << '\n';
  };
  tell(status.refused_backward, "went backward and were refused: replayed packets");
  tell(status.refused_rival,
       "of another writer of the same instrument were refused: tubectl doctor says who it is");
  tell(status.refused_implausible, "had a number or time that cannot be and were refused: forged");
  tell(status.refused_instruments,
       "of further instruments were refused, beyond eight at a time: choose one with --instrument");
  if (status.renewals > 0) {
    std::cout << "the connection was made anew " << status.renewals
              << " times: packets under the daemon's own DDS identity had made it deaf (forged or damaged)\n";
  }
}

int run_stat(const StatArguments& arguments) {
  try {
    TubeSubscriber subscriber(arguments.subscription, Delivery::kEvery);
    SilenceTeller silence(arguments.subscription, "stat");
    const StatisticsByInstrument statistics = listen(subscriber, silence, arguments.duration_s);
    print(statistics, subscriber.status(), arguments);
    if (statistics.empty()) {
      silence.tell();
      std::cerr << "tubectl: no estimate in " << arguments.duration_s << " s\n";
      return kExitUnavailable;
    }
    return kExitOk;
  } catch (const DdsError& error) {
    std::cerr << "tubectl: " << error.what() << '\n';
    return kExitUnavailable;
  }
}

}  // namespace

CommandLine add_stat(CommandLine app, int& exit_code) {
  auto arguments = std::make_shared<StatArguments>();
  CommandLine verb =
      app.add_subcommand("stat", "Measure rate, latency, loss and validity of what a daemon publishes");
  verb.add_option("--seconds", arguments->duration_s, "How long, from the first sample on")
      .positive()
      .capture_default_str();
  verb.add_flag("--json", arguments->as_json, "JSON instead of a table");
  add_dds_options(verb, arguments->subscription);
  verb.callback([arguments, &exit_code] { exit_code = run_stat(*arguments); });
  return verb;
}

}  // namespace tubed
