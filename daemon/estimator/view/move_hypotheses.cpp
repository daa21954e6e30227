#include "daemon/estimator/view/move_hypotheses.hpp"

#include <algorithm>
#include <cmath>

#include "idl/geometry/rigid_transform.hpp"
#include "idl/geometry/squared.hpp"

namespace tubed {

namespace {

using enum TurnSearch::Move;

constexpr double kRadians = M_PI / 180;
// How fast things go while a view moves.
constexpr double kTurn_rad_s = 10 * kRadians;
constexpr double kOtherTurn_rad_s = 2 * kRadians;  // about the other axis
constexpr double kPan_mm_s = 20;
constexpr double kLift_mm_s = 5;
constexpr double kIsocentre_mm = 15;  // how far it may be from where it is taken to be
// What is open of a pose when a move is noticed: of what moves, and of what does not.
constexpr double kFirstTurn_rad = 2 * kRadians;
constexpr double kFirstShift_mm = 4;
constexpr double kHeldTurn_rad = 0.5 * kRadians;
constexpr double kHeldShift_mm = 2;
// What a background says of a pan: see BackgroundMotion.
constexpr double kPanShare = 0.1;
constexpr double kPanSigma_mm = 2;
constexpr double kPanAgreeing = 0.6;
constexpr double kMagnification = 0.01;  // standard deviation of what the background says of it
constexpr double kMinZoom = 0.03;
constexpr double kBackgroundTells = 10;  // log odds
// What an image says.
constexpr double kOtherPlace_mm = 20;  // by which the tube goes until its shape's error is another one
constexpr double kMinNews = 0.02;      // as which an image counts that shows the tube where it was
constexpr double kNotFound = -12;      // log evidence of an image in which the tube is not found
constexpr double kUnlikely = 20;       // log odds of a hypothesis that has the tube nowhere
// When a pose is known.
constexpr double kCertain = 3;         // log odds
constexpr double kSamePlace_mm = 1.5;  // root mean square

}  // namespace

MoveHypotheses::MoveHypotheses(Eigen::Index line_count) {
  for (Hypothesis& hypothesis : hypotheses_) hypothesis.points_used_mm.resize(3, line_count);
}

// A table pans and does not turn; a C-arm turns about its isocentre, about one axis at a time or nearly so,
// and not about its axis of view.
void MoveHypotheses::suppose(const ViewPose& pose) {
  for (std::size_t move = 0; move < hypotheses_.size(); ++move) {
    Hypothesis& hypothesis = hypotheses_[move];
    ViewPose::Error sigma;
    sigma << kHeldTurn_rad, kHeldTurn_rad, kHeldTurn_rad, kHeldShift_mm, kHeldShift_mm, kHeldShift_mm;
    hypothesis.growth.setZero();
    if (move == kPan) {
      sigma.tail<3>().setConstant(kFirstShift_mm);
      hypothesis.growth.tail<3>() << kPan_mm_s, kPan_mm_s, kLift_mm_s;
    } else {
      const Eigen::Index axis = move == kTurn ? 1 : 0;
      sigma[axis] = kFirstTurn_rad;
      hypothesis.growth.head<2>().setConstant(kOtherTurn_rad_s);
      hypothesis.growth[axis] = kTurn_rad_s;
      hypothesis.growth.tail<3>().setConstant(kTurn_rad_s * kIsocentre_mm);
    }
    hypothesis.pose = pose;
    ViewPose::Covariance P = pose.covariance();
    P.diagonal() += sigma.cwiseAbs2();
    hypothesis.pose.set_covariance(P);
    hypothesis.log_evidence = 0;
    hypothesis.good = 0;
    hypothesis.has_used = false;
  }
}

void MoveHypotheses::suppose_found(const TurnSearch& search, const Eigen::Matrix3Xd& points_mm) {
  double least = 0;
  for (std::size_t move = 0; move < hypotheses_.size(); ++move) {
    least = std::min(least, search.best(move).log_evidence);
  }
  for (std::size_t move = 0; move < hypotheses_.size(); ++move) {
    Hypothesis& hypothesis = hypotheses_[move];
    const PoseMatch& found = search.best(move);
    hypothesis.good = 0;
    hypothesis.log_evidence = found.is_found ? found.log_evidence : least - kUnlikely;
    if (!found.is_found) continue;
    hypothesis.pose = found.pose;
    hypothesis.points_used_mm = points_mm;
    hypothesis.has_used = true;
  }
}

bool MoveHypotheses::tells(const BackgroundMotion& motion) {
  const bool is_pan = motion.kind == BackgroundMotion::Kind::kPanned;
  const bool is_zoom = motion.kind == BackgroundMotion::Kind::kMagnified;
  return motion.agreeing_share >= kPanAgreeing && (is_pan || is_zoom);
}

// Of a pan or another magnification the background tells nearly all.
void MoveHypotheses::suppose_told(const BackgroundMotion& motion, ViewGeometry geometry,
                                  double pivot_depth_mm) {
  // Half a breath looks like a little of it; fields of view change by more.
  const bool is_zoom = std::abs(motion.magnification - 1) > kMinZoom;
  geometry.fx *= is_zoom ? motion.magnification : 1;
  geometry.fy *= is_zoom ? motion.magnification : 1;
  ViewPose::Error shift = ViewPose::Error::Zero();
  shift.segment<2>(3) = motion.shift_mm;
  Hypothesis& pan = hypotheses_[kPan];
  pan.pose = ViewPose(geometry, pivot_depth_mm).with_error(shift);
  pan.pose.add_sigma(kHeldTurn_rad, kPanShare * motion.shift_mm.norm() + kPanSigma_mm);
  if (motion.kind != BackgroundMotion::Kind::kPanned) {
    ViewPose::Covariance P = pan.pose.covariance();
    P(5, 5) += squared(kMagnification * pivot_depth_mm);  // seen as another magnification
    pan.pose.set_covariance(P);
  }
  pan.good = 0;
  pan.has_used = false;
  // Nearly all blocks went by the same way: no C-arm turned.
  pan.log_evidence =
      std::max({hypotheses_[kTurn].log_evidence, hypotheses_[kTilt].log_evidence}) + kBackgroundTells;
}

// At a steady speed: what is open grows as the time does, not as its root.
void MoveHypotheses::move_on(double dt_s, double moved_s) {
  const double grown_s2 = dt_s * std::max(0.0, 2 * moved_s - dt_s);
  for (Hypothesis& hypothesis : hypotheses_) {
    ViewPose::Covariance P = hypothesis.pose.covariance();
    P.diagonal() += hypothesis.growth.cwiseAbs2() * grown_s2;
    hypothesis.pose.set_covariance(P);
  }
}

void MoveHypotheses::settle() {
  for (Hypothesis& hypothesis : hypotheses_) hypothesis.good = 0;
}

void MoveHypotheses::correct(PoseMatcher& matcher, const MovedImage& moved, bool has_settled) {
  for (Hypothesis& hypothesis : hypotheses_) {
    const double news = news_for(hypothesis, matcher.points_mm());
    correct(matcher, moved, news, !has_settled || news >= kWorthwhileNews, hypothesis);
  }
  const auto better = std::ranges::max_element(hypotheses_, {}, &Hypothesis::log_evidence);
  likeliest_ = static_cast<std::size_t>(better - hypotheses_.begin());
}

void MoveHypotheses::refine(PoseMatcher& matcher, const MovedImage& moved, double news,
                            const Eigen::Matrix3Xd& here_mm) {
  Hypothesis& hypothesis = hypotheses_[likeliest_];
  correct(matcher, moved, news, true, hypothesis);
  hypothesis.points_used_mm = here_mm;
}

void MoveHypotheses::correct(PoseMatcher& matcher, const MovedImage& moved, double news, bool is_worthwhile,
                             Hypothesis& hypothesis) {
  const PoseMatch found = matcher.match(moved, hypothesis.pose, std::max(news, kMinNews));
  if (is_worthwhile) hypothesis.log_evidence += found.is_found ? found.log_evidence : kNotFound;
  if (!found.is_found) {
    hypothesis.good = 0;
    return;
  }
  ++hypothesis.good;
  if (!is_worthwhile) return;
  hypothesis.pose = found.pose;
  hypothesis.points_used_mm = matcher.points_mm();
  hypothesis.has_used = true;
}

double MoveHypotheses::news_between(const Eigen::Matrix3Xd& a_mm, const Eigen::Matrix3Xd& b_mm) {
  return std::min(1.0, (a_mm - b_mm).colwise().norm().mean() / kOtherPlace_mm);
}

// 1: the tube is where no image has shown it yet.
double MoveHypotheses::news_for(const Hypothesis& hypothesis, const Eigen::Matrix3Xd& points_mm) {
  return hypothesis.has_used ? news_between(points_mm, hypothesis.points_used_mm) : 1;
}

double MoveHypotheses::news_of(const Eigen::Matrix3Xd& points_mm) const {
  return news_for(hypotheses_[likeliest_], points_mm);
}

bool MoveHypotheses::have_tube() const { return std::ranges::any_of(hypotheses_, &has_tube); }

bool MoveHypotheses::are_decided(const Eigen::Matrix3Xd& points_mm) const {
  const Hypothesis& better = hypotheses_[likeliest_];
  return std::ranges::all_of(hypotheses_, [&](const Hypothesis& other) {
    if (&other == &better || better.log_evidence - other.log_evidence > kCertain) return true;
    double squares_mm2 = 0;
    for (Eigen::Index i = 0; i < points_mm.cols(); ++i) {
      const Eigen::Vector3d apart_mm = better.pose.geometry().T_camera_world() * points_mm.col(i) -
                                       other.pose.geometry().T_camera_world() * points_mm.col(i);
      squares_mm2 += apart_mm.head<2>().squaredNorm() / static_cast<double>(points_mm.cols());
    }
    return squares_mm2 < squared(kSamePlace_mm);
  });
}

}  // namespace tubed
