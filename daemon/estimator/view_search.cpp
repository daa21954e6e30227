// The pose of a view that moved, looked for far from where it stood.
#include <algorithm>

#include "daemon/estimator/view_relocaliser.hpp"

namespace tubed {

namespace {

constexpr int kStartsAnImage = 3;
constexpr double kUnlikely = 20;  // log odds of a hypothesis that has the tube nowhere

}  // namespace

void ViewRelocaliser::note_astray(MonotonicTime exposure) {
  shape_of_ = exposure;
  if (is_searching()) return;
  const bool has_tube =
      std::ranges::any_of(hypotheses_, [](const Hypothesis& h) { return h.good >= kGoodInARow; });
  astray_ = has_settled_ && !is_told_ && !has_tube ? astray_ + 1 : 0;
  if (is_searching()) begin_search();
}

void ViewRelocaliser::begin_search() {
  astray_ = kAstray;
  search_.begin(before_);
}

void ViewRelocaliser::look_further(const MovedImage& moved) {
  if (state_ != State::kLost || !is_searching() || shape_of_ != moved.image->exposure) return;
  for (int i = 0; i < kStartsAnImage && !search_.is_over(); ++i) {
    const TurnSearch::Start start = search_.next();
    search_.add(start.move, match(moved, start.pose, 1, start.expected));
  }
  if (search_.is_over()) suppose_found();
}

// A hypothesis that has the tube nowhere stays as it is, unlikely.
void ViewRelocaliser::suppose_found() {
  astray_ = 0;
  if (!search_.has_found()) return;
  was_unseen_ = true;
  double least = 0;
  for (std::size_t move = 0; move < kMoves; ++move) least = std::min(least, search_.best(move).log_evidence);
  for (std::size_t move = 0; move < kMoves; ++move) {
    Hypothesis& hypothesis = hypotheses_[move];
    const PoseMatch& found = search_.best(move);
    hypothesis.good = 0;
    hypothesis.log_evidence = found.is_found ? found.log_evidence : least - kUnlikely;
    if (!found.is_found) continue;
    hypothesis.pose = found.pose;
    hypothesis.points_used_mm = points_mm_;
    hypothesis.has_used = true;
  }
}

}  // namespace tubed
