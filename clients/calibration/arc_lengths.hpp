// Where coils sit along the catheter, from a recording of it in use: distances by the coils, the end by
// images.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "clients/calibration/configuration_fragment.hpp"
#include "clients/evaluation/configured_sequence.hpp"

namespace tubed {

/// More standard deviations than chance takes a measured length away from what is stated of it.
inline constexpr double kBeyondChance = 2;

struct MeasuredCoil {
  int sensor = 1;
  double stated_mm = 0;
  double found_mm = 0;  ///< arc length from the tip, the sum of the pieces in use
  double sigma_mm = 0;  ///< of it; without a seen end of the distance from the first coil
  bool was_found = false;
  int measurements = 0;
  [[nodiscard]] double change_mm() const { return found_mm - stated_mm; }
};

/// Of the piece of tube between two neighbouring coils.
struct MeasuredPiece {
  double stated_mm = 0;
  double found_mm = 0;
  double sigma_mm = 0;
  double scatter_mm = 0;  ///< standard deviation of a measurement
  int measurements = 0;
  double used_mm = 0;         ///< what is taken
  bool is_changed = false;    ///< that is not what is stated
  bool is_lone_coil = false;  ///< a coil at one of its ends is elsewhere, and its neighbours are not
  [[nodiscard]] double change_mm() const { return found_mm - stated_mm; }
};

struct ArcLengths {
  std::vector<MeasuredCoil> coils;    ///< in the instrument's order
  std::vector<MeasuredPiece> pieces;  ///< between them
  /// From the first coil to the tip, measured by images; no measurements where they do not show the tube's
  /// end: the first coil stays as stated.
  MeasuredPiece end;
  [[nodiscard]] bool has_end() const { return end.measurements > 0; }
};

struct ArcLengthSettings {
  /// What the tracker's field may change the distance of neighbouring coils by, standard deviation, mm: it is
  /// not averaged away.
  double field_mm = 0.7;
  /// Take what was found of every piece, also where it differs from what is stated by no more than chance.
  bool take_all = false;
};

/// The piece between two coils is a cubic curve with the coils' places and directions, of that curve's own
/// length, wherever their directions are less than 60 degrees apart; the median over the recording. The first
/// coil's arc length is what the images have the tube's end beyond it, along the tube; what is stated of the
/// registration is part of its sigma. A piece whose length differs from the stated one by no more than
/// kBeyondChance sigma keeps the stated one: a bent field adds up along the tube otherwise. Of two neighbours
/// that differ by the same in opposite directions the coil between them is elsewhere, and none behind it.
/// Throws CalibrationError for fewer than two coils or less than five seconds in which a piece was measured.
ArcLengths measure_arc_lengths(const ConfiguredSequence& run, const ArcLengthSettings& settings);

/// The length of the cubic curve from `a` to `b`, mm, with unit directions there: its derivatives at the ends
/// are as long as those of a circle's arc of that length and bend.
double cubic_length_mm(const Eigen::Vector3d& a_mm, const Eigen::Vector3d& direction_a,
                       const Eigen::Vector3d& b_mm, const Eigen::Vector3d& direction_b);

/// Values of the coils that were found, with sigma where the end was seen; before and after as remarks.
ConfigurationFragment fragment_of(const ArcLengths& found, const std::string& instrument_id);

/// One page, SVG.
std::string page_of(const ArcLengths& found, const ConfigurationFragment& fragment);

}  // namespace tubed
