// The conversation of a bring-up: everything an Aurora can be asked in about a minute, the unknowns on
// purpose. What it answers is recorded, not judged (aurora_assumptions.hpp).
#pragma once

#include <chrono>
#include <functional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "clients/tubectl/check/aurora_talk.hpp"

namespace tubed {

struct BringupSettings {
  std::chrono::nanoseconds measuring = std::chrono::seconds(20);  ///< BX and TX as fast as they are answered
  bool interactive = false;  ///< also asks a person to pull plugs and put them in
  std::chrono::nanoseconds timeout_of_person = std::chrono::seconds(60);  ///< for each request
};

/// What a bring-up needs of its caller. All are called by the thread that calls run().
struct BringupHooks {
  std::function<void(std::string_view line)> progress;
  std::function<bool()> interrupted;
  std::function<bool()> skipped;  ///< the person does not want to do what was asked last
};

/// One thread. Talks to a tracker at `channel`, which has to outlive it, and leaves it stopped at 9600 baud.
class AuroraBringup {
 public:
  AuroraBringup(aurora::ByteChannel& channel, BringupSettings settings, BringupHooks hooks);

  /// Never throws because of what the tracker does. Puts the link back also when interrupted.
  BringupEnd run();
  [[nodiscard]] const aurora::WireTrace& trace() const { return talk_.trace(); }

 private:
  using Handles = std::vector<std::uint8_t>;

  void run_steps();
  void step(std::string_view what);
  void find_tracker();
  void break_on_purpose();
  void ask_versions();
  void try_rates();
  void set_up_ports();
  void free_stale_handles();
  void initialise_ports();
  void describe_handles(const Handles& handles);
  void measure_with_a_handle_disabled();
  void measure();
  void commands_while_tracking();
  void commands_during_replies();
  void pause_tracking();
  void count_anew();
  void ask_person();
  void start_again_after_plugging();
  bool wait_for_plug(std::string_view request, bool (aurora::SystemStatus::*happened)() const noexcept);
  void init_while_tracking();
  void put_back();

  Handles list(aurora::HandleQuery query);
  void enable(const Handles& handles);
  bool start_tracking(std::string_view options = "");
  void stop_tracking();
  void poll(const aurora::CommandLine& command, std::chrono::nanoseconds duration);

  BringupSettings settings_;
  BringupHooks hooks_;
  AuroraTalk talk_;
  Handles handles_;                ///< initialised ones
  std::set<std::uint8_t> failed_;  ///< PINIT was answered by an error
  bool found_ = false;
  bool tracking_ = false;
};

}  // namespace tubed
