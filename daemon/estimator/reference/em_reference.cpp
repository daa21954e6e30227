#include "daemon/estimator/reference/em_reference.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "idl/geometry/degree.hpp"

namespace tubed {

namespace {

using std::chrono::milliseconds;

constexpr milliseconds kStuck{150};        // the same value for so long, as of any coil
constexpr int kMinRepeats = 3;             // and at least so often
constexpr milliseconds kConfirmed{250};    // two measurements farther apart confirm nothing
constexpr milliseconds kJumpIsTold{1000};  // to whoever looks once a second
constexpr int kMinCoilsThatTell = 2;       // one may be pushed just then
constexpr double kTellingRatio = 2;        // of what coils moved with and without the reference's jump

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

bool is_same(const CoilSample& a, const CoilSample& b) {
  return a.p_em_mm == b.p_em_mm && a.tangent_em == b.tangent_em;
}

bool is_posed(const CoilSample& sample) {
  return sample.status == CoilStatus::kOk && sample.p_em_mm.allFinite();
}

TwoCoils registered_coils(const ReferenceDescription& description) {
  TwoCoils coils;
  for (std::size_t i = 0; i < coils.size(); ++i) {
    coils[i] = {description.p_em_registered_mm[i], description.axis_em_registered[i].normalized()};
  }
  return coils;
}

/// Is the pose so uncertain, or the filter so far behind one that moves, that half a jump would not be
/// noticed?
bool is_behind(const PoseFilter& filter, const ReferenceDescription& description) {
  const PoseCovariance covariance = filter.covariance();
  const double turn_rad = std::sqrt(covariance.topLeftCorner<3, 3>().trace());
  const double shift_mm = std::sqrt(covariance.bottomRightCorner<3, 3>().trace());
  return turn_rad > description.jump_deg * kDegree / 2 || shift_mm > description.jump_mm / 2;
}

}  // namespace

Eigen::Matrix3d ReferenceError::covariance_at(const Eigen::Vector3d& p_mm) const {
  Eigen::Matrix<double, 3, 6> J;  // of -w x r - v = r x w - v
  J << cross_matrix(p_mm - pivot_mm), -Eigen::Matrix3d::Identity();
  return J * covariance * J.transpose();
}

ReferenceError ReferenceError::in(const RigidTransform& T_to_from) const {
  PoseCovariance turn = PoseCovariance::Zero();
  turn.topLeftCorner<3, 3>() = turn.bottomRightCorner<3, 3>() = T_to_from.linear();
  return {T_to_from * pivot_mm, turn * covariance * turn.transpose()};
}

EmReference::EmReference(const std::optional<ReferenceDescription>& description)
    : description_(description), filter_(description ? description->time_constant_ms * 1e-3 : 0) {
  if (!description_) {
    return;
  }
  sigma_ = {description_->sigma_position_mm, description_->sigma_angle_deg * kDegree};
  if (description_->has_two_coils()) {
    const TwoCoils registered = registered_coils(*description_);
    body_ = body_of(registered);
    T_registered_body_.translation() = registered[0].p_mm - body_[0].p_mm;
  } else {
    T_registered_body_ = description_->T_em_reference_registered;
  }
}

std::optional<EmPlacement> EmReference::take(const EmFrame& frame) {
  has_measured_ = true;
  if (!description_) {
    return EmPlacement{};
  }
  const Sighting sighting = sight(frame);
  if (sighting.fault == Fault::kNone) {
    fault_ = follow(sighting.pose, frame);
  } else {
    fault_ = sighting.fault;
    candidate_.reset();
    filter_.miss(frame.measured);
  }
  if (fault_ == Fault::kNone) {
    newest_good_ = frame.measured;
    good_ = frame;
    return placement();
  }
  const bool is_unsure_where = fault_ == Fault::kJump || fault_ == Fault::kSettling;
  return is_unsure_where || is_lost(frame.measured) ? std::nullopt : std::optional(placement());
}

EmReference::Sighting EmReference::sight(const EmFrame& frame) {
  Sighting sighting;
  sighting.fault = fault_of(frame);
  if (sighting.fault != Fault::kNone) {
    return sighting;
  }
  const auto sample = [&](std::size_t i) -> const CoilSample& {
    return frame.coils[static_cast<std::size_t>(description_->sensors[i] - 1)];
  };
  if (!description_->has_two_coils()) {
    const auto pose = pose_of_sensor(sample(0).p_em_mm, sample(0).tangent_em, sample(0).x_axis_em, sigma_);
    sighting.fault = pose ? Fault::kNone : Fault::kNoOrientation;
    sighting.pose = pose.value_or(SensorPose{});
    return sighting;
  }
  const TwoCoils measured{CoilPose{sample(0).p_em_mm, sample(0).tangent_em.normalized()},
                          CoilPose{sample(1).p_em_mm, sample(1).tangent_em.normalized()}};
  const TwoCoilMisfit misfit = misfit_of(body_, measured);
  // A comparison with NaN is false.
  const bool is_the_body = misfit.distance_mm <= description_->tolerance_mm &&
                           misfit.angle_rad <= description_->tolerance_deg * kDegree;
  sighting.fault = is_the_body ? Fault::kNone : Fault::kContradiction;
  if (is_the_body) {
    sighting.pose = pose_of_two_coils(body_, measured, sigma_);
  }
  return sighting;
}

EmReference::Fault EmReference::fault_of(const EmFrame& frame) {
  Fault fault = Fault::kNone;
  for (const int sensor : description_->sensors) {
    const CoilSample sample =
        sensor <= frame.coil_count ? frame.coils[static_cast<std::size_t>(sensor - 1)] : CoilSample{};
    if (sample.status == CoilStatus::kOutOfVolume) {
      return Fault::kOutOfVolume;
    }
    const double length = sample.tangent_em.norm();
    const bool is_usable = is_posed(sample) && std::abs(length - 1) < 0.1;  // false for NaN
    fault = is_usable ? fault : Fault::kMissing;
  }
  return fault == Fault::kNone && repeats(frame) ? Fault::kStuck : fault;
}

// A real sensor always shows noise: equal to the last bit for long is a tracker that repeats itself.
bool EmReference::repeats(const EmFrame& frame) {
  bool is_repeated = true;
  for (std::size_t i = 0; i < description_->sensors.size(); ++i) {
    const CoilSample& sample = frame.coils[static_cast<std::size_t>(description_->sensors[i] - 1)];
    is_repeated = is_repeated && is_same(sample, repetition_.samples[i]);
    repetition_.samples[i] = sample;
  }
  repetition_.count = is_repeated ? repetition_.count + 1 : 0;
  repetition_.since = is_repeated ? repetition_.since : frame.measured;
  return repetition_.count >= kMinRepeats && frame.measured - repetition_.since >= kStuck;
}

// The beginning and the end of an absence are confirmed as a jump is.
EmReference::Fault EmReference::follow(const SensorPose& pose, const EmFrame& frame) {
  const bool is_followed = begun_ && !is_lost(frame.measured);
  if (is_followed && !is_jump(filter_.innovation(pose))) {
    filter_.update(pose, frame.measured);
    candidate_.reset();
    return Fault::kNone;
  }
  const bool is_confirmed = candidate_ && frame.measured - candidate_->time <= kConfirmed &&
                            !is_jump(difference_of(candidate_->pose.T_em_body, pose.T_em_body));
  if (!is_confirmed) {
    candidate_ = Candidate{pose, frame.measured};
    return is_followed ? Fault::kJump : Fault::kSettling;
  }
  if (is_followed) {
    jump(pose, frame);
  }
  filter_.begin(pose, frame.measured);
  begun_ = true;
  candidate_.reset();
  return Fault::kNone;
}

void EmReference::jump(const SensorPose& pose, const EmFrame& frame) {
  const PoseError difference = filter_.innovation(pose);
  jump_ = Jump{frame.measured, difference.tail<3>().norm(), difference.head<3>().norm() / kDegree};
  const RigidTransform T_before = T_registered_em(filter_.pose());
  const RigidTransform T_after = T_registered_em(pose.T_em_body);
  if (!coils_stayed(frame, T_after)) {
    return;
  }
  const RigidTransform slip = T_after * T_before.inverse() * slip_.value_or(RigidTransform::Identity());
  // At the reference, where a turn does not look like a shift.
  const RigidTransform there = slip * T_registered_body_;
  slip_ = is_jump(difference_of(T_registered_body_, there)) ? std::optional(slip) : std::nullopt;
}

// A generator that moves moves all coils in its frame, and in the registered frame none. When only the
// reference has jumped it is the other way round.
bool EmReference::coils_stayed(const EmFrame& frame, const RigidTransform& T_after) const {
  const RigidTransform T_before = T_registered_em(filter_.pose());
  double in_em_mm2 = 0;
  double in_registered_mm2 = 0;
  int count = 0;
  for (int i = 0; i < std::min(frame.coil_count, good_.coil_count); ++i) {
    const CoilSample& now = frame.coils[static_cast<std::size_t>(i)];
    const CoilSample& before = good_.coils[static_cast<std::size_t>(i)];
    if (is_posed(now) && is_posed(before) && !is_of_reference(i)) {
      in_em_mm2 += (now.p_em_mm - before.p_em_mm).squaredNorm();
      in_registered_mm2 += (T_after * now.p_em_mm - T_before * before.p_em_mm).squaredNorm();
      ++count;
    }
  }
  return count >= kMinCoilsThatTell && in_registered_mm2 > kTellingRatio * kTellingRatio * in_em_mm2;
}

bool EmReference::is_jump(const PoseError& difference) const {
  return !(difference.tail<3>().norm() <= description_->jump_mm) ||
         !(difference.head<3>().norm() <= description_->jump_deg * kDegree);
}

bool EmReference::is_lost(MonotonicTime now) const {
  const std::chrono::nanoseconds timeout(static_cast<std::int64_t>(description_->timeout_ms * 1e6));
  return !begun_ || now - newest_good_ > timeout;
}

bool EmReference::is_of_reference(int index) const {
  const auto& sensors = description_->sensors;
  return std::find(sensors.begin(), sensors.end(), index + 1) != sensors.end();
}

RigidTransform EmReference::T_registered_em(const RigidTransform& T_em_body) const {
  return T_registered_body_ * T_em_body.inverse();
}

EmPlacement EmReference::placement() const {
  const RigidTransform& T_em_body = filter_.pose();
  const RigidTransform T = T_registered_em(T_em_body);
  return {T, ReferenceError{T_em_body.translation(), filter_.covariance()}.in(T)};
}

ReferenceDoubt EmReference::doubt(MonotonicTime now) const {
  if (!description_) {
    return ReferenceDoubt::kNone;
  }
  if (is_lost(now)) {
    return ReferenceDoubt::kLost;
  }
  const bool has_jumped = jump_ && now - jump_->time < kJumpIsTold;
  const bool is_doubtful = fault_ != Fault::kNone || slip_ || has_jumped || is_behind(filter_, *description_);
  return is_doubtful ? ReferenceDoubt::kDoubtful : ReferenceDoubt::kNone;
}

void EmReference::describe(MonotonicTime now, std::span<char> words) const {
  words.front() = '\0';
  if (!has_measured_ || doubt(now) == ReferenceDoubt::kNone) {
    return;
  }
  std::array<char, 24> who{};
  const std::vector<int>& sensors = description_->sensors;
  if (sensors.size() == 2) {
    std::snprintf(who.data(), who.size(), "sensors %d and %d", sensors[0], sensors[1]);
  } else {
    std::snprintf(who.data(), who.size(), "sensor %d", sensors[0]);
  }
  const auto say = [&](const char* what) {
    std::snprintf(words.data(), words.size(), "the patient's reference, %s, %s", who.data(), what);
  };
  switch (fault_) {
    case Fault::kMissing:
      return say("is missing: look at its plug and where it is fixed");
    case Fault::kOutOfVolume:
      return say("is outside the tracker's volume: move the field generator nearer");
    case Fault::kStuck:
      return say("repeats the same values: the tracker hangs, or its port does");
    case Fault::kNoOrientation:
      return say("gives no orientation: it has to have 6 degrees of freedom, or be two coils (sensors)");
    case Fault::kContradiction:
      return say(
          "is not the body that was registered: its coils have moved against each other, or metal is near");
    case Fault::kSettling:
      return say("is there again and settles");
    case Fault::kJump:
    case Fault::kNone:
      break;
  }
  if (slip_) {
    return say(
        "moved and the catheter's coils did not: it has come off the patient, or metal is near; fix it and "
        "register again");
  }
  if (is_lost(now)) {
    return say("was not seen since the tracker sent its last measurement");
  }
  if (fault_ == Fault::kJump || !jump_) {
    return say("moves or jumps: the field generator or the patient is being moved");
  }
  std::snprintf(words.data(), words.size(),
                "the patient's reference, %s, has jumped by %.1f mm and %.1f deg: the field generator was "
                "moved; or the "
                "patient, and then the cameras' poses are no longer right",
                who.data(), jump_->shift_mm, jump_->turn_deg);
}

}  // namespace tubed
