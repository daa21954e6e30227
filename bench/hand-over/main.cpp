// hand-over_bench: how long bytes are under way between threads and between processes, without publishing.
#include <cstdio>
#include <filesystem>

#include "bench/hand-over/process_routes.hpp"
#include "bench/hand-over/thread_routes.hpp"
#include "bench/peers/cyclone_peers.hpp"
#include "bench/support/benchmark_program.hpp"
#include "bench/support/latency_plots.hpp"

namespace tubed {
namespace {

struct Choice {
  std::vector<double> rates_hz{30, 1000};
  std::vector<int> readers{1, 4, 8};
  int rounds = 6;
  double turn_s = 1.5;
};

/// What is carried; the first route is ours, the second its peer.
struct Freight {
  std::string name;
  std::vector<Route> routes;
  double max_hz;  ///< not measured at a higher rate
  int max_readers;
};

std::vector<Freight> freights(const std::filesystem::path& folder, bool with_shared_memory_peer) {
  constexpr std::size_t kHead = 128;
  const auto image = [&](const std::string& name, std::size_t pixels) {
    return Freight{name, {shm_ring(folder, kHead + pixels), unix_socket(folder, kHead + pixels)}, 60, 4};
  };
  std::vector<Route> block{shm_ring(folder, 8192), unix_socket(folder, 8192), cyclone_udp()};
  if (with_shared_memory_peer) block.insert(block.begin() + 1, cyclone_loans());
  return {{"threads/estimate", {triple_buffer(), mutex_and_condition()}, 1e9, 1},
          {"8KB", std::move(block), 1e9, 1000},
          image("image-400x600", 400 * 600),
          image("image-1024x1024", 1024 * 1024)};
}

void measure_freight(const Freight& freight, const ExchangePlan& plan, Report& report) {
  const auto times = exchange(freight.routes, plan);
  for (std::size_t i = 0; i < times.size(); ++i) {
    char name[120];
    std::snprintf(name, sizeof name, "handover/%s/%s/%g/%d", freight.name.c_str(),
                  freight.routes[i].name.c_str(), plan.rate_hz, plan.receivers);
    ReportRow row{name, "us", times[i].latency_us, "", {}, {}, times[i].t_s};
    if (i == 0) {
      row.peer = freight.routes[1].name;
      row.peer_values = times[1].latency_us;
      row.extra["ratio_p50"] = percentile(row.values, 50) / percentile(row.peer_values, 50);
    }
    row.extra["send_p50_us"] = percentile(times[i].send_us, 50);
    row.extra["lost"] =
        static_cast<double>(times[i].expected - std::min(times[i].expected, row.values.size()));
    report.add(std::move(row));
  }
}

void measure(const Choice& choice, Report& report) {
  const std::filesystem::path folder = std::filesystem::temp_directory_path();
  ChildProcess roudi;
  if (has_roudi()) {
    roudi = start_roudi(folder);
  } else {
    std::printf("no iox-roudi (apt-get install iceoryx): without Cyclone's shared memory as a peer\n");
  }
  for (const double rate_hz : choice.rates_hz) {
    for (const int readers : choice.readers) {
      for (const Freight& freight : freights(folder, has_roudi())) {
        if (rate_hz > freight.max_hz || readers > freight.max_readers) continue;
        const double turn_s = rate_hz > 100 ? choice.turn_s / 2 : choice.turn_s;
        measure_freight(freight, {rate_hz, readers, choice.rounds, turn_s}, report);
        std::fprintf(stderr, "%s, %d readers at %g Hz: done\n", freight.name.c_str(), readers, rate_hz);
      }
    }
  }
}

/// One panel for what is carried, rate and readers; a curve a way.
std::map<std::string, std::string> draw(const nlohmann::json& report) {
  std::vector<PlotPanel> panels;
  for (const auto& row : report.at("rows")) {
    const auto name = row.at("name").get<std::string>().substr(std::string("handover/").size());
    const std::size_t readers = name.rfind('/');
    const std::size_t rate = name.rfind('/', readers - 1);
    const std::size_t way = name.rfind('/', rate - 1);
    const std::string title = name.substr(0, way) + " at " + name.substr(rate + 1, readers - rate - 1) +
                              " Hz, receivers: " + name.substr(readers + 1);
    if (panels.empty() || panels.back().title != title) panels.push_back({title, {}});
    panels.back().rows.push_back({name.substr(way + 1, rate - way - 1), row});
  }
  return {{"", percentile_plots("From one thread or process to another, one way", panels)}};
}

}  // namespace
}  // namespace tubed

int main(int argc, char** argv) {
  tubed::Choice choice;
  return tubed::run_benchmark(
      {"hand-over", "How long bytes are under way between threads and processes, by turns with peers.",
       tubed::Surroundings::kOwnNetwork,
       [&](tubed::CommandLine app) {
         app.add_option("--rates", choice.rates_hz, "samples a second").delimiter(',').capture_default_str();
         app.add_option("--readers", choice.readers, "who receives").delimiter(',').capture_default_str();
         app.add_option("--rounds", choice.rounds, "turns of every route").in_range(1, 1000);
         app.add_option("--turn", choice.turn_s, "length of a turn, s").in_range(0.2, 600.0);
       },
       [&](tubed::Report& report) { tubed::measure(choice, report); }, tubed::draw},
      argc, argv);
}
