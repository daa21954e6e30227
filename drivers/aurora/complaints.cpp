#include "drivers/aurora/complaints.hpp"

#include <utility>

namespace tubed::aurora {

void Complaints::say(Exchange& exchange, const Problem& problem) noexcept {
  last_ = lasting_ = problem;
  waiting_ = true;
  exchange.trace().note(exchange.now(), problem.text());
}

bool Complaints::take() noexcept { return std::exchange(waiting_, false); }

}  // namespace tubed::aurora
