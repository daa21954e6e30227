#include "drivers/aurora/link_search.hpp"

namespace tubed::aurora {

namespace {

using std::chrono::milliseconds;

constexpr milliseconds kFirstTry{350};
constexpr milliseconds kTry{200};
/// RESET came 1.3 s after a break (recorded); clients have seen 5 s.
constexpr milliseconds kAfterBreak{2500};
constexpr std::size_t kFirstSteps = 3;
constexpr std::size_t kStepsARate = 3;  ///< when waiting: the rate, the likely one, 9600

}  // namespace

SearchStep LinkSearch::step() const noexcept { return waiting_ ? waiting_step() : first_step(); }

SearchStep LinkSearch::first_step() const noexcept {
  switch (at_) {
    case 0:
      return {BaudRate::k9600, false, kFirstTry};
    case 1:
      return {likely_, false, kTry};
    case 2:
      return {BaudRate::k9600, true, kAfterBreak};
    default:
      return {kRates[at_ - kFirstSteps], false, kTry};
  }
}

SearchStep LinkSearch::waiting_step() const noexcept {
  if (at_ < waits_) {
    return {at_ % 2 == 0 ? likely_ : BaudRate::k9600, false, kTry};
  }
  if (at_ == waits_) {
    return {BaudRate::k9600, true, kTry};
  }
  const std::size_t place = at_ - waits_ - 1;
  const std::array<BaudRate, kStepsARate> rates = {kRates[place / kStepsARate], likely_, BaudRate::k9600};
  return {rates[place % kStepsARate], false, kTry};
}

bool LinkSearch::advance() noexcept {
  ++at_;
  const std::size_t steps = waiting_ ? waits_ + 1 + kStepsARate * kRates.size() : kFirstSteps + kRates.size();
  if (at_ < steps) {
    return true;
  }
  waits_ = waiting_ ? kLaterWaits : kFirstWaits;
  waiting_ = true;
  at_ = 0;
  return false;
}

}  // namespace tubed::aurora
