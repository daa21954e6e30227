// tubed-exporter: the daemon's health for Prometheus, from a process of its own.
#include <chrono>
#include <csignal>
#include <cstdio>
#include <exception>
#include <iostream>
#include <memory>

#include "clients/cpp/limited_log.hpp"
#include "clients/cpp/topic_reader.hpp"
#include "clients/exporter/http_server.hpp"
#include "clients/exporter/metrics_text.hpp"
#include "idl/command_line/command_line.hpp"

namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr int kExitUsage = 64;
constexpr int kExitUnavailable = 69;
constexpr std::chrono::seconds kTimeout{3};

volatile std::sig_atomic_t must_end = 0;

std::int64_t now_ns() { return std::chrono::nanoseconds(steady_clock::now().time_since_epoch()).count(); }

/// The newest reports of every instrument.
class Reports {
 public:
  explicit Reports(const tubed::Subscription& subscription)
      : status_(std::make_unique<tubed::TopicReader<tubed_TubeStatus>>(subscription)),
        health_(std::make_unique<tubed::TopicReader<tubed_TubeHealth>>(subscription)) {}

  void take() {
    while (const tubed_TubeStatus* status = status_->take()) {
      tubed::InstrumentReports& reports = instruments_[status->instrument_id];
      reports.status = *status;
      reports.status_received_ns = now_ns();
    }
    while (const tubed_TubeHealth* health = health_->take()) {
      tubed::InstrumentReports& reports = instruments_[health->instrument_id];
      reports.health = *health;
      reports.health_received_ns = now_ns();
    }
    std::erase_if(instruments_, [this](const auto& entry) { return !status_->has(entry.first); });
  }

  [[nodiscard]] std::string text() const { return tubed::metrics_text(instruments_, now_ns()); }

  /// Both reports have come of every instrument heard of, and there is one.
  [[nodiscard]] bool is_complete() const {
    for (const auto& [id, reports] : instruments_) {
      if (reports.status_received_ns == 0 || reports.health_received_ns == 0) return false;
    }
    return !instruments_.empty();
  }

 private:
  std::unique_ptr<tubed::TopicReader<tubed_TubeStatus>> status_;
  std::unique_ptr<tubed::TopicReader<tubed_TubeHealth>> health_;
  std::map<std::string, tubed::InstrumentReports> instruments_;
};

int print_once(Reports& reports) {
  const auto until = steady_clock::now() + kTimeout;
  while (!reports.is_complete() && steady_clock::now() < until) {
    timespec pause{0, 20'000'000};
    nanosleep(&pause, nullptr);
    reports.take();
  }
  std::cout << reports.text();
  return reports.is_complete() ? 0 : kExitUnavailable;
}

int serve(Reports& reports, const std::string& where) {
  tubed::HttpServer server(where, [&] {
    reports.take();
    return reports.text();
  });
  std::cerr << "tubed-exporter answers on http://" << where << "/metrics\n";
  while (must_end == 0) {
    server.serve(milliseconds{200});
    reports.take();
  }
  return 0;
}

int run(int argc, char** argv) {
  tubed::Program program(
      "Shows the health of a tubed to Prometheus. Research software, not a medical device.",
      "tubed-exporter");
  tubed::CommandLine app = program.command_line();
  tubed::Subscription subscription;
  std::string where = "127.0.0.1:9756";
  bool once = false;
  app.add_option("--listen", where, "ADDRESS:PORT to answer on").capture_default_str();
  app.add_flag("--once", once, "Print the metrics after one report of the daemon, and end");
  app.add_option("--domain", subscription.domain, "DDS domain of the daemon")
      .in_range(0, 230)
      .capture_default_str();
  app.add_option("--partition", subscription.partition, "The room, as in the daemon's configuration");
  app.add_option("--interface", subscription.network_interface, "Network interface, name or address")
      .capture_default_str();
  app.add_option("--security", subscription.security,
                 "Folder with keys of its own, made by `tubectl keys`: DDS Security on");
  program.set_version("tubed-exporter " TUBED_VERSION);
  if (const auto ended = program.parse(argc, argv)) return *ended;
  std::signal(SIGTERM, [](int) { must_end = 1; });
  std::signal(SIGINT, [](int) { must_end = 1; });
  tubed::limit_cyclone_log();
  Reports reports(subscription);
  return once ? print_once(reports) : serve(reports, where);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::invalid_argument& error) {
    std::fprintf(stderr, "tubed-exporter: %s\n", error.what());
    return kExitUsage;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "tubed-exporter: %s\n", error.what());
    return kExitUnavailable;
  }
}
