// publish_bench: how long a published shape is under way to a process that waits for it.
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <optional>

#include "bench/peers/cyclone_peers.hpp"
#ifdef TUBED_BENCH_FASTDDS
#include "bench/peers/fastdds_peers.hpp"
#endif
#include "bench/publish/own_routes.hpp"
#include "bench/support/benchmark_program.hpp"
#include "bench/support/latency_plots.hpp"
#include "clients/tubectl/run/room_keys.hpp"

namespace tubed {
namespace {

// Places of our own among the routes; the peer of each comes after it.
constexpr std::size_t kUdp = 0;
constexpr std::size_t kShm = 2;

struct Choice {
  std::vector<double> rates_hz{30, 1000};
  std::vector<int> readers{1, 4, 8};
  int rounds = 6;
  double turn_s = 2;
};

std::string case_name(const std::string& route, double rate_hz, int readers) {
  char text[80];
  std::snprintf(text, sizeof text, "publish/%s/%g/%d", route.c_str(), rate_hz, readers);
  return text;
}

/// A route's row, with those of its peer where it has one.
ReportRow row_of(const std::string& name, const RouteTimes& times, const std::string& peer,
                 const RouteTimes* peer_times) {
  ReportRow row{name, "us", times.latency_us, "", {}, {}, times.t_s};
  if (peer_times != nullptr) {
    row.peer = peer;
    row.peer_values = peer_times->latency_us;
    row.extra["ratio_p50"] = percentile(times.latency_us, 50) / percentile(peer_times->latency_us, 50);
  }
  row.extra["send_p50_us"] = percentile(times.send_us, 50);
  row.extra["send_max_us"] = percentile(times.send_us, 100);
  row.extra["sender_late_p50_us"] = percentile(times.late_us, 50);
  row.extra["lost"] = static_cast<double>(times.expected - std::min(times.expected, times.latency_us.size()));
  return row;
}

/// The place of the route's peer, if it has one: a bare writer, or for the secured one the same without keys.
std::optional<std::size_t> peer_of(const std::vector<Route>& routes, std::size_t i) {
  if (i + 1 == routes.size()) return kUdp;
  if ((i == kUdp || i == kShm) && i + 2 < routes.size()) return i + 1;
  return std::nullopt;
}

/// Keys of a room that nobody else has.
std::filesystem::path make_keys(const std::filesystem::path& folder) {
  const std::filesystem::path room = folder / "room";
  make_room(room, "", period_of(std::time(nullptr), 1));
  return room;
}

void measure(const Choice& choice, Report& report) {
  const std::filesystem::path folder = std::filesystem::temp_directory_path();
  std::vector<Route> routes{own_udp(), cyclone_udp(), own_shared_memory(folder)};
  ChildProcess roudi;
  if (has_roudi()) {
    roudi = start_roudi(folder);
    routes.push_back(cyclone_loans());
    routes.push_back(cyclone_shared_memory());
  } else {
    std::printf("no iox-roudi (apt-get install iceoryx): without Cyclone's shared memory as a peer\n");
  }
#ifdef TUBED_BENCH_FASTDDS
  routes.push_back(fastdds_udp());
  routes.push_back(fastdds_as_it_comes());
#endif
  routes.push_back(own_udp_secured(make_keys(folder)));  // always the last
  for (const int readers : choice.readers) {
    for (const double rate_hz : choice.rates_hz) {
      // At 1 kHz a second has samples enough.
      const double turn_s = rate_hz > 100 ? choice.turn_s / 2 : choice.turn_s;
      const auto times = exchange(routes, {rate_hz, readers, choice.rounds, turn_s});
      for (std::size_t i = 0; i < routes.size(); ++i) {
        const std::optional<std::size_t> peer = peer_of(routes, i);
        report.add(row_of(case_name(routes[i].name, rate_hz, readers), times[i],
                          peer ? routes[*peer].name : "", peer ? &times[*peer] : nullptr));
      }
      std::fprintf(stderr, "%d readers at %g Hz: done\n", readers, rate_hz);
    }
  }
}

std::map<std::string, std::string> draw(const nlohmann::json& report) {
  std::vector<PlotPanel> panels;
  for (const char* rate : {"30", "1000"}) {
    for (const char* readers : {"1", "4", "8"}) {
      PlotPanel panel{std::string(rate) + " Hz, readers: " + readers, {}};
      for (const auto& row : report.at("rows")) {
        const auto name = row.at("name").get<std::string>();
        const std::string end = std::string("/") + rate + "/" + readers;
        if (name.ends_with(end)) panel.rows.push_back({name.substr(8, name.size() - 8 - end.size()), row});
      }
      if (!panel.rows.empty()) panels.push_back(panel);
    }
  }
  return {{"", percentile_plots("From publishing to having the shape, one way", panels)},
          {"histogram", histogram_plots("From publishing to having the shape, one way", panels)}};
}

}  // namespace
}  // namespace tubed

int main(int argc, char** argv) {
  tubed::Choice choice;
  return tubed::run_benchmark(
      {"publish",
       "How long a published shape is under way to processes that wait for it, by turns with peers.",
       tubed::Surroundings::kOwnNetwork,
       [&](tubed::CommandLine app) {
         app.add_option("--rates", choice.rates_hz, "samples a second").delimiter(',').capture_default_str();
         app.add_option("--readers", choice.readers, "processes that receive")
             .delimiter(',')
             .capture_default_str();
         app.add_option("--rounds", choice.rounds, "turns of every route").in_range(1, 1000);
         app.add_option("--turn", choice.turn_s, "length of a turn, s").in_range(0.2, 600.0);
       },
       [&](tubed::Report& report) { tubed::measure(choice, report); }, tubed::draw},
      argc, argv);
}
