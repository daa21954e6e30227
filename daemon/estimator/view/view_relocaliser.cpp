#include "daemon/estimator/view/view_relocaliser.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "idl/geometry/rigid_transform.hpp"

namespace tubed {

namespace {

constexpr double kRadians = M_PI / 180;
constexpr double kUnseen_s = 0.5;      // without images: a C-arm turns by 5 degrees
constexpr double kUntilNoticed_s = 2;  // that a view moved, from its first image on
constexpr int kStartsAnImage = 3;      // of a search
// When a pose is used.
constexpr double kUse_mm = 1.5;  // standard deviation across the view
constexpr double kUseTurn_rad = 4 * kRadians;
constexpr double kMinInView = 0.1;  // of the tube, of an image that says anything about the pose

double depth_of_looked_at_mm(const CameraCalibration& camera) {
  return (camera.T_camera_world * camera.looked_at_world_mm().value_or(Eigen::Vector3d::Zero())).z();
}

}  // namespace

ViewRelocaliser::ViewRelocaliser(const EstimatorSettings& settings, const InstrumentDescription& instrument,
                                 const RoomDescription& room, std::size_t camera)
    : camera_(camera),
      configured_(geometry_of(room.cameras[camera])),
      errors_(room_errors(room, instrument)),
      pivot_depth_mm_(depth_of_looked_at_mm(room.cameras[camera])),
      matcher_(settings, instrument, room.cameras[camera]),
      hypotheses_(matcher_.line_count()),
      use_(matcher_.line_count()),
      here_mm_(3, matcher_.line_count()) {}

void ViewRelocaliser::forget() {
  if (state_ == State::kGiven) return;
  state_ = State::kGiven;
  matcher_.forget();
}

void ViewRelocaliser::reset() {
  forget();
  times_ = {};
}

void ViewRelocaliser::note_image(MonotonicTime exposure) {
  if (seconds_between(times_.image, exposure) > kUnseen_s) {
    times_.resumed = exposure;
    move_.was_unseen = move_.was_unseen || (state_ == State::kLost && !move_.has_settled);
    if (!search_.is_running()) search_.forget();  // the catheter may be in the picture again
  }
  times_.image = exposure;
}

void ViewRelocaliser::begin(const MovedImage& moved) {
  const MonotonicTime exposure = moved.image->exposure;
  const bool is_still_lost = state_ == State::kLost;
  if (state_ == State::kGiven) {
    pose_ = ViewPose(moved.image->geometry.value_or(configured_), pivot_depth_mm_);
  }
  // A second move while the first is open: what is looked for is the sum of both.
  const ViewPose before = is_still_lost ? before_ : pose_;
  lose((is_still_lost && move_.was_unseen) || seconds_between(times_.resumed, exposure) < kUntilNoticed_s);
  before_ = before;
  move_.number = moved.moves;
  move_.has_settled = false;
  move_.last = move_.since = exposure;
}

void ViewRelocaliser::lose(bool was_unseen) {
  state_ = State::kLost;
  before_ = pose_;
  move_.is_told = false;
  move_.was_unseen = was_unseen;
  search_.forget();
  hypotheses_.suppose(pose_);
}

void ViewRelocaliser::settle(const MovedImage& moved) {
  move_.has_settled = true;
  hypotheses_.settle();
  move_.is_told = MoveHypotheses::tells(moved.motion);
  if (move_.is_told) {
    hypotheses_.suppose_told(moved.motion, moved.image->geometry.value_or(configured_), pivot_depth_mm_);
  } else if (move_.was_unseen) {
    search_.begin(before_);
  }
}

void ViewRelocaliser::observe(const MovedImage& moved, const TubeEstimate& shape) {
  if (state_ == State::kGiven || moved.moves != move_.number) begin(moved);
  const MonotonicTime exposure = moved.image->exposure;
  const double dt_s = std::max(0.0, seconds_between(move_.last, exposure));
  move_.last = exposure;
  if (moved.has_settled && !move_.has_settled) settle(moved);
  if (!move_.has_settled) hypotheses_.move_on(dt_s, seconds_between(move_.since, move_.last));
  if (!matcher_.take_shape(shape)) return;
  times_.shape = exposure;
  hypotheses_.correct(matcher_, moved, move_.has_settled);
  choose(exposure);
  const bool is_astray = move_.has_settled && !move_.is_told && !hypotheses_.have_tube();
  search_.note_image(is_astray, before_);
}

void ViewRelocaliser::choose(MonotonicTime exposure) {
  take_pose();
  if (state_ == State::kLost && move_.has_settled && !search_.is_running() && hypotheses_.is_steady() &&
      is_known_well() && hypotheses_.are_decided(matcher_.points_mm())) {
    state_ = State::kFound;
    use_.begin(exposure);
  }
}

void ViewRelocaliser::take_pose() {
  pose_ = hypotheses_.likeliest();
  const Eigen::Vector3d middle_mm =
      pose_.geometry().T_camera_world().inverse() * Eigen::Vector3d(0, 0, pivot_depth_mm_);
  sigma_across_mm_ = std::sqrt(pose_.covariance_across(middle_mm).trace() / 2);
}

// A turn that nobody saw is open by far more than the lines of one place tell.
bool ViewRelocaliser::is_known_well() const {
  const std::array<double, 3>& turn_rad = pose_.geometry().sigma.rotation_rad;
  return sigma_across_mm_ < kUse_mm &&
         (!move_.was_unseen || std::max(turn_rad[0], turn_rad[1]) < kUseTurn_rad);
}

void ViewRelocaliser::look_further(const MovedImage& moved) {
  if (state_ != State::kLost || !search_.is_running() || times_.shape != moved.image->exposure) return;
  for (int i = 0; i < kStartsAnImage && !search_.is_over(); ++i) {
    const TurnSearch::Start start = search_.next();
    search_.add(start.move, matcher_.match(moved, start.pose, 1, start.expected));
  }
  if (!search_.is_over()) return;
  search_.end();
  if (!search_.has_found()) return;
  move_.was_unseen = true;
  hypotheses_.suppose_found(search_, matcher_.points_mm());
}

bool ViewRelocaliser::holds(const MovedImage& moved) {
  if (state_ != State::kFound) return false;
  if (moved.moves == move_.number && moved.has_settled) return true;
  if (moved.moves != move_.number) begin(moved);
  return false;
}

// That coils are missing, or the tube is not in the picture, says nothing of the pose.
void ViewRelocaliser::judge_use(const ImageMeasurement& image, const TubeEstimate& estimate) {
  const bool says_something = !estimate.reasons.has(Reason::kEmStale) && matcher_.take_shape(estimate) &&
                              matcher_.share_in_view(pose_) > kMinInView;
  const bool is_good =
      uses(estimate, camera_, image.exposure) && !estimate.reasons.has(Reason::kImageLostTube);
  if (use_.note(image.exposure, is_good, says_something)) return;
  // Nobody saw it go, and by how much: what is open is more than a move that is followed leaves open.
  lose(true);
  search_.begin(before_);
}

// Where the tube is the estimate knows better than coils of one instant.
void ViewRelocaliser::refine(const MovedImage& moved, const TubeEstimate& estimate,
                             const TubeEstimate& by_coils) {
  if (state_ != State::kFound || !moved.has_settled || !matcher_.take_shape(estimate)) return;
  here_mm_ = matcher_.points_mm();
  const double news = std::min(hypotheses_.news_of(here_mm_), use_.news_of(here_mm_));
  if (news < MoveHypotheses::kWorthwhileNews || !matcher_.take_shape(by_coils)) return;
  use_.note_refined_at(here_mm_);
  hypotheses_.refine(matcher_, moved, news, here_mm_);
  take_pose();
}

ViewPose ViewRelocaliser::pose() const {
  ViewPose registered = pose_;
  registered.add_sigma(errors_.turn_rad, errors_.shift_mm);
  return registered;
}

}  // namespace tubed
