// Which explanation CoilImageAgreement comes to, and what it leaves in doubt.
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "daemon/estimator/coil_image_agreement.hpp"
#include "idl/geometry/image_mask.hpp"
#include "idl/geometry/squared.hpp"

namespace tubed {

namespace {

constexpr double kEndSeen_mm = 0.6;  // nearer than that it is not known where the image has the end: 1 px
constexpr double kEndContradicts_mm = 3.5;  // the shape is seen to end elsewhere, whatever explains it
constexpr double kEndAgrees_mm = 2.5;
constexpr double kHeld_mm = 0.15;  // what an image leaves open across itself
constexpr double kHeldFor_s = 1;
constexpr double kSharedShare = 0.7;    // of what stays of a coil's error, its neighbours' share
constexpr double kBetterTracker = 0.5;  // of what stays, as likely as all of what the settings say
constexpr double kPriorOdds =
    1e-2;  // of each explanation that is not "as stated": a mistake in a hundred procedures
constexpr double kFieldOdds = 1e-3;  // of coils that are off each in its own way, which explains anything
constexpr double kMagnificationOdds =
    1e-3;                         // of a view: found when it is set up, and shown to be wrong for hours
constexpr double kCertain = 0.8;  // of "as stated", to take back that they disagree

// Standard deviations where an explanation holds.
constexpr double kWrongShift_mm = 8;
constexpr double kWrongTurn_rad = 0.06;
constexpr double kWrongArcLength_mm = 10;
constexpr double kBeside_mm = 0.8;  // a coil 8 mm further along a bend of radius 40 mm: 8^2 / (2 40)
constexpr double kWrongClock_s = 0.15;
constexpr double kWrongMagnification = 0.08;
constexpr double kWrongField_mm = 4;
constexpr double kWrongCoil_mm = 20;

// Against "as stated", before anything was seen.
double prior_odds(Discord discord) {
  switch (discord) {
    case Discord::kNone:
      return 1;
    case Discord::kField:
      return kFieldOdds;
    case Discord::kMagnification:
      return kMagnificationOdds;
    default:
      return kPriorOdds;
  }
}

}  // namespace

// D of LinearEvidence.
void CoilImageAgreement::allow(const Explanation& explanation, double lasting_mm) {
  const auto holds = [&explanation](Discord discord) { return explanation.discord == discord; };
  const bool registration = holds(Discord::kRegistration);
  D_.segment<3>(0).setConstant(registration ? kWrongShift_mm : errors_.shift_mm);
  D_.segment<3>(kTurn).setConstant(registration ? kWrongTurn_rad : errors_.turn_rad);
  D_[kArcLength] = holds(Discord::kArcLengths) ? kWrongArcLength_mm : errors_.arc_length_mm;
  D_[kClockColumn] = holds(Discord::kClock) ? kWrongClock_s : errors_.clock_s;
  D_.segment(kViews, view_count_).setConstant(errors_.magnification);
  const double own_mm =
      std::hypot(lasting_mm * std::sqrt(1 - kSharedShare), holds(Discord::kField) ? kWrongField_mm : 0);
  D_.segment(own_column(0), 3 * coil_count()).setConstant(own_mm);
  D_.segment(shared_column(0), 3 * coil_count()).setConstant(lasting_mm * std::sqrt(kSharedShare));
  D_.tail(coil_count()).setConstant(std::hypot(errors_.arc_length_mm, own_mm));
  if (holds(Discord::kMagnification)) {
    D_[kViews + explanation.index] = kWrongMagnification;
  } else if (holds(Discord::kCoil)) {
    D_.segment<3>(own_column(explanation.index)).setConstant(kWrongCoil_mm);
    D_[arc_length_column(explanation.index)] = kWrongCoil_mm;
  } else if (holds(Discord::kCoilArcLength)) {
    D_[arc_length_column(explanation.index)] = kWrongArcLength_mm;
    D_.segment<3>(own_column(explanation.index)).setConstant(std::hypot(own_mm, kBeside_mm));
  }
}

// One explanation of what was seen until the first of them was judged.
void CoilImageAgreement::judge_next() {
  if (next_ == 0) {
    evidence_.freeze();
  }
  Explanation& explanation = explanations_[next_];
  constexpr double kNever = -std::numeric_limits<double>::infinity();
  double likelier = kNever;
  double sum = 0;  // of likelihoods, over that of the likelier
  for (const double share : {1.0, kBetterTracker}) {
    allow(explanation, share * lasting_mm_);
    const double log_evidence = evidence_.explain(D_);
    if (log_evidence > likelier) {
      remember(explanation);
      sum = 1 + sum * std::exp(likelier - log_evidence);
      likelier = log_evidence;
    } else if (likelier != kNever) {
      sum += std::exp(log_evidence - likelier);
    }
  }
  explanation.log_evidence =
      likelier == kNever ? kNever : likelier + std::log(sum / 2) + std::log(prior_odds(explanation.discord));
  if (++next_ == explanations_.size()) {
    next_ = 0;
    conclude();
  }
}

// What the newest explanation of evidence_ makes of it.
void CoilImageAgreement::remember(Explanation& explanation) {
  const Eigen::VectorXd& mean = evidence_.mean();
  explanation.end_mm = end_row_.dot(mean);
  explanation.registration = mean.head<6>();
  const int index = explanation.index;
  const bool of_a_coil =
      explanation.discord == Discord::kCoil || explanation.discord == Discord::kCoilArcLength;
  explanation.arc_length_mm = mean[of_a_coil ? arc_length_column(index) : kArcLength];
  explanation.clock_s = mean[kClockColumn];
  explanation.magnification =
      view_count_ > 0 ? mean[kViews + (explanation.discord == Discord::kMagnification ? index : 0)] : 0;
  explanation.coil_mm = mean.segment<3>(own_column(explanation.discord == Discord::kCoil ? index : 0));
  // Of "as stated" only what it has found out: what may be wrong in every room is in the shape's own sigma.
  explanation.covariance.setZero();
  if (explanation.discord == Discord::kRegistration) {
    evidence_.covariance_of_first(explanation.covariance);
  }
}

// Moments of the mixture of all explanations.
void CoilImageAgreement::conclude() {
  const auto best = std::max_element(
      explanations_.begin(), explanations_.end(),
      [](const Explanation& a, const Explanation& b) { return a.log_evidence < b.log_evidence; });
  if (!std::isfinite(best->log_evidence)) {
    return;
  }
  double sum = 0;
  for (const Explanation& explanation : explanations_) {
    sum += std::exp(explanation.log_evidence - best->log_evidence);
  }
  registration_square_.setZero();
  field_square_mm2_ = 0;
  for (SeenView& view : views_) {
    view.magnification_square = 0;
  }
  verdict_.as_stated = 0;
  for (const Explanation& explanation : explanations_) {
    const double probability = std::exp(explanation.log_evidence - best->log_evidence) / sum;
    registration_square_ += probability * (explanation.covariance +
                                           explanation.registration * explanation.registration.transpose());
    if (explanation.discord == Discord::kNone) {
      verdict_.as_stated = probability;
    } else if (explanation.discord == Discord::kField) {
      field_square_mm2_ = probability * squared(kWrongField_mm);
    } else if (explanation.discord == Discord::kMagnification) {
      views_[static_cast<std::size_t>(explanation.index)].magnification_square =
          probability * squared(explanation.magnification);
    }
  }
  verdict_.explanation = best->discord;
  verdict_.index = best->index;
  verdict_.probability = 1 / sum;
  verdict_.shift_mm = best->registration.head<3>();
  verdict_.turn_rad = best->registration.tail<3>();
  verdict_.coil_mm = best->coil_mm;
  verdict_.arc_length_mm = best->arc_length_mm;
  verdict_.clock_s = best->clock_s;
  verdict_.magnification = best->magnification;
  verdict_.end_mm = best->end_mm;
  disagree_ = verdict_.as_stated < (disagree_ ? kCertain : 0.5);
  const double contradicts_mm = end_contradicts_ ? kEndAgrees_mm : kEndContradicts_mm;
  end_contradicts_ = std::abs(beyond_tip_mm_) > contradicts_mm;
  if (end_contradicts_ && verdict_.explanation == Discord::kNone) {
    verdict_.explanation = Discord::kArcLengths;
    verdict_.end_mm = beyond_tip_mm_;
  }
}

// The registration's error at p is [I, -[p - c]x] (shift, turn). An image holds the point across its rays to
// kHeld_mm: with K the information of that, M becomes (K + M^-1)^-1 = M (I + K M)^-1.
Eigen::Matrix3d CoilImageAgreement::doubt(const Eigen::Vector3d& p_world_mm,
                                          const Eigen::Vector3d& tangent_world, MonotonicTime now) const {
  const Eigen::Vector3d r_mm = p_world_mm - centre_mm_;
  Eigen::Matrix<double, 3, 6> J = Eigen::Matrix<double, 3, 6>::Zero();
  J.leftCols<3>().setIdentity();
  J.rightCols<3>() << 0, r_mm.z(), -r_mm.y(), -r_mm.z(), 0, r_mm.x(), r_mm.y(), -r_mm.x(), 0;
  Eigen::Matrix3d M =
      J * registration_square_ * J.transpose() + field_square_mm2_ * Eigen::Matrix3d::Identity();
  Eigen::Matrix3d K = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d scaled = Eigen::Matrix3d::Zero();
  for (const SeenView& view : views_) {
    if (view.camera == nullptr || std::abs(seconds_between(view.confirmed, now)) > kHeldFor_s) {
      continue;
    }
    const auto projection = view.camera->project(p_world_mm);
    if (!projection || !view.camera->contains(projection->p_image_px) ||
        is_masked(view.camera->calibration(), projection->p_image_px)) {
      continue;
    }
    const RigidTransform& T_camera_world = view.camera->calibration().T_camera_world;
    const Eigen::Vector3d p_camera_mm = T_camera_world * p_world_mm;
    const Eigen::Vector3d ray = T_camera_world.linear().transpose() * p_camera_mm.normalized();
    K += (Eigen::Matrix3d::Identity() - ray * ray.transpose()) / squared(kHeld_mm);
    const Eigen::Vector3d lateral = lateral_mm(*view.camera, p_world_mm);
    scaled += view.magnification_square * lateral * lateral.transpose();
  }
  M = M * (Eigen::Matrix3d::Identity() + K * M).inverse();
  const double along_mm2 = std::max(squared(beyond_tip_mm_) - squared(kEndSeen_mm), 0.0);
  return M + scaled + along_mm2 * tangent_world * tangent_world.transpose();
}

}  // namespace tubed
