// One sender, some receivers, several ways of getting a sample across, by turns: A B C A B C. One-way latency
// from just before the send to the moment the receiver has its copy, on one clock (CLOCK_MONOTONIC).
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "bench/support/report.hpp"

namespace tubed {

/// CLOCK_MONOTONIC, ns.
std::int64_t monotonic_ns();

/// Sleeps until CLOCK_MONOTONIC `due_ns`; returns at once when it has passed.
void sleep_until_ns(std::int64_t due_ns);

/// Number 0 of a sample means "hello": it tells that sender and receiver have found each other.
class Sender {
 public:
  virtual ~Sender() = default;
  virtual void send(std::uint32_t number) = 0;
  /// Every 100 ms while others have their turn: shows receivers that it is still there, where they ask for
  /// it.
  virtual void rest() {}
};

/// Called for each sample as soon as the receiver has it.
using Arrived = std::function<void(std::uint32_t number, std::int64_t received_ns)>;

class Receiver {
 public:
  virtual ~Receiver() = default;
  /// Receives until `is_over()`, to be asked at least every 100 ms.
  virtual void receive(const std::function<bool()>& is_over, const Arrived& arrived) = 0;
};

enum class Placement {
  kProcesses,  ///< sender and receivers are processes of their own
  kThreads,    ///< threads of one process
};

/// One way across.
struct Route {
  std::string name;
  Placement placement = Placement::kProcesses;
  std::function<std::unique_ptr<Sender>()> make_sender;
  std::function<std::unique_ptr<Receiver>()> make_receiver;
};

struct ExchangePlan {
  double rate_hz = 30;
  int receivers = 1;
  int rounds = 6;     ///< turns of every route
  double turn_s = 2;  ///< length of a turn; its first tenth is not counted
};

/// What one route took, over all receivers.
struct RouteTimes {
  std::vector<double> latency_us;  ///< in the order of sending
  std::vector<double> t_s;         ///< when each was sent
  std::vector<double> send_us;     ///< duration of the send, one a sample
  std::vector<double> late_us;     ///< how late the sender was woken, one a sample
  std::size_t expected = 0;        ///< samples times receivers
};

/// Element i is routes[i]. Forks: call it in a process without threads. Throws std::runtime_error when a
/// receiver does not hear its sender within 20 s.
std::vector<RouteTimes> exchange(const std::vector<Route>& routes, const ExchangePlan& plan);

}  // namespace tubed
