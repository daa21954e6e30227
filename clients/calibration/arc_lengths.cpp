#include "clients/calibration/arc_lengths.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "clients/calibration/coil_recording.hpp"
#include "clients/calibration/formatted.hpp"
#include "clients/calibration/median.hpp"
#include "clients/calibration/tube_sightings.hpp"
#include "daemon/estimator/agreement/room_errors.hpp"
#include "idl/geometry/camera.hpp"
#include "idl/geometry/degree.hpp"
#include "idl/geometry/squared.hpp"

namespace tubed {

namespace {

constexpr double kEvery_s = 0.1;
constexpr double kHalfWindow_s = 0.05;         // over which coils are averaged
constexpr double kMaxBend_rad = 60 * kDegree;  // beyond, a cubic curve is no longer the tube
constexpr double kOtherPlace_mm = 40;          // by which a coil goes until its error is another one
constexpr std::size_t kMinMeasurements = 50;   // five seconds
constexpr double kFewPlaces = 3;
constexpr double kUnknown_mm = 1.5;   // standard deviation of one place where there are too few to say
constexpr double kMinAlong = 0.5;     // share of a mm along the tube that shows in the image
constexpr std::size_t kMinEnds = 20;  // images

/// Values in the order of time, each with where it was measured.
struct Measured {
  double value_mm;
  Eigen::Vector3d p_mm;
  double t_s;
};

struct Summary {
  double median_mm = 0;
  double sigma_mm = 0;    ///< of the median, from how places differ
  double scatter_mm = 0;  ///< of one measurement
};

double deviation_of(const std::vector<double>& values, double about) {
  double sum = 0;
  for (const double value : values) sum += squared(value - about);
  return std::sqrt(sum / std::max(1.0, static_cast<double>(values.size()) - 1));
}

// A coil's error lasts as long as it is nearly where it was: a place counts once.
Summary summary_of(const std::vector<Measured>& measured) {
  std::vector<double> values;
  std::vector<double> of_places;
  std::vector<double> here;
  Eigen::Vector3d place_mm = measured.front().p_mm;
  const auto close = [&] {
    if (!here.empty()) of_places.push_back(median_of(here));
    here.clear();
  };
  for (const Measured& one : measured) {
    if ((one.p_mm - place_mm).norm() > kOtherPlace_mm) {
      close();
      place_mm = one.p_mm;
    }
    here.push_back(one.value_mm);
    values.push_back(one.value_mm);
  }
  close();
  Summary summary;
  summary.median_mm = median_of(values);
  summary.scatter_mm = deviation_of(values, summary.median_mm);
  const auto places = static_cast<double>(of_places.size());
  const double place_sigma_mm =
      places >= kFewPlaces ? deviation_of(of_places, summary.median_mm) : kUnknown_mm;
  // Of a median pi / 2 the variance of a mean.
  summary.sigma_mm = std::sqrt(std::numbers::pi / 2) * place_sigma_mm / std::sqrt(places);
  return summary;
}

std::vector<CoilTrack> tracks_of(const Sequence& sequence) {
  std::vector<CoilTrack> tracks;
  for (const CoilPlacement& coil : sequence.room.instruments.front().coils) {
    tracks.emplace_back(sequence.measurements, coil);
  }
  return tracks;
}

/// What was found where it is beyond chance, else what is stated.
void take(const ArcLengthSettings& settings, MeasuredPiece& piece) {
  piece.is_changed = settings.take_all || std::abs(piece.change_mm()) > kBeyondChance * piece.sigma_mm;
  piece.used_mm = piece.is_changed ? piece.found_mm : piece.stated_mm;
}

/// Two neighbours of which one is too long by what the other is too short: a coil that is described wrong.
void take_as_lone_coil(MeasuredPiece& near_tip, MeasuredPiece& next) {
  const double sum_mm = near_tip.change_mm() + next.change_mm();
  if (!near_tip.is_changed || !next.is_changed || near_tip.is_lone_coil ||
      near_tip.change_mm() * next.change_mm() > 0 ||
      std::abs(sum_mm) > kBeyondChance * std::hypot(near_tip.sigma_mm, next.sigma_mm)) {
    return;
  }
  const double moved_mm = (near_tip.change_mm() - next.change_mm()) / 2;
  near_tip.used_mm = near_tip.stated_mm + moved_mm;
  next.used_mm = next.stated_mm - moved_mm;
  near_tip.is_lone_coil = next.is_lone_coil = true;
}

MeasuredPiece piece_between(const CoilTrack& near_tip, const CoilTrack& next, double stated_mm,
                            const ArcLengthSettings& settings) {
  std::vector<Measured> measured;
  const double until_s = std::min(near_tip.ends_s(), next.ends_s());
  for (double t_s = std::max(near_tip.begins_s(), next.begins_s()); t_s <= until_s; t_s += kEvery_s) {
    const auto a = near_tip.at(t_s, kHalfWindow_s);
    const auto b = next.at(t_s, kHalfWindow_s);
    if (!a || !b || a->toward_tip_em.dot(b->toward_tip_em) < std::cos(kMaxBend_rad)) continue;
    measured.push_back(
        {cubic_length_mm(a->p_em_mm, -a->toward_tip_em, b->p_em_mm, -b->toward_tip_em), a->p_em_mm, t_s});
  }
  MeasuredPiece piece;
  piece.stated_mm = stated_mm;
  piece.measurements = static_cast<int>(measured.size());
  if (measured.size() < kMinMeasurements) return piece;
  const Summary summary = summary_of(measured);
  piece.found_mm = summary.median_mm;
  piece.sigma_mm = std::hypot(summary.sigma_mm, settings.field_mm);
  piece.scatter_mm = summary.scatter_mm;
  take(settings, piece);
  return piece;
}

/// By how much the images have the tube's end further out than the first coil and its stated arc length do.
std::vector<Measured> ends_of(const ConfiguredSequence& run, const CoilTrack& first) {
  const Sequence& sequence = run.sequence;
  const double beyond_mm = sequence.room.instruments.front().coils.front().offset_from_tip_mm;
  std::vector<Measured> ends;
  for (int camera = 0; camera < static_cast<int>(sequence.room.cameras.size()); ++camera) {
    for (const TubeSighting& sighting : sight_tube(run, {.camera = camera})) {
      const auto coil = sighting.is_end ? first.at(sighting.t_s, kHalfWindow_s) : std::nullopt;
      if (!coil) continue;
      const Eigen::Vector3d out_world = sequence.room.T_world_em.linear() * coil->toward_tip_em;
      const Eigen::Vector3d p_world_mm = sequence.room.T_world_em * coil->p_em_mm + beyond_mm * out_world;
      const Camera seen_by(camera_of(sequence, sequence.frames[sighting.frame]));
      const auto projection = seen_by.project(p_world_mm);
      if (!projection) continue;
      const Eigen::Vector3d px_per_mm = projection->J_image_world.transpose() * sighting.direction;
      const double along_px_per_mm = px_per_mm.dot(out_world);
      if (along_px_per_mm < kMinAlong * px_per_mm.norm()) continue;
      const double off_px = sighting.direction.dot(sighting.p_image_px - projection->p_image_px);
      ends.push_back({off_px / along_px_per_mm, p_world_mm, sighting.t_s});
    }
  }
  // Of several cameras in turn: a place is one, whoever sees it.
  std::ranges::sort(ends, {}, &Measured::t_s);
  return ends;
}

MeasuredPiece end_piece(const ConfiguredSequence& run, const CoilTrack& first,
                        const ArcLengthSettings& settings) {
  const InstrumentDescription& instrument = run.sequence.room.instruments.front();
  MeasuredPiece piece;
  piece.stated_mm = piece.used_mm = instrument.coils.front().offset_from_tip_mm;
  const std::vector<Measured> ends = ends_of(run, first);
  if (ends.size() < kMinEnds) return piece;
  const Summary summary = summary_of(ends);
  piece.measurements = static_cast<int>(ends.size());
  piece.found_mm = piece.stated_mm + summary.median_mm;
  piece.sigma_mm = std::hypot(summary.sigma_mm, room_errors(run.sequence.room, instrument).shift_mm);
  piece.scatter_mm = summary.scatter_mm;
  take(settings, piece);
  return piece;
}

/// Arc lengths of the coils, piece by piece from the tip on.
std::vector<MeasuredCoil> coils_of(const InstrumentDescription& instrument, const ArcLengths& found) {
  std::vector<MeasuredCoil> coils;
  double found_mm = found.end.used_mm;
  double sigma_mm = found.end.sigma_mm;
  for (std::size_t k = 0; k < instrument.coils.size(); ++k) {
    const CoilPlacement& placement = instrument.coils[k];
    const MeasuredPiece& piece = k == 0 ? found.end : found.pieces[k - 1];
    if (k > 0) {
      found_mm += piece.used_mm;
      sigma_mm = std::hypot(sigma_mm, piece.sigma_mm);
    }
    coils.push_back({placement.sensor, placement.offset_from_tip_mm, found_mm, sigma_mm,
                     k > 0 || found.has_end(), piece.measurements});
  }
  return coils;
}

void require_enough(const ArcLengths& found) {
  for (std::size_t k = 0; k < found.pieces.size(); ++k) {
    if (static_cast<std::size_t>(found.pieces[k].measurements) >= kMinMeasurements) continue;
    throw CalibrationError(formatted(
        "between coil %zu and coil %zu the catheter was nearly straight in %d measurements of a tenth of a "
        "second, %zu are needed: record it longer, moving where both coils are in the field",
        k + 1, k + 2, found.pieces[k].measurements, kMinMeasurements));
  }
}

}  // namespace

double cubic_length_mm(const Eigen::Vector3d& a_mm, const Eigen::Vector3d& direction_a,
                       const Eigen::Vector3d& b_mm, const Eigen::Vector3d& direction_b) {
  constexpr int kRounds = 6;
  constexpr int kSteps = 16;  // Simpson's rule
  constexpr double kStraight_rad = 1e-6;
  // So much longer than the curve the derivatives have to be for a circle's arc.
  const double bend_rad = std::acos(std::clamp(direction_a.dot(direction_b), -1.0, 1.0));
  const double factor = bend_rad > kStraight_rad ? 4 * std::tan(bend_rad / 4) / bend_rad : 1;
  double length_mm = (b_mm - a_mm).norm();
  for (int round = 0; round < kRounds; ++round) {
    const Eigen::Vector3d from = factor * length_mm * direction_a;
    const Eigen::Vector3d to = factor * length_mm * direction_b;
    const auto speed = [&](double u) {
      return ((6 * u * u - 6 * u) * (a_mm - b_mm) + (3 * u * u - 4 * u + 1) * from + (3 * u * u - 2 * u) * to)
          .norm();
    };
    double sum = speed(0) + speed(1);
    for (int i = 1; i < kSteps; ++i) sum += (i % 2 == 1 ? 4 : 2) * speed(static_cast<double>(i) / kSteps);
    length_mm = sum / (3 * kSteps);
  }
  return length_mm;
}

ArcLengths measure_arc_lengths(const ConfiguredSequence& run, const ArcLengthSettings& settings) {
  const InstrumentDescription& instrument = run.sequence.room.instruments.front();
  if (instrument.coils.size() < 2) {
    throw CalibrationError(instrument.id + " has one coil: there is no distance to be measured");
  }
  const std::vector<CoilTrack> tracks = tracks_of(run.sequence);
  ArcLengths found;
  for (std::size_t k = 0; k + 1 < tracks.size(); ++k) {
    found.pieces.push_back(piece_between(
        tracks[k], tracks[k + 1],
        instrument.coils[k + 1].offset_from_tip_mm - instrument.coils[k].offset_from_tip_mm, settings));
  }
  require_enough(found);
  found.end = end_piece(run, tracks.front(), settings);
  if (!settings.take_all) {
    MeasuredPiece* near_tip = &found.end;
    for (MeasuredPiece& piece : found.pieces) {
      take_as_lone_coil(*near_tip, piece);
      near_tip = &piece;
    }
  }
  found.coils = coils_of(instrument, found);
  return found;
}

}  // namespace tubed
