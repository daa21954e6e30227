#include "daemon/estimator/view/turn_search.hpp"

#include <algorithm>
#include <cmath>

namespace tubed {

namespace {

constexpr double kRadians = M_PI / 180;
constexpr double kStep_rad = 10 * kRadians;
/// So many to either side: panned, turned, tilted.
constexpr std::array<int, TurnSearch::kMoves> kSteps = {0, 6, 4};
// What is open of a view that moved while nobody looked: standard deviations.
constexpr double kOpenTurn_rad = 30 * kRadians;
constexpr double kOpenTilt_rad = 20 * kRadians;
constexpr double kOtherTurn_rad = 3 * kRadians;
constexpr double kRoll_rad = 1 * kRadians;
constexpr double kShift_mm = 8;  // the isocentre is not quite where it is taken to be

ViewPose::Error sigma_of(std::size_t move) {
  ViewPose::Error sigma;
  sigma << kOtherTurn_rad, kOtherTurn_rad, kRoll_rad, kShift_mm, kShift_mm, kShift_mm;
  if (move == TurnSearch::kTurn) sigma[1] = kOpenTurn_rad;
  if (move == TurnSearch::kTilt) sigma[0] = kOpenTilt_rad;
  return sigma;
}

}  // namespace

void TurnSearch::forget() {
  is_running_ = false;
  astray_ = 0;
  wait_ = kFirstWait;
}

void TurnSearch::note_image(bool is_astray, const ViewPose& before) {
  if (is_running_) return;
  if (!is_astray) {
    forget();
  } else if (++astray_ >= wait_) {
    begin(before);
  }
}

void TurnSearch::begin(const ViewPose& before) {
  is_running_ = true;
  astray_ = 0;
  before_ = before;
  move_ = kPan;
  step_ = -kSteps[kPan];
  best_ = {};
}

void TurnSearch::end() {
  is_running_ = false;
  wait_ = has_found() ? kFirstWait : std::min(2 * wait_, kLastWait);
}

bool TurnSearch::is_over() const { return move_ == kMoves; }

TurnSearch::Start TurnSearch::next() {
  ViewPose::Error turned = ViewPose::Error::Zero();
  turned[move_ == kTilt ? 0 : 1] = step_ * kStep_rad;
  Start start{move_, before_.with_error(turned), -turned};
  ViewPose::Covariance P = before_.covariance();
  P.diagonal() += sigma_of(move_).cwiseAbs2();
  start.pose.set_covariance(P);
  if (++step_ > kSteps[move_]) {
    ++move_;
    step_ = move_ < kMoves ? -kSteps[move_] : 0;
  }
  return start;
}

void TurnSearch::add(std::size_t move, const PoseMatch& found) {
  PoseMatch& best = best_[move];
  if (found.is_found && (!best.is_found || found.log_evidence > best.log_evidence)) best = found;
}

bool TurnSearch::has_found() const { return std::ranges::any_of(best_, &PoseMatch::is_found); }

}  // namespace tubed
