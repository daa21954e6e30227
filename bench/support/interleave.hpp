// Two things timed by turns, A B A B, so that what else the machine does falls on both.
#pragma once

#include <chrono>
#include <vector>

namespace tubed {

/// What one thing cost, one duration a turn, in the order they were taken.
struct TurnTimes {
  std::vector<double> own_ms;
  std::vector<double> peer_ms;
};

/// Length of a comparison.
struct TurnPlan {
  int turns = 60;      ///< measured turns of each side
  int warm_up = 3;     ///< turns of each side before them, not kept
  int calls_own = 1;   ///< calls of the own side in one turn; the turn counts the mean of them
  int calls_peer = 1;  ///< the same for the peer
};

/// Mean duration of `calls` calls, ms.
template <typename Call>
double mean_ms(int calls, Call&& call) {
  const auto start = std::chrono::steady_clock::now();
  for (int i = 0; i < calls; ++i) {
    call();
  }
  const std::chrono::duration<double, std::milli> spent = std::chrono::steady_clock::now() - start;
  return spent.count() / calls;
}

/// Times `own` and `peer` by turns. Both are called in this thread, in this process.
template <typename Own, typename Peer>
TurnTimes take_turns(const TurnPlan& plan, Own&& own, Peer&& peer) {
  TurnTimes times;
  for (int turn = -plan.warm_up; turn < plan.turns; ++turn) {
    const double own_ms = mean_ms(plan.calls_own, own);
    const double peer_ms = mean_ms(plan.calls_peer, peer);
    if (turn >= 0) {
      times.own_ms.push_back(own_ms);
      times.peer_ms.push_back(peer_ms);
    }
  }
  return times;
}

}  // namespace tubed
