#include "clients/calibration/field_error.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "clients/calibration/coil_rest.hpp"
#include "drivers/csv/csv_reader.hpp"

namespace tubed {

namespace {

constexpr std::size_t kMinPlaces = 6;
constexpr int kMinMeasurements = 10;  // at a place
constexpr double kBand_mm = 50;

std::string words(const char* format, auto... values) {
  std::array<char, 256> text{};
  std::snprintf(text.data(), text.size(), format, values...);
  return text.data();
}

Eigen::Vector3d measured_at(const CoilRecording& recording, const CoilPlacement& coil,
                            const KnownPlace& place, std::size_t number) {
  std::vector<SequenceMeasurement> there;
  std::copy_if(recording.measurements.begin(), recording.measurements.end(), std::back_inserter(there),
               [&](const SequenceMeasurement& measurement) {
                 return measurement.t_s >= place.from_s && measurement.t_s <= place.until_s;
               });
  const auto rest = rest_of(there, coil, kMinMeasurements);
  if (!rest) {
    throw CalibrationError(recording.from +
                           words(": place %zu (%.1f to %.1f s): sensor %d gave fewer than %d "
                                 "measurements there; hold it longer",
                                 number, place.from_s, place.until_s, coil.sensor, kMinMeasurements));
  }
  if (rest->moved_mm > rest->moved_limit_mm) {
    throw CalibrationError(recording.from +
                           words(": place %zu (%.1f to %.1f s): sensor %d moved by %.1f mm; are the "
                                 "times those at which it rested?",
                                 number, place.from_s, place.until_s, coil.sensor, rest->moved_mm));
  }
  return rest->p_em_mm;
}

void sort_by_distance(FieldError& error) {
  for (const PlaceError& place : error.places) {
    const double from_mm = kBand_mm * std::floor(place.distance_mm / kBand_mm);
    auto band = std::find_if(error.bands.begin(), error.bands.end(),
                             [from_mm](const DistanceBand& known) { return known.from_mm == from_mm; });
    if (band == error.bands.end()) {
      band = error.bands.insert(error.bands.end(), {from_mm, from_mm + kBand_mm});
    }
    ++band->places;
    band->rms_mm += place.off_mm.squaredNorm();
  }
  for (DistanceBand& band : error.bands) {
    band.rms_mm = std::sqrt(band.rms_mm / band.places);
    band.axis_mm = band.rms_mm / std::sqrt(3.0);
  }
  std::sort(error.bands.begin(), error.bands.end(),
            [](const DistanceBand& a, const DistanceBand& b) { return a.from_mm < b.from_mm; });
}

}  // namespace

std::vector<KnownPlace> read_places(const std::filesystem::path& file) {
  CsvReader rows(file, {"from_s", "until_s", "x", "y", "z"});
  std::vector<KnownPlace> places;
  while (rows.next_row()) {
    KnownPlace place{rows.number(0), rows.number(1), {rows.number(2), rows.number(3), rows.number(4)}};
    if (place.until_s <= place.from_s) {
      rows.refuse(1, "expected a time after from_s");
    }
    places.push_back(place);
  }
  return places;
}

FieldError find_field_error(const CoilRecording& recording, int sensor,
                            const std::vector<KnownPlace>& places) {
  const auto& coils = recording.instrument.coils;
  const auto coil = std::find_if(coils.begin(), coils.end(), [sensor](const CoilPlacement& placement) {
    return placement.sensor == sensor;
  });
  if (coil == coils.end()) {
    throw CalibrationError(words("no coil has sensor %d", sensor));
  }
  if (places.size() < kMinPlaces) {
    throw CalibrationError(words("%zu places, %zu are needed: six numbers go into where the board lies",
                                 places.size(), kMinPlaces));
  }
  const auto count = static_cast<Eigen::Index>(places.size());
  Eigen::Matrix3Xd board(3, count);
  Eigen::Matrix3Xd measured(3, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const auto at = static_cast<std::size_t>(i);
    board.col(i) = places[at].p_board_mm;
    measured.col(i) = measured_at(recording, *coil, places[at], at + 1);
  }
  const Eigen::Matrix3Xd centred = board.colwise() - board.rowwise().mean();
  const Eigen::Vector3d spread = Eigen::JacobiSVD<Eigen::Matrix3Xd>(centred).singularValues();
  if (spread[1] < 1e-3 * spread[0]) {
    throw CalibrationError("all places lie on one line: choose some beside it");
  }
  FieldError error;
  error.T_em_board.matrix() = Eigen::umeyama(board, measured, false);
  double sum = 0;
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::Vector3d off = measured.col(i) - error.T_em_board * Eigen::Vector3d(board.col(i));
    error.places.push_back({measured.col(i), off, measured.col(i).norm()});
    sum += off.squaredNorm();
    error.max_mm = std::max(error.max_mm, off.norm());
  }
  const double freedom = 3.0 * static_cast<double>(count) - 6;
  error.axis_mm = std::sqrt(sum / freedom);
  error.rms_mm = std::sqrt(3.0) * error.axis_mm;
  error.axis_sigma_mm = error.axis_mm / std::sqrt(2 * freedom);
  sort_by_distance(error);
  return error;
}

}  // namespace tubed
