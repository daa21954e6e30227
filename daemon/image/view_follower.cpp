#include "daemon/image/view_follower.hpp"

namespace tubed {

namespace {

// What an image shows as one did that long ago stands still, or has come back: a slow pan does neither.
constexpr std::chrono::milliseconds kSettled{1000};

}  // namespace

const ViewVerdict& ViewFollower::observe(const ImageFrame& frame) {
  const ViewVerdict& given = given_.observe(frame);
  const ViewVerdict before = verdict_;
  verdict_ = given;
  verdict_.moves = before.moves;
  const bool is_elsewhere = given.state == ViewState::kSuspect || given.state == ViewState::kMoved;
  if (is_elsewhere && !is_elsewhere_) {
    here_.begin(frame.exposure);
    ++verdict_.moves;
  } else if (is_elsewhere) {
    verdict_.has_settled = before.has_settled;
    if (before.has_settled) verdict_.motion = before.motion;
  }
  is_elsewhere_ = is_elsewhere;
  if (is_elsewhere) follow(frame);
  return verdict_;
}

void ViewFollower::follow(const ImageFrame& frame) {
  const ViewState here = here_.observe(frame).state;
  // A view that is still under way uses up all keys.
  if (!verdict_.has_settled && here_.key_count() == ViewWatch::kMaxKeys) here_.begin(frame.exposure);
  if (here == ViewState::kMoved) {
    here_.begin(frame.exposure);
    ++verdict_.moves;
    verdict_.has_settled = false;
  } else if (here != ViewState::kSuspect && !verdict_.has_settled && here_.is_known_for(kSettled)) {
    verdict_.has_settled = true;
    verdict_.motion = given_.motion_to_newest();
  }
}

}  // namespace tubed
