#include "daemon/image/view_watch.hpp"

#include <algorithm>
#include <bit>
#include <cstring>
#include <utility>

namespace tubed {

namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr milliseconds kLearning{6000};        // one and a half breaths
constexpr milliseconds kMaxJumpInterval{150};  // beyond, breath alone may look like a jump
constexpr milliseconds kProbation{6000};       // what is part of a breath is back within one
constexpr milliseconds kGoodFor{1000};         // before a view that moved counts as still again
constexpr double kKnown = 0.6;                 // share of still blocks: the same phase of the same view
constexpr double kGood = 0.5;
constexpr double kMoved = 0.35;   // below: no phase of this view
constexpr double kJumped = 0.45;  // against the image before
// The same when that was longer ago: a breath leaves much of a patient where it was, a move next to nothing.
constexpr double kJumpedLater = 0.2;
constexpr int kMovedInARow = 3;
constexpr int kMinBlocks = 40;
constexpr double kMaxAnnounced_mm = 0.5;  // a pose that moves the picture by more is another view
constexpr float kMaxOpenChange = 0.01F;   // share of the picture, from one image to the next

/// Pinhole projection, px; the distortion is the same for both views that are compared.
Eigen::Vector2d project(const ViewGeometry& view, const Eigen::Vector3d& p_world_mm) {
  const Eigen::Vector3d p = view.T_camera_world() * p_world_mm;
  return {view.cx + view.fx * p.x() / p.z(), view.cy + view.fy * p.y() / p.z()};
}

/// Whether a point around `at_world_mm` lies more than `max_px` elsewhere in the one than in the other.
bool sees_elsewhere(const ViewGeometry& one, const ViewGeometry& other, const Eigen::Vector3d& at_world_mm,
                    double max_px) {
  constexpr double kAround_mm = 60;
  for (int axis = -1; axis < 3; ++axis) {
    Eigen::Vector3d p_world_mm = at_world_mm;
    if (axis >= 0) p_world_mm[axis] += kAround_mm;
    if (!((project(one, p_world_mm) - project(other, p_world_mm)).norm() <= max_px)) return true;
  }
  return false;
}

}  // namespace

double mm_per_px_in_patient(const CameraCalibration& camera) {
  constexpr double kMinDepth_mm = 300;
  constexpr double kMaxDepth_mm = 1500;
  const Eigen::Vector3d looked_at = camera.looked_at_world_mm().value_or(Eigen::Vector3d::Zero());
  const double depth_mm = (camera.T_camera_world * looked_at).z();
  return std::clamp(depth_mm, kMinDepth_mm, kMaxDepth_mm) / std::max(camera.fx, 1.0);
}

ViewWatch::ViewWatch(int width, int height, double mm_per_px, double white_level)
    : reducer_(width, height),
      mm_per_reduced_px_(mm_per_px * reducer_.factor()),
      mm_per_px_(mm_per_px),
      is_white_known_(white_level > 0),
      white_level_(is_white_known_ ? static_cast<float>(white_level) : 255),
      picture_(reducer_.picture()),
      last_picture_(picture_),
      blocks_(reducer_.rows(), reducer_.columns()),
      last_blocks_(blocks_),
      motion_finder_(reducer_.rows(), reducer_.columns()),
      last_(reducer_.rows(), reducer_.columns()) {
  keys_.reserve(kMaxKeys);
  spare_.reserve(kMaxKeys);
  for (std::size_t i = 0; i < kMaxKeys; ++i) spare_.emplace_back(reducer_.rows(), reducer_.columns());
  newcomers_.reserve(kMaxNewcomers);
  for (std::size_t i = 0; i < kMaxNewcomers; ++i) {
    newcomers_.push_back({ViewKey(reducer_.rows(), reducer_.columns())});
  }
}

void ViewWatch::begin(MonotonicTime now) {
  while (!keys_.empty()) {
    spare_.push_back(std::move(keys_.back()));
    keys_.pop_back();
  }
  for (Newcomer& newcomer : newcomers_) newcomer.is_used = false;
  best_key_ = 0;
  began_ = now;
  has_begun_ = true;
  has_last_ = is_good_ = has_come_back_ = has_lost_track_ = false;
  bad_in_a_row_ = 0;
  judged_ = ViewState::kUnjudged;
  verdict_ = {};
}

float ViewWatch::white_level_of(const ImageFrame& frame) {
  if (is_white_known_ || frame.depth == PixelDepth::kGrey8) {
    return white_level_;
  }
  std::uint16_t brightest = 0;
  for (std::size_t i = 0;
       i < 2 * static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height); i += 2) {
    std::uint16_t pixel = 0;
    std::memcpy(&pixel, &frame.pixels[i], sizeof pixel);
    brightest = std::max(brightest, pixel);
  }
  white_level_ = std::max(white_level_, static_cast<float>((1U << std::bit_width(brightest)) - 1U));
  return white_level_;
}

void ViewWatch::look_from(const ViewGeometry& geometry, MonotonicTime now) {
  if (!sees_elsewhere(geometry, learnt_from_, looked_at_world_mm_, kMaxAnnounced_mm / mm_per_px_)) return;
  learnt_from_ = geometry;
  begin(now);
}

const ViewVerdict& ViewWatch::observe(const ImageFrame& frame) {
  const MonotonicTime exposure = frame.exposure;
  if (!has_begun_) begin(exposure);
  reducer_.reduce(frame, white_level_of(frame), picture_);
  blocks_.take(picture_);
  const float open_share = picture_.open_share();
  blades_move_ = has_last_ && std::abs(open_share - last_open_share_) > kMaxOpenChange;
  const GalleryMatch gallery = match();
  compare_with_last(gallery, exposure);
  verdict_.still_share = gallery.share;
  verdict_.exposure = exposure;
  verdict_.why = why_unjudged(gallery, exposure);
  const bool can_judge = verdict_.why == UnjudgedView::kNone || verdict_.why == UnjudgedView::kLearning;
  if (can_judge) {
    const bool was_moved = judged_ == ViewState::kMoved;
    judged_ = state_after(gallery, exposure);
    if (judged_ == ViewState::kMoved && !was_moved) {
      verdict_.motion = motion_finder_.find(keys_[best_key_].texture(), picture_.texture, mm_per_reduced_px_);
    }
    learn(gallery.share, exposure);
  }
  // What moved has moved, also behind blades, and what may have moved still may.
  verdict_.state = can_judge || is_doubted() ? judged_ : ViewState::kUnjudged;
  std::swap(last_picture_, picture_);
  std::swap(last_blocks_, blocks_);
  last_exposure_ = exposure;
  last_open_share_ = open_share;
  has_last_ = true;
  return verdict_;
}

double ViewWatch::share_still(ViewKey& key) const {
  const StillBlocks still = key.compare(last_blocks_, mm_per_reduced_px_);
  return 2 * still.compared >= still.of_key ? still.share() : 0;
}

BackgroundMotion ViewWatch::motion_to_newest() {
  return keys_.empty() || !has_last_
             ? BackgroundMotion{}
             : motion_finder_.find(keys_[best_key_].texture(), last_picture_.texture, mm_per_reduced_px_);
}

ViewWatch::GalleryMatch ViewWatch::match() {
  GalleryMatch best;
  for (std::size_t i = 0; i < keys_.size() && best.share < kKnown; ++i) {
    const std::size_t key = (best_key_ + i) % keys_.size();
    const StillBlocks still = keys_[key].compare(blocks_, mm_per_reduced_px_);
    const bool is_comparable = 2 * still.compared >= still.of_key && still.compared > 0;
    best.is_comparable = best.is_comparable || is_comparable;
    if (is_comparable && still.share() > best.share) {
      best.share = still.share();
      best_key_ = key;
    }
  }
  return best;
}

void ViewWatch::compare_with_last(const GalleryMatch& gallery, MonotonicTime exposure) {
  verdict_.jump_share = 1;
  verdict_.follows_last = true;
  // To what a key knows it may jump: a breath of which images were left out.
  if (!has_last_ || gallery.share >= kKnown) return;
  last_.take(last_picture_, last_blocks_);
  const StillBlocks still = last_.compare(blocks_, mm_per_reduced_px_);
  if (2 * still.compared < still.of_key) return;
  const bool is_near = exposure - last_exposure_ <= kMaxJumpInterval;
  if (is_near) verdict_.jump_share = still.share();
  verdict_.follows_last = still.share() >= (is_near ? kJumped : kJumpedLater);
}

bool ViewWatch::is_doubted() const { return judged_ == ViewState::kSuspect || judged_ == ViewState::kMoved; }

bool ViewWatch::is_learning(MonotonicTime exposure) const { return exposure - began_ < kLearning; }

UnjudgedView ViewWatch::why_unjudged(const GalleryMatch& gallery, MonotonicTime exposure) const {
  if (blocks_.open_count() < kMinBlocks) return UnjudgedView::kFewBlocks;
  // Behind moving blades the background stays where it is; a turned C-arm changes what is saturated as well.
  const bool is_known = gallery.share >= kKnown;
  if (blades_move_ && !is_known && verdict_.jump_share >= kJumped) return UnjudgedView::kBladesMove;
  if (!keys_.empty() && !gallery.is_comparable) return UnjudgedView::kFewBlocks;
  if (is_learning(exposure)) return UnjudgedView::kLearning;
  return has_come_back_ ? UnjudgedView::kNone : UnjudgedView::kNoBackground;
}

/// While it learns, a view that fits says nothing yet, one that does not fit any more is as bad as later.
ViewState ViewWatch::state_after(const GalleryMatch& gallery, MonotonicTime exposure) {
  if (keys_.empty()) return ViewState::kUnjudged;
  // The first images of a view differ from each other by breath; that comes by and by.
  const bool is_followed = is_learning(exposure) && verdict_.follows_last && !is_doubted();
  const bool is_bad = gallery.share < kMoved && !is_followed;
  bad_in_a_row_ = is_bad ? bad_in_a_row_ + 1 : 0;
  if (gallery.share <= kGood) {
    is_good_ = false;
  } else if (!is_good_) {
    is_good_ = true;
    good_since_ = exposure;
  }
  if (is_learning(exposure) && !has_come_back_) return ViewState::kUnjudged;
  if (bad_in_a_row_ >= kMovedInARow) return ViewState::kMoved;
  if (judged_ == ViewState::kMoved) {
    return is_good_ && exposure - good_since_ >= kGoodFor ? ViewState::kStill : ViewState::kMoved;
  }
  // A jump to what is known is a breath of which images were left out.
  const bool has_jumped = verdict_.jump_share < kJumped && gallery.share < kKnown;
  if (is_bad || has_jumped) return ViewState::kSuspect;
  if (judged_ == ViewState::kSuspect && gallery.share <= kGood) return ViewState::kSuspect;
  return is_learning(exposure) ? ViewState::kUnjudged : ViewState::kStill;
}

// The noise of an exposure never comes back: a picture that is equal to a key to the last bit was shown again
// (a recording that begins anew), and that it fits says nothing of a background.
bool ViewWatch::is_shown_again() const {
  return !keys_.empty() && (keys_[best_key_].texture() == picture_.texture).all();
}

void ViewWatch::learn(double share, MonotonicTime exposure) {
  has_come_back_ = has_come_back_ || (share > kKnown && !is_shown_again());
  if (share >= kKnown) {
    has_lost_track_ = false;
    admit_or_forget_newcomers(share, exposure);
    return;
  }
  const bool is_whole_new = keys_.empty();
  // What does not follow may have moved; and so may what follows that, as long as no key is met again.
  has_lost_track_ = !is_whole_new && (has_lost_track_ || !verdict_.follows_last);
  const bool may_join = is_whole_new || (is_learning(exposure) && !has_lost_track_ && !is_doubted());
  if (may_join && !spare_.empty()) {
    add_key().take(picture_, blocks_);
  } else {
    admit_or_forget_newcomers(share, exposure);
    if (share >= kMoved) add_newcomer(exposure);
  }
}

ViewKey& ViewWatch::add_key() {
  keys_.push_back(std::move(spare_.back()));
  spare_.pop_back();
  return keys_.back();
}

/// A newcomer is part of the breath when the sequence is back at an older key within one; otherwise it may be
/// the first step of a slow pan, which must not carry the gallery along.
void ViewWatch::admit_or_forget_newcomers(double share, MonotonicTime exposure) {
  for (Newcomer& newcomer : newcomers_) {
    if (!newcomer.is_used) continue;
    const bool is_over = exposure - newcomer.seen > kProbation;
    if (!is_over && share >= kKnown && !spare_.empty()) {
      std::swap(add_key(), newcomer.key);
      newcomer.is_used = false;
    }
    newcomer.is_used = newcomer.is_used && !is_over;
  }
}

void ViewWatch::add_newcomer(MonotonicTime exposure) {
  for (Newcomer& newcomer : newcomers_) {
    if (newcomer.is_used && newcomer.key.compare(blocks_, mm_per_reduced_px_).share() >= kKnown) return;
  }
  const auto place =
      std::find_if(newcomers_.begin(), newcomers_.end(), [](const Newcomer& n) { return !n.is_used; });
  if (place == newcomers_.end()) return;
  place->key.take(picture_, blocks_);
  place->seen = exposure;
  place->is_used = true;
}

}  // namespace tubed
