// The pose of a view that moved: made better while its images are used, and looked for far away.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <optional>

#include "daemon/estimator/view_relocaliser.hpp"

namespace tubed {

namespace {

constexpr std::chrono::milliseconds kMaxBad{1000};
constexpr float kMinInView = 0.1F;  // of the tube
constexpr double kRadians = M_PI / 180;
constexpr double kUse_mm = 1.5;  // standard deviation across the view
constexpr double kUseTurn_rad = 4 * kRadians;
constexpr double kUnseen_s = 0.5;  // without images: a C-arm turns by 5 degrees
constexpr int kStartsAnImage = 3;
constexpr double kStep_rad = 10 * kRadians;
constexpr double kUnlikely = 20;  // log odds of a hypothesis that has the tube nowhere
// What is open of a view that moved while nobody looked: standard deviations.
constexpr double kOpenTurn_rad = 30 * kRadians;
constexpr double kOpenTilt_rad = 20 * kRadians;
constexpr double kOtherTurn_rad = 3 * kRadians;
constexpr double kRoll_rad = 1 * kRadians;
constexpr double kShift_mm = 8;  // the isocentre is not quite where it is taken to be

/// Steps to either side that are tried of each hypothesis: panned, turned, tilted.
constexpr std::array<int, 3> kSteps = {0, 6, 4};

/// The hypothesis and the step that a start of the search stands for; nothing behind the last.
struct Start {
  std::size_t move;
  int step;
};
std::optional<Start> start_at(std::size_t index) {
  for (std::size_t move = 0; move < kSteps.size(); ++move) {
    const auto count = static_cast<std::size_t>(2 * kSteps[move] + 1);
    if (index < count) return Start{move, static_cast<int>(index) - kSteps[move]};
    index -= count;
  }
  return std::nullopt;
}

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

void ViewRelocaliser::reset() {
  forget();
  seen_ = resumed_ = shape_of_ = MonotonicTime{};
}

void ViewRelocaliser::note_image(MonotonicTime exposure) {
  if (seconds_between(seen_, exposure) > kUnseen_s) {
    resumed_ = exposure;
    was_unseen_ = was_unseen_ || (state_ == State::kLost && !has_settled_);
  }
  seen_ = exposure;
}

// A turn that nobody saw is open by far more than the lines of one place tell.
bool ViewRelocaliser::is_known_well() const {
  const std::array<double, 3>& turn_rad = pose_.geometry().sigma.rotation_rad;
  return sigma_across_mm_ < kUse_mm && (!was_unseen_ || std::max(turn_rad[0], turn_rad[1]) < kUseTurn_rad);
}

ViewPose::Error ViewRelocaliser::sigma_unseen(std::size_t move) {
  ViewPose::Error sigma;
  sigma << kOtherTurn_rad, kOtherTurn_rad, kRoll_rad, kShift_mm, kShift_mm, kShift_mm;
  if (move == kTurn) sigma[1] = kOpenTurn_rad;
  if (move == kTilt) sigma[0] = kOpenTilt_rad;
  return sigma;
}

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
  next_start_ = 0;
  searched_ = {};
}

// From each start what is known is the same: the pose before it moved, give or take a turn.
void ViewRelocaliser::look_further(const MovedImage& moved) {
  if (state_ != State::kLost || !is_searching() || shape_of_ != moved.image->exposure) return;
  for (int i = 0; i < kStartsAnImage; ++i, ++next_start_) {
    const auto start = start_at(next_start_);
    if (!start) {
      suppose_found();
      return;
    }
    ViewPose::Error turned = ViewPose::Error::Zero();
    turned[start->move == kTilt ? 0 : 1] = start->step * kStep_rad;
    ViewPose from = before_.with_error(turned);
    ViewPose::Covariance P = before_.covariance();
    P.diagonal() += sigma_unseen(start->move).cwiseAbs2();
    from.set_covariance(P);
    const Match found = match(moved, from, 1, -turned);
    Match& best = searched_[start->move];
    if (found.is_found && (!best.is_found || found.log_evidence > best.log_evidence)) best = found;
  }
}

// A hypothesis that has the tube nowhere stays as it is, unlikely.
void ViewRelocaliser::suppose_found() {
  astray_ = 0;
  if (std::ranges::none_of(searched_, &Match::is_found)) return;
  was_unseen_ = true;
  double least = 0;
  for (const Match& found : searched_) least = std::min(least, found.log_evidence);
  for (std::size_t move = 0; move < kMoves; ++move) {
    Hypothesis& hypothesis = hypotheses_[move];
    const Match& found = searched_[move];
    hypothesis.good = 0;
    hypothesis.log_evidence = found.is_found ? found.log_evidence : least - kUnlikely;
    if (!found.is_found) continue;
    hypothesis.pose = found.pose;
    hypothesis.points_used_mm = points_mm_;
    hypothesis.has_used = true;
  }
}

}  // namespace tubed
