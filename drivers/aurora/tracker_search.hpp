// Finds the tracker at whatever rate it listens, and whether it has gone on tracking meanwhile.
#pragma once

#include "drivers/aurora/exchange.hpp"
#include "drivers/aurora/link_search.hpp"
#include "drivers/aurora/resumption.hpp"

namespace tubed::aurora {

/// LinkSearch says what is tried; at the rate that was tracked at, Resumption asks before INIT would end
/// what still goes on. One thread; no allocation.
class TrackerSearch {
 public:
  enum class Result {
    kGoOn,        ///< send() again when nothing is pending
    kFound,       ///< it has carried out INIT
    kOtherState,  ///< it answers, and is not initialised: TSTOP and INIT first
    kUnchanged,   ///< it tracks the same coils as before
    kNowhere      ///< every rate was tried; kGoOn otherwise
  };

  /// A new channel: the tracker's state is not known, but that it may track as before.
  void begin(BaudRate likely) noexcept;
  /// The tracker has fallen silent at `rate`.
  void begin_after_loss(BaudRate rate) noexcept;

  void send(Exchange& exchange) noexcept;
  /// The reply; nullptr: there was none.
  Result take(const Reply* reply, MonotonicTime now) noexcept;

  /// Tracking has begun with these coils, at this rate.
  void remember(std::span<const FoundCoil> tracked, BaudRate rate) noexcept;
  /// The tracker was told something else, or has started anew.
  void forget() noexcept { resumption_.forget(); }

 private:
  Result not_found(MonotonicTime now) noexcept;

  LinkSearch search_;
  Resumption resumption_;
  BaudRate tracking_rate_ = BaudRate::k9600;
  bool asking_unchanged_ = false;  ///< resumption_'s command was sent
  bool step_begun_ = false;
  MonotonicTime step_ends_{};
};

}  // namespace tubed::aurora
