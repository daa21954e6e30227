// From the first answer of a tracker to its first measurement.
#pragma once

#include <span>

#include "drivers/aurora/complaints.hpp"
#include "drivers/aurora/exchange.hpp"
#include "drivers/aurora/identity_questions.hpp"
#include "drivers/aurora/port_setup.hpp"
#include "drivers/aurora/rate_choice.hpp"

namespace tubed::aurora {

/// TSTOP if it tracks, then INIT, COMM, the ports, who it is (once), TSTART, and what every reply on the way
/// leads to. One thread; no allocation.
class TrackerSetup {
 public:
  enum class Step { kHalt, kInitialise, kSetRate, kPorts, kIdentify, kStart };
  enum class Result {
    kGoOn,     ///< send() again when nothing is pending and exchange.rests_until() has come
    kStarted,  ///< TSTART was carried out
    kSilent    ///< it is to be searched for
  };

  /// `wanted`: the rate to track at. `tools` (and their bytes) have to outlive the setup.
  TrackerSetup(BaudRate wanted, const CoilMap& coils, std::span<const ToolDefinition> tools)
      : rates_(wanted), ports_(coils, tools) {}

  /// Another host's port: every rate may be tried again.
  void new_channel() noexcept;
  /// The tracker has started anew and has forgotten everything: begins with INIT.
  void begin() noexcept;
  /// It is to leave its mode first; then goes on with `step`.
  void begin_with_halt(Exchange& exchange, Step step) noexcept;
  /// INIT was carried out, by whomever.
  void begin_initialised(Exchange& exchange) noexcept;

  void send(Exchange& exchange) noexcept;
  /// The reply; nullptr: there was none.
  Result take(const Reply* reply, Exchange& exchange, Complaints& complaints) noexcept;

  [[nodiscard]] Step step() const noexcept { return step_; }
  [[nodiscard]] BaudRate wanted_rate() const noexcept { return rates_.wanted(); }
  [[nodiscard]] const PortSetup& ports() const noexcept { return ports_; }
  [[nodiscard]] const IdentityQuestions& questions() const noexcept { return questions_; }
  /// Times that the ports were initialised.
  [[nodiscard]] std::uint64_t port_setups() const noexcept { return port_setups_; }

 private:
  Result take_halt(const Reply* reply, Exchange& exchange) noexcept;
  Result take_initialise(const Reply* reply, Exchange& exchange, Complaints& complaints) noexcept;
  Result take_rate(const Reply* reply, Exchange& exchange) noexcept;
  Result take_ports(const Reply* reply, Exchange& exchange, Complaints& complaints) noexcept;
  Result take_start(const Reply* reply, Exchange& exchange, Complaints& complaints) noexcept;
  void ports_done(Exchange& exchange, Complaints& complaints) noexcept;
  void out_of_order(Step step, Exchange& exchange, Complaints& complaints) noexcept;
  void choose_rate(Exchange& exchange) noexcept;
  void enter(Step step) noexcept;
  bool retry(Exchange& exchange) noexcept;

  RateChoice rates_;
  PortSetup ports_;
  IdentityQuestions questions_;
  Step step_ = Step::kInitialise;
  Step after_halt_ = Step::kInitialise;
  int attempts_ = 0;
  int detours_ = 0;              ///< from the ports back to TSTOP or INIT, in a row
  bool verifying_rate_ = false;  ///< COMM was answered; nothing has been heard at the new rate
  std::uint64_t port_setups_ = 0;
  Problem last_missing_;
};

}  // namespace tubed::aurora
