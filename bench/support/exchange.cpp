#include "bench/support/exchange.hpp"

#include <cerrno>
#include <ctime>
#include <stdexcept>
#include <thread>

#include "bench/support/child_process.hpp"

namespace tubed {

namespace {

constexpr std::int64_t kSecondNs = 1'000'000'000;
constexpr double kWarmUpShare = 0.1;

struct Sent {
  std::int64_t due_ns;
  std::int64_t sent_ns;
  std::int64_t returned_ns;
  bool counts;
};

struct Received {
  std::uint32_t number;
  std::int64_t received_ns;
};

/// What the starting process tells all others.
struct Signals {
  std::int64_t first_turn_ns;  ///< 0: not yet
  bool is_over;
};

/// A word that is written by one process and read by others.
template <typename T>
void tell(T& word, T value) {
  __atomic_store_n(&word, value, __ATOMIC_RELEASE);  // pairs with heard()
}
template <typename T>
T heard(const T& word) {
  return __atomic_load_n(&word, __ATOMIC_ACQUIRE);  // pairs with tell()
}

struct Line {
  SharedLog<Sent> sent;
  std::vector<SharedLog<Received>> received;  ///< one a receiver; hello is in it too, once
};

std::size_t samples_a_turn(const ExchangePlan& plan) {
  return static_cast<std::size_t>(plan.rate_hz * plan.turn_s);
}

class Exchange {
 public:
  Exchange(const std::vector<Route>& routes, const ExchangePlan& plan)
      : routes_(routes), plan_(plan), memory_(sizeof(Signals)) {
    const std::size_t most = samples_a_turn(plan) * static_cast<std::size_t>(plan.rounds) + 1;
    for (std::size_t i = 0; i < routes.size(); ++i) {
      lines_.push_back({SharedLog<Sent>(most), {}});
      for (int k = 0; k < plan.receivers; ++k) lines_.back().received.emplace_back(most);
    }
  }

  std::vector<RouteTimes> run() {
    std::vector<ChildProcess> children;
    for (std::size_t i = 0; i < routes_.size(); ++i) start(i, children);
    wait_for_hellos();
    tell(signals().first_turn_ns, monotonic_ns() + kSecondNs / 5);
    sleep_until_ns(turn_start_ns(static_cast<std::size_t>(plan_.rounds), 0) + kSecondNs / 2);
    tell(signals().is_over, true);
    for (ChildProcess& child : children) {
      if (child.wait() != 0) throw std::runtime_error("a process of the exchange failed");
    }
    std::vector<RouteTimes> all;
    for (const Line& line : lines_) all.push_back(times_of(line));
    return all;
  }

 private:
  Signals& signals() const { return *memory_.as<Signals>(); }

  void start(std::size_t i, std::vector<ChildProcess>& children) {
    const Route& route = routes_[i];
    if (route.placement == Placement::kThreads) {
      children.emplace_back([this, i] { run_threads(i); });
      return;
    }
    for (int k = 0; k < plan_.receivers; ++k) {
      children.emplace_back([this, i, k] { receive(i, static_cast<std::size_t>(k)); });
    }
    children.emplace_back([this, i] { send(i); });
  }

  void run_threads(std::size_t i) {
    std::vector<std::thread> threads;
    for (int k = 0; k < plan_.receivers; ++k) {
      threads.emplace_back([this, i, k] { receive(i, static_cast<std::size_t>(k)); });
    }
    send(i);
    for (std::thread& thread : threads) thread.join();
  }

  void receive(std::size_t i, std::size_t k) {
    SharedLog<Received>& log = lines_[i].received[k];
    bool said_hello = false;
    routes_[i].make_receiver()->receive([this] { return heard(signals().is_over); },
                                        [&](std::uint32_t number, std::int64_t received_ns) {
                                          if (number != 0 || !said_hello) log.add({number, received_ns});
                                          said_hello = true;
                                        });
  }

  void send(std::size_t i) {
    const std::unique_ptr<Sender> sender = routes_[i].make_sender();
    while (heard(signals().first_turn_ns) == 0 && !heard(signals().is_over)) {
      sender->send(0);
      sleep_until_ns(monotonic_ns() + kSecondNs / 50);
    }
    std::uint32_t number = 0;
    for (std::size_t round = 0; round < static_cast<std::size_t>(plan_.rounds); ++round) {
      const std::int64_t start_ns = turn_start_ns(round, i);
      while (monotonic_ns() + kSecondNs / 10 < start_ns) {
        sender->rest();
        sleep_until_ns(monotonic_ns() + kSecondNs / 10);
      }
      for (std::size_t sample = 0; sample < samples_a_turn(plan_); ++sample) {
        const std::int64_t due_ns =
            start_ns + static_cast<std::int64_t>(static_cast<double>(sample) * 1e9 / plan_.rate_hz);
        sleep_until_ns(due_ns);
        const std::int64_t sent_ns = monotonic_ns();
        sender->send(++number);
        const bool counts =
            static_cast<double>(sample) >= kWarmUpShare * static_cast<double>(samples_a_turn(plan_));
        lines_[i].sent.add({due_ns, sent_ns, monotonic_ns(), counts});
      }
    }
    while (!heard(signals().is_over)) sleep_until_ns(monotonic_ns() + kSecondNs / 50);
  }

  [[nodiscard]] std::int64_t turn_start_ns(std::size_t round, std::size_t route) const {
    const auto turn = static_cast<double>(round * routes_.size() + route);
    return heard(signals().first_turn_ns) + static_cast<std::int64_t>(turn * plan_.turn_s * 1e9);
  }

  void wait_for_hellos() {
    const std::int64_t until_ns = monotonic_ns() + 20 * kSecondNs;
    for (std::size_t i = 0; i < lines_.size(); ++i) {
      for (const SharedLog<Received>& log : lines_[i].received) {
        while (log.size() == 0) {
          if (monotonic_ns() > until_ns) {
            tell(signals().is_over, true);
            throw std::runtime_error("route " + routes_[i].name + ": a receiver never heard its sender");
          }
          sleep_until_ns(monotonic_ns() + kSecondNs / 50);
        }
      }
    }
  }

  RouteTimes times_of(const Line& line) const {
    RouteTimes times;
    const std::int64_t begin_ns = heard(signals().first_turn_ns);
    std::vector<std::vector<std::int64_t>> arrivals(line.sent.size());
    for (const SharedLog<Received>& log : line.received) {
      for (std::size_t k = 0; k < log.size(); ++k) {
        const std::uint32_t number = log[k].number;
        if (number >= 1 && number <= arrivals.size()) arrivals[number - 1].push_back(log[k].received_ns);
      }
    }
    for (std::size_t k = 0; k < line.sent.size(); ++k) {
      const Sent& sent = line.sent[k];
      if (!sent.counts) continue;
      times.expected += line.received.size();
      times.send_us.push_back(static_cast<double>(sent.returned_ns - sent.sent_ns) / 1e3);
      times.late_us.push_back(static_cast<double>(sent.sent_ns - sent.due_ns) / 1e3);
      for (const std::int64_t received_ns : arrivals[k]) {
        times.latency_us.push_back(static_cast<double>(received_ns - sent.sent_ns) / 1e3);
        times.t_s.push_back(static_cast<double>(sent.sent_ns - begin_ns) / 1e9);
      }
    }
    return times;
  }

  const std::vector<Route>& routes_;
  ExchangePlan plan_;
  SharedMemory memory_;
  std::vector<Line> lines_;
};

}  // namespace

std::int64_t monotonic_ns() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * kSecondNs + now.tv_nsec;
}

void sleep_until_ns(std::int64_t due_ns) {
  const timespec until{due_ns / kSecondNs, due_ns % kSecondNs};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr) == EINTR) {
  }
}

std::vector<RouteTimes> exchange(const std::vector<Route>& routes, const ExchangePlan& plan) {
  return Exchange(routes, plan).run();
}

}  // namespace tubed
