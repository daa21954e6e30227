#include "clients/calibration/image_registration.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "clients/calibration/formatted.hpp"
#include "clients/calibration/registration_values.hpp"
#include "clients/calibration/tube_sightings.hpp"
#include "idl/geometry/camera.hpp"
#include "idl/geometry/degree.hpp"
#include "idl/geometry/squared.hpp"

namespace tubed {

namespace {

constexpr double kHalfWindow_s = 0.04;  // over which coils are averaged
constexpr double kPlace_mm = 80;        // of the tracker's field: beyond it a coil is off in another way
constexpr std::size_t kMaxPlaces = 8;
constexpr int kMaxRounds = 4;
constexpr double kFieldLever_mm = 100;  // over which a field turns coils as much as it shifts them
constexpr double kSettled_mm = 0.1;
constexpr double kSettled_rad = 0.1 * kDegree;
constexpr double kOtherDirection_rad = 1 * kDegree;

/// Where one coil was seen, as places of the field.
class Places {
 public:
  std::size_t of(const Eigen::Vector3d& p_mm) {
    std::size_t nearest = 0;
    for (std::size_t i = 1; i < places_mm_.size(); ++i) {
      if ((places_mm_[i] - p_mm).norm() < (places_mm_[nearest] - p_mm).norm()) nearest = i;
    }
    const bool is_near = !places_mm_.empty() && (places_mm_[nearest] - p_mm).norm() < kPlace_mm;
    if (is_near || places_mm_.size() == kMaxPlaces) return nearest;
    places_mm_.push_back(p_mm);
    return places_mm_.size() - 1;
  }

 private:
  std::vector<Eigen::Vector3d> places_mm_;
};

/// The largest angle between any two.
double max_angle_rad(const std::vector<Eigen::Vector3d>& directions) {
  double largest_rad = 0;
  for (const Eigen::Vector3d& a : directions) {
    for (const Eigen::Vector3d& b : directions) {
      largest_rad = std::max(largest_rad, std::atan2(a.cross(b).norm(), a.dot(b)));
    }
  }
  return largest_rad;
}

/// All that one reading of the images gives.
struct Seen {
  std::vector<SeenBesideCoil> beside;
  std::set<std::pair<int, std::size_t>> images;
  std::vector<Eigen::Vector3d> directions;  ///< of view, those that differ; world

  void add_direction(const Eigen::Vector3d& direction) {
    const bool is_known =
        std::any_of(directions.begin(), directions.end(), [&](const Eigen::Vector3d& known) {
          return known.cross(direction).norm() < std::sin(kOtherDirection_rad);
        });
    if (!is_known) directions.push_back(direction);
  }
};

Seen look(const ConfiguredSequence& run) {
  const Sequence& sequence = run.sequence;
  std::vector<CoilTrack> tracks;
  for (const CoilPlacement& coil : sequence.room.instruments.front().coils) {
    tracks.emplace_back(sequence.measurements, coil);
  }
  const double beyond_mm = sequence.room.instruments.front().coils.front().offset_from_tip_mm;
  std::vector<Places> places(tracks.size() + 1);
  Seen seen;
  for (int camera = 0; camera < static_cast<int>(sequence.room.cameras.size()); ++camera) {
    for (const TubeSighting& sighting : sight_tube(run, {.camera = camera})) {
      const auto coil = tracks[sighting.coil].at(sighting.t_s, kHalfWindow_s);
      if (!coil) continue;
      // The end as one more coil, which is seen along the tube: nothing else tells a tube that slides in
      // itself.
      const std::size_t index = sighting.is_end ? tracks.size() : sighting.coil;
      const Eigen::Vector3d p_em_mm = coil->p_em_mm + (sighting.is_end ? beyond_mm : 0) * coil->toward_tip_em;
      const Eigen::Vector3d p_world_mm = sequence.room.T_world_em * p_em_mm;
      const CameraCalibration calibration = camera_of(sequence, sequence.frames[sighting.frame]);
      const auto projection = Camera(calibration).project(p_world_mm);
      if (!projection) continue;
      const Eigen::Vector3d px_per_mm = projection->J_image_world.transpose() * sighting.direction;
      const double off_px = sighting.direction.dot(sighting.p_image_px - projection->p_image_px);
      seen.beside.push_back({index, places[index].of(p_world_mm), p_world_mm, px_per_mm.normalized(),
                             off_px / px_per_mm.norm()});
      seen.images.insert({camera, sighting.frame});
      seen.add_direction(calibration.T_camera_world.linear().row(2).transpose());
    }
  }
  return seen;
}

RigidTransform motion_of(const RigidCorrection& correction) {
  RigidTransform motion = RigidTransform::Identity();
  const double angle_rad = correction.turn_rad.norm();
  const Eigen::Vector3d axis =
      angle_rad > 0 ? Eigen::Vector3d(correction.turn_rad / angle_rad) : Eigen::Vector3d::UnitX();
  motion.translate(correction.centre_world_mm + correction.shift_mm);
  motion.rotate(Eigen::AngleAxisd(angle_rad, axis));
  motion.translate(-correction.centre_world_mm);
  return motion;
}

void require_images(const ConfiguredSequence& run) {
  const auto& frames = run.sequence.frames;
  if (std::none_of(frames.begin(), frames.end(), [](const SequenceFrame& f) { return f.fluoroscopy_on(); })) {
    throw CalibrationError("the recording has no images: record with fluoroscopy on");
  }
}

[[noreturn]] void refuse_unseen(const Seen& seen) {
  throw CalibrationError(
      formatted(
          "the tube was seen beside its coils %zu times in %zu images, %zu times beside three coils are "
          "needed: ",
          seen.beside.size(), seen.images.size(), kMinSightings) +
      "have the catheter in view. Where it is and was not found, the registration is off by more than a "
      "centimetre or something else is wrong: `tubectl check` says what");
}

void judge(const ImageRegistration& found, double max_sigma_mm) {
  const double worst_mm = found.correction.worst_shift_mm();
  if (worst_mm <= max_sigma_mm) return;
  const Eigen::Vector3d d = found.correction.worst_direction();
  throw CalibrationError(
      formatted("along (%.2f, %.2f, %.2f) in the world the registration would be known to %.1f mm only, %.1f "
                "mm are needed: ",
                d.x(), d.y(), d.z(), worst_mm, max_sigma_mm) +
      formatted("the directions of view lie %.0f degrees apart at most. ", found.apart_rad / kDegree) +
      "Record half a minute while the C-arm swings by 30 degrees and each image says how it stands, or with "
      "two cameras; --max-sigma takes less");
}

/// What is left of each coil.
std::vector<double> coil_rms_mm(const Seen& seen, const RigidCorrection& correction, std::size_t coils) {
  std::vector<double> squares(coils, 0);
  std::vector<double> counts(coils, 0);
  for (const SeenBesideCoil& one : seen.beside) {
    const Eigen::Vector3d moved_mm =
        correction.shift_mm + correction.turn_rad.cross(one.p_world_mm - correction.centre_world_mm);
    squares[one.coil] += std::pow(one.off_mm - one.side_world.dot(moved_mm), 2);
    ++counts[one.coil];
  }
  for (std::size_t i = 0; i < coils; ++i) squares[i] = counts[i] > 0 ? std::sqrt(squares[i] / counts[i]) : 0;
  return squares;
}

}  // namespace

ImageRegistration register_by_images(const ConfiguredSequence& run,
                                     const ImageRegistrationSettings& settings) {
  require_images(run);
  ConfiguredSequence corrected = run;
  const RigidTransform& stated = run.sequence.room.T_world_em;
  ImageRegistration found;
  for (int round = 0; round < kMaxRounds; ++round) {
    const Seen seen = look(corrected);
    const auto correction = find_rigid_correction(seen.beside);
    if (!correction) refuse_unseen(seen);
    const double rms_before_mm = round == 0 ? correction->rms_before_mm : found.correction.rms_before_mm;
    found.correction = *correction;
    found.correction.rms_before_mm = rms_before_mm;
    found.images = seen.images.size();
    found.sightings = seen.beside.size();
    found.apart_rad = max_angle_rad(seen.directions);
    found.coil_rms_mm =
        coil_rms_mm(seen, *correction, run.sequence.room.instruments.front().coils.size() + 1);
    judge(found, settings.max_sigma_mm);
    corrected.sequence.room.T_world_em = motion_of(*correction) * corrected.sequence.room.T_world_em;
    if (correction->shift_mm.norm() < kSettled_mm && correction->turn_rad.norm() < kSettled_rad) break;
  }
  // Of all rounds together, about where the coils lie now.
  found.T_world_em = corrected.sequence.room.T_world_em;
  const RigidTransform motion = found.T_world_em * stated.inverse();
  const Eigen::AngleAxisd turn(motion.linear());
  found.correction.turn_rad = turn.angle() * turn.axis();
  found.correction.centre_world_mm += found.correction.shift_mm;
  found.correction.shift_mm =
      found.correction.centre_world_mm - motion.inverse() * found.correction.centre_world_mm;
  found.correction.covariance.diagonal().head<3>().array() += squared(settings.field_mm / kFieldLever_mm);
  found.correction.covariance.diagonal().tail<3>().array() += squared(settings.field_mm);
  judge(found, settings.max_sigma_mm);
  return found;
}

ConfigurationFragment fragment_of(const ImageRegistration& found) {
  const RigidCorrection& correction = found.correction;
  ConfigurationFragment fragment{
      formatted("tubectl calibrate registration, %zu images", found.images), date_of_today(), {}, {}};
  const RegistrationQuality quality{correction.covariance, correction.centre_world_mm};
  const RegistrationQuality::Sigma sigma = quality.sigma_at(correction.centre_world_mm);
  fragment.remarks.push_back(formatted(
      "moved by %.1f mm and %.2f degrees; known to %.1f mm (%.1f along the worst direction) and %.2f degrees",
      correction.shift_mm.norm(), correction.turn_rad.norm() / kDegree, sigma.shift_mm.norm(),
      correction.worst_shift_mm(), sigma.turn_rad.norm() / kDegree));
  fragment.remarks.push_back(
      formatted("across the images coils lie %.2f mm RMS off the tube, %.2f before; directions of view %.0f "
                "degrees apart",
                correction.rms_after_mm, correction.rms_before_mm, found.apart_rad / kDegree));
  fragment.remarks.push_back(
      formatted("each coil is off by %.1f mm an axis of its own: the field, arc lengths; what all share of "
                "that is in here",
                correction.local_mm));
  add_registration(found.T_world_em, quality, std::sqrt(3.0) * correction.rms_after_mm, fragment);
  return fragment;
}

}  // namespace tubed
