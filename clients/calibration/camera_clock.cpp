#include "clients/calibration/camera_clock.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <set>
#include <utility>

#include "clients/calibration/formatted.hpp"
#include "clients/calibration/median.hpp"

namespace tubed {

namespace {

constexpr double kHalfWindow_s = 0.04;  // over which coils are averaged
constexpr double kBeside_s = 0.085;     // from there to the middle of those before and after
constexpr double kBesideHalfWindow_s = 0.04;
constexpr int kMaxRounds = 4;
constexpr double kSettled_s = 0.001;
constexpr double kMinPeak = 5;            // standard deviations
constexpr double kMaxInterval_s = 0.045;  // between measurements: two of them are in any mean

/// A coil of the recording, or the tube's end beyond the first of them.
struct TrackedPoint {
  std::shared_ptr<const CoilTrack> track;
  double beyond_mm = 0;  ///< along the coil's direction
  RigidTransform T_world_em;

  [[nodiscard]] std::optional<Eigen::Vector3d> at_world_mm(double t_s, double half_window_s) const {
    const auto place = track->at(t_s, half_window_s);
    if (!place) return std::nullopt;
    return T_world_em * (place->p_em_mm + beyond_mm * place->toward_tip_em);
  }
  /// From the measurements that at_world_mm() averages.
  [[nodiscard]] Eigen::Vector3d velocity_world_mm_s(double t_s) const {
    const auto place = track->at(t_s, kHalfWindow_s);
    return place ? T_world_em.linear() * place->velocity_mm_s : Eigen::Vector3d(0, 0, 0);
  }
  /// From those before and after them.
  [[nodiscard]] std::optional<Eigen::Vector3d> other_velocity_world_mm_s(double t_s) const {
    const auto before = at_world_mm(t_s - kBeside_s, kBesideHalfWindow_s);
    const auto after = at_world_mm(t_s + kBeside_s, kBesideHalfWindow_s);
    if (!before || !after) return std::nullopt;
    return (*after - *before) / (2 * kBeside_s);
  }
};

std::size_t images_in(const std::vector<TubeSighting>& sightings) {
  std::set<std::size_t> frames;
  for (const TubeSighting& seen : sightings) frames.insert(seen.frame);
  return frames.size();
}

std::size_t images_of(const Sequence& sequence, int camera) {
  return static_cast<std::size_t>(std::count_if(
      sequence.frames.begin(), sequence.frames.end(),
      [camera](const SequenceFrame& frame) { return frame.camera == camera && frame.fluoroscopy_on(); }));
}

[[noreturn]] void refuse(const CameraClock& clock, const std::string& why) {
  throw CalibrationError("camera " + clock.camera + ": " + why);
}

void refuse_unseen(const CameraClock& clock, std::size_t images) {
  refuse(
      clock,
      formatted(
          "the tube was seen where coils have it in %zu of %zu images, which is over too little time, or it "
          "hardly moved: ",
          clock.images, images) +
          "record half a minute with the tip in view. Move the tip to and fro by 3 cm, once a second. "
          "`tubectl "
          "check` says whether registration, pose and polarity fit");
}

/// Of all measurements; 0 with fewer than two.
double median_interval_s(const std::vector<SequenceMeasurement>& measurements) {
  std::vector<double> intervals_s;
  for (std::size_t i = 1; i < measurements.size(); ++i) {
    intervals_s.push_back(measurements[i].t_s - measurements[i - 1].t_s);
  }
  return intervals_s.empty() ? 0 : median_of(std::move(intervals_s));
}

/// With one measurement an image, half way between two of them is where their mean scatters least: the images
/// would fit best there, whatever the clock.
void refuse_slow_measurements(const CameraClock& clock,
                              const std::vector<SequenceMeasurement>& measurements) {
  const double interval_s = median_interval_s(measurements);
  if (interval_s <= kMaxInterval_s) return;
  refuse(clock, formatted("coils were measured every %.0f ms only, every %.0f ms are needed: ",
                          1e3 * interval_s, 1e3 * kMaxInterval_s) +
                    "the mean of two measurements scatters less than one, and would be taken for the better "
                    "offset. Record as fast as the tracker measures, 40 times a second");
}

void judge(const CameraClock& clock, double max_sigma_s) {
  const ClockOffset& found = clock.found;
  if (found.sigma_s > max_sigma_s) {
    refuse(clock, formatted("the offset would be known to %.0f ms only, %.0f ms are needed: ",
                            1e3 * found.sigma_s, 1e3 * max_sigma_s) +
                      formatted("the tube moved at %.0f px/s RMS through places that it came back to. ",
                                found.motion_px_s) +
                      "Move the tip to and fro by 3 cm, once a second, for half a minute; a catheter that is "
                      "only pushed on says little");
  }
  if (found.is_at_border) {
    refuse(clock,
           "images fit best at the border of what is looked for, 500 ms: are images and coils of one "
           "recording and one clock?");
  }
  if (found.peak_in_sigmas < kMinPeak) {
    refuse(clock, formatted("no offset explains the images clearly better than others (%.1f standard "
                            "deviations, %.0f are needed): ",
                            found.peak_in_sigmas, kMinPeak) +
                      "move the tip further, and not in one even rhythm");
  }
}

}  // namespace

std::vector<SeenNumber> numbers_of(const std::vector<TubeSighting>& sightings, const Sequence& sequence) {
  const std::vector<CoilPlacement>& coils = sequence.room.instruments.front().coils;
  std::vector<std::shared_ptr<const CoilTrack>> tracks;
  for (const CoilPlacement& coil : coils) {
    tracks.push_back(std::make_shared<const CoilTrack>(sequence.measurements, coil));
  }
  std::vector<SeenNumber> numbers;
  for (const TubeSighting& seen : sightings) {
    SeenNumber number;
    number.t_s = seen.t_s;
    number.channel = seen.is_end ? coils.size() : seen.coil;
    const TrackedPoint point{tracks[seen.coil], seen.is_end ? coils[seen.coil].offset_from_tip_mm : 0,
                             sequence.room.T_world_em};
    const Camera camera(camera_of(sequence, sequence.frames[seen.frame]));
    number.against = [seen, point, camera](double t_s) -> std::optional<SeenNumber::Against> {
      const auto p_world_mm = point.at_world_mm(t_s, kHalfWindow_s);
      const auto other_mm_s = point.other_velocity_world_mm_s(t_s);
      const auto projection = p_world_mm ? camera.project(*p_world_mm) : std::nullopt;
      if (!projection || !other_mm_s) return std::nullopt;
      const Eigen::RowVector3d along = seen.direction.transpose() * projection->J_image_world;
      return SeenNumber::Against{seen.direction.dot(seen.p_image_px - projection->p_image_px),
                                 projection->p_image_px, along.dot(point.velocity_world_mm_s(t_s)),
                                 along.dot(*other_mm_s)};
    };
    numbers.push_back(std::move(number));
  }
  return numbers;
}

CameraClock measure_clock(const ConfiguredSequence& run, int camera, double max_sigma_s) {
  const CameraCalibration& calibration = run.sequence.room.cameras[static_cast<std::size_t>(camera)];
  CameraClock clock;
  clock.camera = calibration.name;
  clock.configured_s = 1e-3 * calibration.time_offset_ms;
  const std::size_t images = images_of(run.sequence, camera);
  if (images == 0) refuse(clock, "the recording has no image of it");
  refuse_slow_measurements(clock, run.sequence.measurements);
  SightingSearch search;
  search.camera = camera;
  for (int round = 0; round < kMaxRounds; ++round) {
    const std::vector<TubeSighting> sightings = sight_tube(run, search);
    clock.images = images_in(sightings);
    const auto found = find_clock_offset(numbers_of(sightings, run.sequence), {});
    if (!found) refuse_unseen(clock, images);
    clock.found = *found;
    const double changed_s = std::abs(found->offset_s - search.offset_s);
    search.offset_s = found->offset_s;
    if (changed_s < std::max(kSettled_s, 0.2 * found->sigma_s)) break;
  }
  judge(clock, max_sigma_s);
  return clock;
}

ConfigurationFragment fragment_of(const std::vector<CameraClock>& clocks) {
  ConfigurationFragment fragment;
  std::size_t images = 0;
  for (const CameraClock& clock : clocks) images += clock.images;
  fragment.found_by = formatted("tubectl calibrate time, %zu images", images);
  fragment.date = date_of_today();
  const auto rounded = [](double s) { return std::round(1e4 * s) / 10; };
  for (const CameraClock& clock : clocks) {
    const std::string table = "camera[" + clock.camera + "].";
    fragment.remarks.push_back("camera " + clock.camera +
                               formatted(": stamps are %.1f ms %s, sigma %.1f ms; %zu images, %.2f px left",
                                         1e3 * std::abs(clock.offset_s()),
                                         clock.offset_s() < 0 ? "early" : "late", 1e3 * clock.found.sigma_s,
                                         clock.images, clock.found.rms_px));
    fragment.values.push_back({table + "time_offset_ms", rounded(clock.offset_s())});
    fragment.values.push_back({table + "time_offset_sigma_ms", std::max(0.1, rounded(clock.found.sigma_s))});
  }
  const bool all_early = std::all_of(clocks.begin(), clocks.end(), [](const CameraClock& clock) {
    return clock.offset_s() < -3 * clock.found.sigma_s;
  });
  if (all_early) {
    fragment.remarks.emplace_back(
        "images cannot be stamped before they are exposed: the tracker's measurements are stamped late; its "
        "latency_ms can be raised by that much instead");
  }
  return fragment;
}

}  // namespace tubed
