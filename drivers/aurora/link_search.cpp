#include "drivers/aurora/link_search.hpp"

namespace tubed::aurora {

namespace {

using std::chrono::milliseconds;

constexpr milliseconds kFirstTry{350};
constexpr milliseconds kTry{200};
/// RESET came 1.3 s after a break (recorded); clients have seen 5 s.
constexpr milliseconds kAfterBreak{2500};
constexpr std::size_t kFirstSteps = 3;

}  // namespace

SearchStep LinkSearch::step() const noexcept {
  if (at_ < waits_) {
    return {at_ % 2 == 0 ? BaudRate::k9600 : likely_, false, kTry};
  }
  switch (at_ - waits_) {
    case 0:
      return {BaudRate::k9600, false, kFirstTry};
    case 1:
      return {likely_, false, kTry};
    case 2:
      return {BaudRate::k9600, true, kAfterBreak};
    default:
      break;
  }
  // A tracker that is switched on meanwhile speaks at 9600 baud.
  const std::size_t place = at_ - waits_ - kFirstSteps;
  return {patient_ && place % 2 == 0 ? BaudRate::k9600 : kRates[patient_ ? place / 2 : place], false, kTry};
}

bool LinkSearch::advance() noexcept {
  ++at_;
  if (at_ < waits_ + kFirstSteps + (patient_ ? 2 : 1) * kRates.size()) {
    return true;
  }
  at_ = 0;
  patient_ = true;
  return false;
}

}  // namespace tubed::aurora
