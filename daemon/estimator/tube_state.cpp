#include "daemon/estimator/tube_state.hpp"

namespace tubed {

void TubeState::forget_doubts() {
  images.without_tube = 0;
  images.with_tube = 0;
  images.tip_is_missed = false;
  images.contradicted = false;
  doubt.clear();
  gate.own_shape();
  freedom.begin();
  drift = {};
  bending.setOnes();
}

void StateHistory::go_back(MonotonicTime time, TubeState& state) {
  const TubeState* best = nullptr;
  for (std::size_t age = past_.size(); age > 0; --age) {
    const TubeState& past = past_[(next_ + past_.size() - age) % past_.size()];
    if (past.begun && past.tube.time <= time && (best == nullptr || past.tube.time >= best->tube.time)) {
      best = &past;  // of two of one time what was made of it last
    }
  }
  if (best == nullptr) {
    return;
  }
  state = *best;
  for (TubeState& past : past_) {
    past.begun = past.begun && past.tube.time <= time;
  }
}

void StateHistory::forget() {
  for (TubeState& past : past_) {
    past.begun = false;
  }
}

}  // namespace tubed
