#include "daemon/image/view_follower.hpp"

#include <utility>

namespace tubed {

ViewFollower::ViewFollower(ViewWatch given) : given_(std::move(given)) {
  keys_.reserve(kMaxKeys);
  for (std::size_t i = 0; i < kMaxKeys; ++i) keys_.push_back({given_.make_key()});
}

const ViewVerdict& ViewFollower::observe(const ImageFrame& frame) {
  const ViewVerdict& given = given_.observe(frame);
  const ViewVerdict before = verdict_;
  verdict_ = given;
  verdict_.moves = before.moves;
  const bool is_elsewhere = given.state == ViewState::kSuspect || given.state == ViewState::kMoved;
  if (is_elsewhere && !is_elsewhere_) {
    begin_place(frame.exposure);
  } else if (is_elsewhere) {
    verdict_.has_settled = before.has_settled;
    if (before.has_settled) verdict_.motion = before.motion;
  }
  is_elsewhere_ = is_elsewhere;
  if (is_elsewhere) follow(frame.exposure);
  return verdict_;
}

void ViewFollower::begin_place(MonotonicTime now) {
  ++verdict_.moves;
  verdict_.has_settled = false;
  began_ = now;
  used_ = 0;
  bad_in_a_row_ = 0;
}

ViewFollower::Known ViewFollower::compare() {
  Known best;
  for (std::size_t i = 0; i < used_; ++i) {
    const double share = given_.share_still(keys_[i].key);
    if (share > best.share) best = {share, keys_[i].seen};
  }
  return best;
}

// A view that is still under way uses up all keys, and begins anew.
void ViewFollower::learn(MonotonicTime now) {
  if (used_ == kMaxKeys) used_ = 0;
  given_.take_newest(keys_[used_].key);
  keys_[used_++].seen = now;
}

void ViewFollower::follow(MonotonicTime now) {
  const Known known = compare();
  const bool is_learning = now - began_ < kLearning || !verdict_.has_settled;
  const bool is_followed = is_learning && verdict_.follows_last;
  const bool is_bad = verdict_.has_settled && known.share < kMoved && !is_followed;
  bad_in_a_row_ = is_bad ? bad_in_a_row_ + 1 : 0;
  verdict_.is_suspect_here = is_bad;
  if (bad_in_a_row_ >= kMovedInARow) {
    begin_place(now);
    learn(now);
  } else if (known.share >= kKnown) {
    if (!verdict_.has_settled && now - known.seen >= kSettled) {
      verdict_.has_settled = true;
      verdict_.motion = given_.motion_to_newest();
    }
  } else if (!is_bad && is_learning && (used_ < kMaxKeys || !verdict_.has_settled)) {
    learn(now);
  }
}

}  // namespace tubed
