// The pose of a view that was found: when it is used, and how it gets better meanwhile.
#include <algorithm>
#include <chrono>
#include <cmath>

#include "daemon/estimator/view_relocaliser.hpp"

namespace tubed {

namespace {

constexpr std::chrono::milliseconds kMaxBad{1000};
constexpr float kMinInView = 0.1F;  // of the tube
constexpr double kRadians = M_PI / 180;
constexpr double kUse_mm = 1.5;  // standard deviation across the view
constexpr double kUseTurn_rad = 4 * kRadians;
}  // namespace

// 1: the tube is where no image has shown it yet.
double ViewRelocaliser::news_for(const Hypothesis& hypothesis) const {
  if (!hypothesis.has_used) return 1;
  return std::min(1.0, (points_mm_ - hypothesis.points_used_mm).colwise().norm().mean() / kOtherPlace_mm);
}

// Against all places that it was refined at: what comes back there is nothing new.
double ViewRelocaliser::news_for_refinement() const {
  double news = news_for(hypotheses_[likeliest_]);
  for (std::size_t k = 0; k < std::min(refined_, kPlaces); ++k) {
    news = std::min(news, (points_mm_ - refined_at_mm_[k]).colwise().norm().mean() / kOtherPlace_mm);
  }
  return news;
}

// Where the tube is the estimate knows better than coils of one instant.
void ViewRelocaliser::refine(const MovedImage& moved, const TubeEstimate& estimate,
                             const TubeEstimate& by_coils) {
  if (state_ != State::kFound || !moved.has_settled || !take_shape(estimate)) return;
  const double news = news_for_refinement();
  if (news < kWorthwhileNews) return;
  Eigen::Matrix3Xd& here_mm = refined_at_mm_[refined_ % kPlaces];
  here_mm = points_mm_;
  if (!take_shape(by_coils)) return;
  ++refined_;
  correct(moved, news, hypotheses_[likeliest_]);
  hypotheses_[likeliest_].points_used_mm = here_mm;
  pose_ = hypotheses_[likeliest_].pose;
  note_sigma();
}

ViewPose ViewRelocaliser::pose() const {
  ViewPose registered = pose_;
  registered.add_sigma(errors_.turn_rad, errors_.shift_mm);
  return registered;
}

bool ViewRelocaliser::holds(const MovedImage& moved) {
  if (state_ != State::kFound) return false;
  if (moved.moves == moves_ && moved.has_settled) return true;
  if (moved.moves != moves_) begin(moved);
  return false;
}

// The tube is no longer where the pose has it: it was wrong, or the view moved slowly. That coils are
// missing, or the tube is not in the picture, says nothing of the pose.
void ViewRelocaliser::judge_use(const ImageMeasurement& image, const TubeEstimate& estimate) {
  const MonotonicTime now = image.exposure;
  const bool was_away = now - last_use_ > kMaxBad;
  last_use_ = now;
  const bool says_something = !estimate.reasons.has(Reason::kEmStale) && estimate.in_view_ratio > kMinInView;
  const bool is_good = uses(estimate, camera_, now) && !estimate.reasons.has(Reason::kImageLostTube);
  if (is_good || was_away || !says_something) {
    bad_since_ = now;
  } else if (now - bad_since_ > kMaxBad) {
    state_ = State::kLost;
    before_ = pose_;
    is_told_ = false;
    astray_ = 0;
    suppose();
  }
}

// A turn that nobody saw is open by far more than the lines of one place tell.
bool ViewRelocaliser::is_known_well() const {
  const std::array<double, 3>& turn_rad = pose_.geometry().sigma.rotation_rad;
  return sigma_across_mm_ < kUse_mm && (!was_unseen_ || std::max(turn_rad[0], turn_rad[1]) < kUseTurn_rad);
}

}  // namespace tubed
