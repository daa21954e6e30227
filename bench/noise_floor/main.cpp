// noise_floor_bench: what this machine adds to every latency, with nothing of ours in it: how late a thread
// is woken by a timer (as cyclictest measures it), by a futex, by a packet on lo.
#include <linux/futex.h>
#include <netinet/in.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <climits>
#include <cstdio>
#include <cstring>
#include <stdexcept>

#include "bench/support/benchmark_program.hpp"
#include "bench/support/child_process.hpp"
#include "bench/support/exchange.hpp"
#include "bench/support/latency_plots.hpp"

namespace tubed {
namespace {

struct Choice {
  double seconds = 20;  // of each way, over all turns
  int rounds = 10;
};

enum class Scheduling { kDefault, kFifo };

/// SCHED_FIFO for this process; false when refused.
bool schedule(Scheduling scheduling) {
  if (scheduling == Scheduling::kDefault) return true;
  sched_param parameter{};
  parameter.sched_priority = 80;
  return sched_setscheduler(0, SCHED_FIFO, &parameter) == 0;
}

struct Lateness {
  double t_s;
  double late_us;
};

/// Wakes at 1 kHz by the clock, one process a turn, so that default and real-time scheduling take turns.
void wake_by_timer(Scheduling scheduling, double seconds, std::int64_t begin_ns, SharedLog<Lateness>& log) {
  if (!schedule(scheduling)) throw std::runtime_error("real-time scheduling was refused");
  mlockall(MCL_CURRENT | MCL_FUTURE);
  const std::int64_t start_ns = monotonic_ns() + 10'000'000;
  for (std::int64_t k = 0; k < static_cast<std::int64_t>(seconds * 1000); ++k) {
    const std::int64_t due_ns = start_ns + k * 1'000'000;
    sleep_until_ns(due_ns);
    const std::int64_t now_ns = monotonic_ns();
    log.add({static_cast<double>(now_ns - begin_ns) / 1e9, static_cast<double>(now_ns - due_ns) / 1e3});
  }
}

struct Word {
  std::uint32_t number;
};

/// A futex in shared memory and nothing else.
class FutexSender final : public Sender {
 public:
  explicit FutexSender(Word* word) : word_(word) {}
  void send(std::uint32_t number) override {
    __atomic_store_n(&word_->number, number, __ATOMIC_RELEASE);  // pairs with the load of the receiver
    syscall(SYS_futex, &word_->number, FUTEX_WAKE, INT_MAX, nullptr, nullptr, 0);
  }

 private:
  Word* word_;
};

class FutexReceiver final : public Receiver {
 public:
  explicit FutexReceiver(Word* word) : word_(word) {}
  void receive(const std::function<bool()>& is_over, const Arrived& arrived) override {
    std::uint32_t seen = UINT32_MAX;
    while (!is_over()) {
      const std::uint32_t now = __atomic_load_n(&word_->number, __ATOMIC_ACQUIRE);  // pairs with the store
      if (now != seen) {
        arrived(now, monotonic_ns());
        seen = now;
        continue;
      }
      const timespec timeout{0, 50'000'000};
      syscall(SYS_futex, &word_->number, FUTEX_WAIT, seen, &timeout, nullptr, 0);
    }
  }

 private:
  Word* word_;
};

constexpr std::uint16_t kPort = 45454;

sockaddr_in loopback() {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(kPort);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return address;
}

using Packet = std::array<char, 11048>;

/// One packet as large as an estimate.
class PacketSender final : public Sender {
 public:
  PacketSender() : socket_(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {}
  void send(std::uint32_t number) override {
    const sockaddr_in to = loopback();
    std::memcpy(packet_.data(), &number, sizeof number);
    sendto(socket_, packet_.data(), packet_.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to);
  }

 private:
  int socket_;
  Packet packet_{};
};

class PacketReceiver final : public Receiver {
 public:
  PacketReceiver() : socket_(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    const sockaddr_in here = loopback();
    const timeval timeout{0, 50'000};
    setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof timeout);
    if (bind(socket_, reinterpret_cast<const sockaddr*>(&here), sizeof here) != 0)
      throw std::runtime_error("bind");
  }
  void receive(const std::function<bool()>& is_over, const Arrived& arrived) override {
    while (!is_over()) {
      if (recv(socket_, packet_.data(), packet_.size(), 0) <= 0) continue;
      std::uint32_t number = 0;
      std::memcpy(&number, packet_.data(), sizeof number);
      arrived(number, monotonic_ns());
    }
  }

 private:
  int socket_;
  Packet packet_{};
};

void add_log(Report& report, const std::string& name, const SharedLog<Lateness>& log) {
  ReportRow row{name, "us", {}, "", {}, {}, {}};
  for (std::size_t i = 0; i < log.size(); ++i) {
    row.values.push_back(log[i].late_us);
    row.t_s.push_back(log[i].t_s);
  }
  if (!row.values.empty()) report.add(std::move(row));
}

void measure_timers(const Choice& choice, Report& report) {
  const double turn_s = choice.seconds / choice.rounds;
  const auto most = static_cast<std::size_t>(choice.seconds * 1000) + 1000;
  SharedLog<Lateness> by_default(most);
  SharedLog<Lateness> by_fifo(most);
  const bool may_fifo = ChildProcess([] {
                          if (!schedule(Scheduling::kFifo))
                            throw std::runtime_error("no SCHED_FIFO here: left out");
                        }).wait() == 0;
  const std::int64_t begin_ns = monotonic_ns();
  for (int round = 0; round < choice.rounds; ++round) {
    ChildProcess([&] { wake_by_timer(Scheduling::kDefault, turn_s, begin_ns, by_default); }).wait();
    if (may_fifo) ChildProcess([&] { wake_by_timer(Scheduling::kFifo, turn_s, begin_ns, by_fifo); }).wait();
  }
  add_log(report, "noise_floor/timer/default", by_default);
  add_log(report, "noise_floor/timer/fifo", by_fifo);
}

void measure_wakes(const Choice& choice, Report& report) {
  const SharedMemory memory(sizeof(Word));
  Word* word = memory.as<Word>();
  const std::vector<Route> routes{
      {"futex", Placement::kProcesses, [word] { return std::make_unique<FutexSender>(word); },
       [word] { return std::make_unique<FutexReceiver>(word); }},
      {"packet-10KB", Placement::kProcesses, [] { return std::make_unique<PacketSender>(); },
       [] { return std::make_unique<PacketReceiver>(); }}};
  for (const double rate_hz : {30.0, 1000.0}) {
    word->number = UINT32_MAX;  // what the receiver takes for nothing
    const auto times = exchange(routes, {rate_hz, 1, choice.rounds, choice.seconds / choice.rounds});
    for (std::size_t i = 0; i < routes.size(); ++i) {
      char name[60];
      std::snprintf(name, sizeof name, "noise_floor/%s/%g", routes[i].name.c_str(), rate_hz);
      report.add({name, "us", times[i].latency_us, "", {}, {}, times[i].t_s});
    }
  }
}

void measure(const Choice& choice, Report& report) {
  measure_timers(choice, report);
  measure_wakes(choice, report);
}

std::map<std::string, std::string> draw(const nlohmann::json& report) {
  const std::vector<PlotPanel> panels{
      panel_of("woken late by the clock, 1 kHz", report, "noise_floor/timer/"),
      panel_of("woken by a futex (Hz)", report, "noise_floor/futex/"),
      panel_of("woken by a packet on lo (Hz)", report, "noise_floor/packet-10KB/")};
  return {{"", percentile_plots("What this machine adds to every latency", panels)},
          {"histogram", histogram_plots("What this machine adds to every latency", panels)},
          {"series", series_plots("What this machine adds to every latency", panels)}};
}

}  // namespace
}  // namespace tubed

int main(int argc, char** argv) {
  tubed::Choice choice;
  return tubed::run_benchmark(
      {"noise_floor", "What this machine adds to every latency: waking by clock, futex, packet.",
       tubed::Surroundings::kOwnNetwork,
       [&](tubed::CommandLine app) {
         app.add_option("--seconds", choice.seconds, "of each way")
             .in_range(1.0, 3600.0)
             .capture_default_str();
         app.add_option("--rounds", choice.rounds, "turns of each way")
             .in_range(2, 1000)
             .capture_default_str();
       },
       [&](tubed::Report& report) { tubed::measure(choice, report); }, tubed::draw},
      argc, argv);
}
