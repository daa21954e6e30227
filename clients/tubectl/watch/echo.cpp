// tubectl echo: prints samples as they come.
#include <chrono>
#include <cstring>
#include <iostream>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "clients/cpp/shm_tube_reader.hpp"
#include "clients/cpp/topic_reader.hpp"
#include "clients/cpp/tube_subscriber.hpp"
#include "clients/tubectl/verbs.hpp"
#include "clients/tubectl/watch/dds_options.hpp"
#include "clients/tubectl/watch/sample_text.hpp"
#include "clients/tubectl/watch/silence.hpp"
#include "idl/printable_text.hpp"

namespace tubed {
namespace {

using std::chrono::steady_clock;

struct EchoArguments {
  Subscription subscription;
  std::string topic = "estimate";
  std::string shm_socket;  // empty: DDS
  bool as_json = false;
  std::uint64_t count = std::numeric_limits<std::uint64_t>::max();
  double duration_s = 0;  // 0: for ever
};

/// How long and how many are still to come.
class Budget {
 public:
  explicit Budget(const EchoArguments& arguments)
      : left_(arguments.count),
        is_timed_(arguments.duration_s > 0),
        until_(steady_clock::now() + std::chrono::duration_cast<steady_clock::duration>(
                                         std::chrono::duration<double>(arguments.duration_s))) {}

  [[nodiscard]] bool is_spent() const { return left_ == 0 || (is_timed_ && steady_clock::now() >= until_); }
  void spend_one() {
    --left_;
    ++printed_;
  }
  [[nodiscard]] std::uint64_t printed() const { return printed_; }

  /// At most 0.1 s, so that the end of the time is seen.
  [[nodiscard]] static std::chrono::milliseconds wait() { return std::chrono::milliseconds{100}; }

 private:
  std::uint64_t left_;
  std::uint64_t printed_ = 0;
  bool is_timed_;
  steady_clock::time_point until_;
};

void print_event(std::string_view event, std::string_view instrument_id, bool as_json) {
  if (as_json) {
    std::cout << nlohmann::json{{"event", event}, {"instrument_id", printable_text(instrument_id)}}
              << std::endl;
  } else {
    std::cout << printable_text(instrument_id) << " NO SHAPE: " << event << std::endl;
  }
}

/// A rival takes nothing away from what is shown.
void print_rival(const TubeNews& news, bool as_json) {
  if (as_json) {
    std::cout << nlohmann::json{{"event", name_of(news.event)},
                                {"instrument_id", printable_text(news.instrument_id)},
                                {"rival", news.rival}}
              << std::endl;
  } else if (news.event == TubeEvent::kRivalSeen) {
    std::cout << printable_text(news.instrument_id)
              << " RIVAL: somebody else publishes it too: " << news.rival << std::endl;
  } else {
    std::cout << printable_text(news.instrument_id) << " nobody else publishes it any more" << std::endl;
  }
}

/// Flushed line by line: somebody watches, or a pipe reads.
void print_estimate(const TubeSample& sample, bool as_json) {
  if (as_json) {
    nlohmann::json line = to_json(sample.estimate);
    line["received_monotonic_ns"] = sample.received_monotonic_ns;
    line["lost_before"] = sample.lost_before;
    std::cout << line << std::endl;
  } else {
    std::cout << line_of(sample.estimate, sample.received_monotonic_ns) << std::endl;
  }
}

std::uint64_t echo_estimates(const EchoArguments& arguments) {
  TubeSubscriber subscriber(arguments.subscription, Delivery::kEvery);
  SilenceTeller silence(arguments.subscription, "echo");
  Budget budget(arguments);
  while (!budget.is_spent()) {
    const TubeNews news = subscriber.wait_for(Budget::wait());
    if (news.event == TubeEvent::kTimeout) {
      silence.tell_when_due();
      continue;
    }
    silence.heard();
    if (news.sample != nullptr) {
      print_estimate(*news.sample, arguments.as_json);
      budget.spend_one();
    } else if (news.event == TubeEvent::kRivalSeen || news.event == TubeEvent::kRivalGone) {
      print_rival(news, arguments.as_json);
    } else {
      print_event(name_of(news.event), news.instrument_id, arguments.as_json);
    }
  }
  return budget.printed();
}

/// The same from shared memory: one struct under two names (daemon/publishing/shm_publisher.cpp compares
/// them).
std::uint64_t echo_shm(const EchoArguments& arguments) {
  ShmTubeReader reader({.socket = arguments.shm_socket,
                        .instrument_id = arguments.subscription.instrument_id,
                        .delivery = ShmDelivery::kEvery,
                        .trusted = {}});
  SilenceTeller silence(arguments.shm_socket, "echo");
  Budget budget(arguments);
  auto sample = std::make_unique<TubeSample>();
  while (!budget.is_spent()) {
    const ShmTubeNews news = reader.wait_for(Budget::wait());
    silence.tell_when_due();
    if (news.estimate != nullptr) {
      silence.heard();
      static_assert(sizeof(sample->estimate) == sizeof(*news.estimate));
      std::memcpy(&sample->estimate, news.estimate, sizeof(sample->estimate));
      sample->received_monotonic_ns = news.received_monotonic_ns;
      sample->lost_before = news.lost_before;
      print_estimate(*sample, arguments.as_json);
      budget.spend_one();
    } else if (news.event != ShmTubeEvent::kTimeout) {
      print_event(name_of(news.event), sample->estimate.instrument_id, arguments.as_json);
    }
  }
  if (budget.printed() == 0) {
    std::cerr << "tubectl: " << reader.why() << '\n';
  }
  return budget.printed();
}

template <typename Sample>
std::uint64_t echo_topic(const EchoArguments& arguments) {
  const auto reader = std::make_unique<TopicReader<Sample>>(arguments.subscription);
  SilenceTeller silence(arguments.subscription, "echo --topic " + arguments.topic);
  Budget budget(arguments);
  while (!budget.is_spent()) {
    silence.tell_when_due();
    if (const Sample* sample = reader->wait_for(Budget::wait())) {
      silence.heard();
      std::cout << (arguments.as_json ? to_json(*sample).dump() : line_of(*sample)) << std::endl;
      budget.spend_one();
    }
  }
  return budget.printed();
}

std::uint64_t echo(const EchoArguments& arguments) {
  if (!arguments.shm_socket.empty()) return echo_shm(arguments);
  if (arguments.topic == "em") return echo_topic<tubed_EmSamples>(arguments);
  if (arguments.topic == "status") return echo_topic<tubed_TubeStatus>(arguments);
  if (arguments.topic == "identity") return echo_topic<tubed_TubeIdentity>(arguments);
  if (arguments.topic == "health") return echo_topic<tubed_TubeHealth>(arguments);
  return echo_estimates(arguments);
}

int run_echo(const EchoArguments& arguments) {
  try {
    return echo(arguments) > 0 ? kExitOk : kExitUnavailable;
  } catch (const DdsError& error) {
    std::cerr << "tubectl: " << error.what() << '\n';
    return kExitUnavailable;
  }
}

}  // namespace

CommandLine add_echo(CommandLine app, int& exit_code) {
  auto arguments = std::make_shared<EchoArguments>();
  CommandLine verb = app.add_subcommand("echo", "Print what a daemon publishes, one line a sample");
  const Argument topic =
      verb.add_option("--topic", arguments->topic, "estimate, em, status, identity or health")
          .is_member({"estimate", "em", "status", "identity", "health"})
          .capture_default_str();
  verb.add_option("--count", arguments->count, "Stop after this many samples").default_str("never");
  verb.add_option("--seconds", arguments->duration_s, "Stop after this time").positive().default_str("never");
  verb.add_flag("--json", arguments->as_json, "One JSON object a line, with every field");
  verb.add_option("--shm", arguments->shm_socket,
                  "Read estimates from shared memory instead of DDS: the daemon's [shm] estimates_socket")
      .default_str("DDS")
      .excludes(topic);
  add_dds_options(verb, arguments->subscription);
  verb.callback([arguments, &exit_code] { exit_code = run_echo(*arguments); });
  return verb;
}

}  // namespace tubed
