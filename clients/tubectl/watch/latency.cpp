// tubectl latency: where the time between an exposure and its shape goes, in a running installation.
#include <chrono>
#include <ctime>
#include <iostream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "clients/cpp/tube_subscriber.hpp"
#include "clients/evaluation/latency_statistics.hpp"
#include "clients/tubectl/verbs.hpp"
#include "clients/tubectl/watch/dds_options.hpp"
#include "clients/tubectl/watch/glass.hpp"
#include "clients/tubectl/watch/silence.hpp"
#include "idl/dds_entity.hpp"
#include "idl/kernel_clock.hpp"
#include "idl/printable_text.hpp"

namespace tubed {
namespace {

using std::chrono::steady_clock;

struct LatencyArguments {
  Subscription subscription;
  double duration_s = 10;
  double speed_mm_s = 10;
  bool as_json = false;
  GlassArguments glass;  ///< its `where` empty: no flashes
};

using StatisticsByInstrument = std::map<std::string, LatencyStatistics>;

std::int64_t clock_ns(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return static_cast<std::int64_t>(now.tv_sec) * 1'000'000'000 + now.tv_nsec;
}

HostClock host_clock() {
  HostClock clock;
  // Between the two readings time may pass: the monotonic one is read before and after.
  const std::int64_t before_ns = clock_ns(CLOCK_MONOTONIC);
  const std::int64_t realtime_ns = clock_ns(CLOCK_REALTIME);
  const std::int64_t after_ns = clock_ns(CLOCK_MONOTONIC);
  clock.realtime_minus_monotonic_ns = realtime_ns - (before_ns + after_ns) / 2;
  const KernelClock kernel = read_kernel_clock();
  clock.is_synchronised = kernel.reference == ClockReference::kFollowed;
  clock.max_error_ns = kernel.max_error_ns;
  return clock;
}

/// Listens for the time asked for, counted from the first sample; gives up when none comes in that time.
StatisticsByInstrument listen(TubeSubscriber& subscriber, double duration_s) {
  const auto duration =
      std::chrono::duration_cast<steady_clock::duration>(std::chrono::duration<double>(duration_s));
  StatisticsByInstrument statistics;
  auto until = steady_clock::now() + duration;
  while (steady_clock::now() < until) {
    const TubeNews news = subscriber.wait_for(std::chrono::milliseconds{20});
    if (news.sample == nullptr) continue;
    if (statistics.empty()) until = steady_clock::now() + duration;
    statistics[printable_text(news.instrument_id)].add(*news.sample, host_clock());
  }
  return statistics;
}

void print(const StatisticsByInstrument& statistics, const LatencyArguments& arguments) {
  if (!arguments.as_json) {
    for (const auto& [id, latency] : statistics)
      std::cout << id << '\n' << latency.table(arguments.speed_mm_s);
    return;
  }
  nlohmann::json report{{"seconds", arguments.duration_s}, {"instruments", nlohmann::json::object()}};
  for (const auto& [id, latency] : statistics)
    report["instruments"][id] = latency.to_json(arguments.speed_mm_s);
  std::cout << report.dump(2) << '\n';
}

int run_latency(const LatencyArguments& arguments) {
  try {
    if (!arguments.glass.where.empty()) {
      GlassArguments glass = arguments.glass;
      glass.duration_s = arguments.duration_s;
      glass.speed_mm_s = arguments.speed_mm_s;
      glass.as_json = arguments.as_json;
      return measure_glass(glass, arguments.subscription);
    }
    TubeSubscriber subscriber(arguments.subscription, Delivery::kEvery);
    const StatisticsByInstrument statistics = listen(subscriber, arguments.duration_s);
    print(statistics, arguments);
    if (statistics.empty()) {
      std::cerr << "tubectl: no estimate in " << arguments.duration_s << " s\n";
      SilenceTeller(arguments.subscription, "latency").tell();
      return kExitUnavailable;
    }
    return kExitOk;
  } catch (const std::runtime_error& error) {
    std::cerr << "tubectl: " << error.what() << '\n';
    return kExitUnavailable;
  }
}

}  // namespace

CommandLine add_latency(CommandLine app, int& exit_code) {
  auto arguments = std::make_shared<LatencyArguments>();
  CommandLine verb = app.add_subcommand(
      "latency", "Show where the time from exposure to shape goes, and how far a catheter moves meanwhile");
  verb.add_option("--seconds", arguments->duration_s, "How long, from the first sample on")
      .positive()
      .capture_default_str();
  verb.add_option("--speed", arguments->speed_mm_s, "Speed of the catheter for latency in mm, mm/s")
      .positive()
      .capture_default_str();
  verb.add_option(
      "--glass", arguments->glass.where,
      "Flash, and count from the light to the shape. terminal: here, for a capture card that sees this "
      "monitor; or the path of a socket: no light, a grabber there for driver image_shm, what the software "
      "takes. One camera alone. Not in an operation: images are white at times");
  verb.add_option("--camera", arguments->glass.camera, "With --glass SOCKET: its name").capture_default_str();
  verb.add_option("--size", arguments->glass.size_px, "With --glass SOCKET: width,height of its pictures, px")
      .delimiter(',')
      .expected(2, 2)
      .in_range(64, 2048)
      .capture_default_str();
  verb.add_flag("--json", arguments->as_json, "JSON instead of a table");
  add_dds_options(verb, arguments->subscription);
  verb.callback([arguments, &exit_code] { exit_code = run_latency(*arguments); });
  return verb;
}

}  // namespace tubed
