// After the line was interrupted: is the tracker as it was left, tracking the same coils at the same handles?
#pragma once

#include <array>
#include <bitset>
#include <span>

#include "drivers/aurora/command.hpp"
#include "drivers/aurora/port_setup.hpp"
#include "drivers/aurora/reply.hpp"

namespace tubed::aurora {

/// Asks every handle that was tracked for its tool and its plug. When all are the same, tracking goes on
/// where it was, without TSTOP, INIT and TSTART, which take two seconds. An answer says itself which plug it
/// is about, so that a late one to an earlier question counts for its own coil. Whether the tracker still
/// tracks, and counts on from where it was, the next BX says. One thread; no allocation.
class Resumption {
 public:
  enum class Answer {
    kGoOn,   ///< send command()
    kAgain,  ///< this was no answer to it: the same once more
    kSame,   ///< everything is as it was
    kOther   ///< something is not: begin anew
  };

  /// Tracking has begun with these coils.
  void remember(std::span<const FoundCoil> tracked) noexcept;
  /// The tracker was told something else, or has started anew.
  void forget() noexcept { count_ = 0; }
  [[nodiscard]] bool possible() const noexcept { return count_ > 0; }

  /// From the first handle on.
  void begin() noexcept {
    same_.reset();
    about_others_ = 0;
  }
  [[nodiscard]] CommandLine command() const noexcept;
  /// The reply to command().
  Answer take(const Reply& reply) noexcept;

 private:
  static bool is_no_answer(const Reply& reply) noexcept;
  [[nodiscard]] std::size_t asked() const noexcept;

  std::array<FoundCoil, kMaxTrackerCoils> coils_{};
  std::size_t count_ = 0;
  std::bitset<kMaxTrackerCoils> same_;  ///< known to be as it was
  int about_others_ = 0;                ///< answers in a row about another coil than was asked for
};

}  // namespace tubed::aurora
