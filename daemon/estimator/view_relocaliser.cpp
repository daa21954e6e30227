#include "daemon/estimator/view_relocaliser.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>

#include "daemon/estimator/preshaped_estimator.hpp"
#include "idl/geometry/rigid_transform.hpp"
#include "idl/geometry/squared.hpp"

namespace tubed {

namespace {

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
constexpr double kShare_mm = 40;   // of the tube, within which the shape's error is one
constexpr double kMinNews = 0.02;  // as which an image counts that shows the tube where it was
constexpr double kNotFound = -12;  // log evidence of an image in which the tube is not found
constexpr int kMinLines = 25;
constexpr double kMinAgreeing = 0.6;
constexpr int kIterations = 4;
constexpr double kConverged = 0.1;  // of its standard deviation, what an iteration still changes
constexpr int kMinReach_px = 8;
constexpr int kNextReach_px = 12;  // of the iterations after the first
// When a pose is used.
constexpr double kUnseen_s = 0.5;      // without images: a C-arm turns by 5 degrees
constexpr double kUntilNoticed_s = 2;  // that a view moved, from its first image on
constexpr double kCertain = 3;         // log odds
constexpr double kSamePlace_mm = 1.5;  // root mean square

double depth_of_looked_at_mm(const CameraCalibration& camera) {
  return (camera.T_camera_world * camera.looked_at_world_mm().value_or(Eigen::Vector3d::Zero())).z();
}

Eigen::Matrix3d symmetric(const std::array<float, 6>& upper) {
  const auto& u = upper;
  Eigen::Matrix3d m;
  m << u[0], u[1], u[2], u[1], u[3], u[4], u[2], u[4], u[5];
  return m;
}

RoomDescription room_of(const CameraCalibration& camera) {
  RoomDescription room;
  room.cameras = {camera};
  return room;
}

/// An image with another geometry for as long as this lives.
class LentGeometry {
 public:
  LentGeometry(ImageMeasurement& image, const ViewGeometry& geometry) : image_(image), own_(image.geometry) {
    image_.geometry = geometry;
  }
  ~LentGeometry() { image_.geometry = own_; }
  LentGeometry(const LentGeometry&) = delete;
  LentGeometry& operator=(const LentGeometry&) = delete;

 private:
  ImageMeasurement& image_;
  std::optional<ViewGeometry> own_;
};

}  // namespace

ViewRelocaliser::ViewRelocaliser(const EstimatorSettings& settings, const InstrumentDescription& instrument,
                                 const RoomDescription& room, std::size_t camera)
    : splines_{UniformCubicBSpline(settings.coefficient_count, instrument.length_mm),
               UniformCubicBSpline(
                   PreshapedEstimator::settings_for_hooks(settings, instrument.length_mm).coefficient_count,
                   instrument.length_mm)},
      layout_(instrument.length_mm),
      camera_(camera),
      configured_(geometry_of(room.cameras[camera])),
      errors_(room_errors(room, instrument)),
      pivot_depth_mm_(depth_of_looked_at_mm(room.cameras[camera])),
      views_(settings, instrument, room_of(room.cameras[camera])),
      scratch_(std::make_unique<TubeEstimate>()),
      C_(3, splines_[1].coefficient_count()),
      points_mm_(3, layout_.count),
      covariance_(static_cast<std::size_t>(layout_.count)) {
  for (Hypothesis& hypothesis : hypotheses_) hypothesis.points_used_mm.resize(3, layout_.count);
  for (Eigen::Matrix3Xd& place_mm : refined_at_mm_) place_mm.resize(3, layout_.count);
}

void ViewRelocaliser::forget() {
  if (state_ == State::kGiven) return;
  state_ = State::kGiven;
  views_.forget();
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

void ViewRelocaliser::begin(const MovedImage& moved) {
  const bool is_still_lost = state_ == State::kLost;
  was_unseen_ =
      (is_still_lost && was_unseen_) || seconds_between(resumed_, moved.image->exposure) < kUntilNoticed_s;
  if (state_ == State::kGiven) {
    pose_ = ViewPose(moved.image->geometry.value_or(configured_), pivot_depth_mm_);
  }
  if (!is_still_lost) before_ = pose_;
  suppose();
  state_ = State::kLost;
  moves_ = moved.moves;
  has_settled_ = is_told_ = false;
  astray_ = 0;
  last_ = moved_since_ = moved.image->exposure;
}

// A table pans and does not turn; a C-arm turns about its isocentre, about one axis at a time or nearly so,
// and not about its axis of view. What was open of the pose before stays so.
void ViewRelocaliser::suppose() {
  for (std::size_t move = 0; move < kMoves; ++move) {
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
    hypothesis.pose = pose_;
    ViewPose::Covariance P = pose_.covariance();
    P.diagonal() += sigma.cwiseAbs2();
    hypothesis.pose.set_covariance(P);
    hypothesis.log_evidence = 0;
    hypothesis.good = 0;
    hypothesis.has_used = false;
  }
}

// Of a pan or another magnification the background tells nearly all.
void ViewRelocaliser::settle(const MovedImage& moved) {
  has_settled_ = true;
  for (Hypothesis& hypothesis : hypotheses_) hypothesis.good = 0;
  const BackgroundMotion& motion = moved.motion;
  const bool is_pan = motion.kind == BackgroundMotion::Kind::kPanned;
  is_told_ =
      motion.agreeing_share >= kPanAgreeing && (is_pan || motion.kind == BackgroundMotion::Kind::kMagnified);
  if (!is_told_) {
    if (was_unseen_) begin_search();
    return;
  }
  ViewGeometry geometry = moved.image->geometry.value_or(configured_);
  // Half a breath looks like a little of it; fields of view change by more.
  const bool is_zoom = std::abs(motion.magnification - 1) > kMinZoom;
  geometry.fx *= is_zoom ? motion.magnification : 1;
  geometry.fy *= is_zoom ? motion.magnification : 1;
  ViewPose::Error shift = ViewPose::Error::Zero();
  shift.segment<2>(3) = motion.shift_mm;
  Hypothesis& pan = hypotheses_[kPan];
  pan.pose = ViewPose(geometry, pivot_depth_mm_).with_error(shift);
  pan.pose.add_sigma(kHeldTurn_rad, kPanShare * motion.shift_mm.norm() + kPanSigma_mm);
  if (!is_pan) {
    ViewPose::Covariance P = pan.pose.covariance();
    P(5, 5) += squared(kMagnification * pivot_depth_mm_);  // seen as another magnification
    pan.pose.set_covariance(P);
  }
  pan.good = 0;
  pan.has_used = false;
  // Nearly all blocks went by the same way: no C-arm turned.
  pan.log_evidence =
      std::max({hypotheses_[kTurn].log_evidence, hypotheses_[kTilt].log_evidence}) + kBackgroundTells;
}

// At a steady speed: what is open grows as the time does, not as its root.
void ViewRelocaliser::move_on(double dt_s) {
  const double moved_s = seconds_between(moved_since_, last_);
  const double grown_s2 = dt_s * std::max(0.0, 2 * moved_s - dt_s);
  for (Hypothesis& hypothesis : hypotheses_) {
    ViewPose::Covariance P = hypothesis.pose.covariance();
    P.diagonal() += hypothesis.growth.cwiseAbs2() * grown_s2;
    hypothesis.pose.set_covariance(P);
  }
}

// False without one.
bool ViewRelocaliser::take_shape(const TubeEstimate& shape) {
  const auto of_shape = std::ranges::find_if(splines_, [&](const UniformCubicBSpline& spline) {
    return static_cast<std::uint32_t>(spline.coefficient_count()) == shape.coefficient_count;
  });
  const bool has_shape = shape.point_count > 0 && shape.validity != Validity::kInvalid;
  if (of_shape == splines_.end() || !has_shape) return false;
  spline_ = &*of_shape;
  for (Eigen::Index i = 0; i < spline_->coefficient_count(); ++i) {
    C_.col(i) = Eigen::Map<const Eigen::Vector3d>(shape.coefficients_mm[static_cast<std::size_t>(i)].data());
  }
  const double last_point = static_cast<double>(shape.point_count) - 1;
  for (int i = 0; i < layout_.count; ++i) {
    const CubicBasis basis = spline_->basis(layout_.s_mm(i));
    points_mm_.col(i) = combine(C_, basis.first, basis.value);
    const double place = std::round(layout_.s_mm(i) / static_cast<double>(shape.length_mm) * last_point);
    const auto point = static_cast<std::size_t>(std::clamp(place, 0.0, last_point));
    covariance_[static_cast<std::size_t>(i)] = symmetric(shape.points[point].covariance_mm2);
    if (!covariance_[static_cast<std::size_t>(i)].allFinite()) return false;
  }
  return true;
}

void ViewRelocaliser::observe(const MovedImage& moved, const TubeEstimate& shape) {
  if (state_ == State::kGiven || moved.moves != moves_) begin(moved);
  const double dt_s = std::max(0.0, seconds_between(last_, moved.image->exposure));
  last_ = moved.image->exposure;
  if (moved.has_settled && !has_settled_) settle(moved);
  if (!has_settled_) move_on(dt_s);
  if (!take_shape(shape)) return;
  for (Hypothesis& hypothesis : hypotheses_) correct(moved, hypothesis);
  choose(moved.image->exposure);
  note_astray(moved.image->exposure);
}

void ViewRelocaliser::correct(const MovedImage& moved, Hypothesis& hypothesis) {
  correct(moved, news_for(hypothesis), hypothesis);
}

void ViewRelocaliser::correct(const MovedImage& moved, double news, Hypothesis& hypothesis) {
  const PoseMatch found = match(moved, hypothesis.pose, std::max(news, kMinNews));
  const bool is_worthwhile = !has_settled_ || news >= kWorthwhileNews;
  if (is_worthwhile) hypothesis.log_evidence += found.is_found ? found.log_evidence : kNotFound;
  if (!found.is_found) {
    hypothesis.good = 0;
    return;
  }
  ++hypothesis.good;
  if (!is_worthwhile) return;
  hypothesis.pose = found.pose;
  hypothesis.points_used_mm = points_mm_;
  hypothesis.has_used = true;
}

void ViewRelocaliser::choose(MonotonicTime exposure) {
  const auto better_at = std::ranges::max_element(hypotheses_, {}, &Hypothesis::log_evidence);
  likeliest_ = static_cast<std::size_t>(better_at - hypotheses_.begin());
  const Hypothesis& better = *better_at;
  pose_ = better.pose;
  note_sigma();
  if (state_ == State::kLost && has_settled_ && !is_searching() && better.good >= kGoodInARow &&
      is_known_well() && is_decided(better)) {
    state_ = State::kFound;
    refined_ = 0;
    bad_since_ = last_use_ = exposure;
  }
}

// None of the others is nearly as likely and has the tube elsewhere in the image.
bool ViewRelocaliser::is_decided(const Hypothesis& better) const {
  return std::ranges::all_of(hypotheses_, [&](const Hypothesis& other) {
    if (&other == &better || better.log_evidence - other.log_evidence > kCertain) return true;
    double squares_mm2 = 0;
    for (int i = 0; i < layout_.count; ++i) {
      const Eigen::Vector3d apart_mm = better.pose.geometry().T_camera_world() * points_mm_.col(i) -
                                       other.pose.geometry().T_camera_world() * points_mm_.col(i);
      squares_mm2 += apart_mm.head<2>().squaredNorm() / layout_.count;
    }
    return squares_mm2 < squared(kSamePlace_mm);
  });
}

void ViewRelocaliser::note_sigma() {
  const Eigen::Vector3d middle_mm =
      pose_.geometry().T_camera_world().inverse() * Eigen::Vector3d(0, 0, pivot_depth_mm_);
  sigma_across_mm_ = std::sqrt(pose_.covariance_across(middle_mm).trace() / 2);
}

// Three standard deviations, of the line that is known worst.
int ViewRelocaliser::reach_px(const ViewPose& pose) const {
  double worst_px2 = 0;
  const RigidTransform T = pose.geometry().T_camera_world();
  for (int i = 0; i < layout_.count; i += 4) {
    const double depth_mm = (T * points_mm_.col(i)).z();
    const double px_mm = pose.geometry().fx / std::max(depth_mm, 1.0);
    const Eigen::Matrix3d across =
        pose.covariance_across(points_mm_.col(i)) + covariance_[static_cast<std::size_t>(i)];
    worst_px2 = std::max(worst_px2, px_mm * px_mm * across.trace() / 2);
  }
  return static_cast<int>(
      std::clamp(3 * std::sqrt(worst_px2), double{kMinReach_px}, double{LineSearch::kMaxReach}));
}

std::size_t ViewRelocaliser::place_of(double s_mm) const {
  return static_cast<std::size_t>(std::clamp(std::lround(s_mm / layout_.spacing_mm), 0L, layout_.count - 1L));
}

// Where the image shows the tube, seen from that pose; nullptr: nowhere near.
const ViewConstraints* ViewRelocaliser::look(const MovedImage& moved, const ViewPose& pose, int reach_px) {
  const LentGeometry lent(*moved.image, pose.geometry());
  looked_at_.instant = looked_at_.now = moved.image->exposure;
  looked_at_.image_timeout = std::chrono::milliseconds(1);
  looked_at_.images[0] = moved.image;
  looked_at_.on_demand[0] = moved.on_demand;
  views_.measure(looked_at_, *spline_, C_, {.reach_px = reach_px}, *scratch_);
  const auto views = views_.constraints(looked_at_, 1, true);
  const bool is_seen =
      !views.empty() && views[0].count >= kMinLines && scratch_->image_inlier_ratio >= kMinAgreeing;
  return is_seen ? views.data() : nullptr;
}

// A line's distance is o_i = H_i e + noise of variance R_i, H_i = (J_image_camera^T n)^T jacobian(p_camera).
// `e` is the error that `pose` has taken in already.
ViewRelocaliser::LeastSquares ViewRelocaliser::linearise(const ViewConstraints& view, const ViewPose& pose,
                                                         const ViewPose::Error& e, double news) const {
  const double lines_a_share = std::max(1.0, kShare_mm / layout_.spacing_mm);
  const RigidTransform T = pose.geometry().T_camera_world();
  LeastSquares sum;
  for (int i = 0; i < view.count; ++i) {
    const LineConstraint& line = view.lines[i];
    const std::size_t place = place_of(line.s_mm);
    const Eigen::Vector3d p_world_mm = points_mm_.col(static_cast<Eigen::Index>(place));
    const auto here = view.camera->project(p_world_mm);
    if (!here) continue;
    const Eigen::Vector3d gradient_world = here->J_image_world.transpose() * line.normal;
    const Eigen::Matrix<double, 1, 6> H =
        (T.linear() * gradient_world).transpose() * pose.jacobian(T * p_world_mm);
    const double shape_px2 = gradient_world.dot(covariance_[place] * gradient_world);
    const bool is_end = line.s_mm == 0 && i + 1 == view.count;  // of which there is one
    const double R = (shape_px2 + line.variance_px2) * (is_end ? 1 : lines_a_share) / news;
    const double off_px = line.normal.dot(line.target_px - here->p_image_px) + H * e;
    sum.N += H.transpose() * H / R;
    sum.b += H.transpose() * (off_px / R);
    sum.squares += off_px * off_px / R;
  }
  return sum;
}

// Iterated update of a Gaussian of mean m and covariance P. With N = P^-1 + sum H_i^T H_i / R_i its evidence
// is
//   log p(o) = -1/2 (sum (o_i - H_i e)^2 / R_i + (e - m)^T P^-1 (e - m) + log |P N|) + const.
PoseMatch ViewRelocaliser::match(const MovedImage& moved, const ViewPose& prior, double news,
                                 const ViewPose::Error& expected) {
  const ViewPose::Covariance information = prior.covariance().inverse();
  const ViewPose::Error known = information * expected;
  int reach = reach_px(prior);
  PoseMatch found;
  ViewPose::Error e = ViewPose::Error::Zero();
  ViewPose::Covariance P;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    found.pose = prior.with_error(e);
    const ViewConstraints* const view = look(moved, found.pose, reach);
    if (view == nullptr) return found;
    const LeastSquares lines = linearise(*view, found.pose, e, news);
    const ViewPose::Covariance N = information + lines.N;
    P = N.inverse();
    const ViewPose::Error b = lines.b + known;
    const ViewPose::Error next = P * b;
    const double change = (next - e).cwiseQuotient(P.diagonal().cwiseSqrt()).norm();
    e = next;
    found.log_evidence = -0.5 * (lines.squares + expected.dot(known) - b.dot(e) +
                                 std::log(prior.covariance().determinant()) + std::log(N.determinant()));
    if (change < kConverged) break;
    reach = std::min(reach, kNextReach_px);
  }
  found.pose = prior.with_error(e);
  found.pose.set_covariance(P);
  found.is_found = true;
  return found;
}

}  // namespace tubed
