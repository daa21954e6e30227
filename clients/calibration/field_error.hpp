// How far the tracker's volume is off: one coil held at places whose distances are known.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

#include "clients/calibration/coil_recording.hpp"
#include "idl/geometry/rigid_transform.hpp"

namespace tubed {

/// A place of a board, and when the coil rested there.
struct KnownPlace {
  double from_s = 0;
  double until_s = 0;
  Eigen::Vector3d p_board_mm = Eigen::Vector3d::Zero();
};

/// Reads "from_s,until_s,x,y,z", a header and a row a place. Throws SequenceError at what cannot be used.
std::vector<KnownPlace> read_places(const std::filesystem::path& file);

/// What one place says.
struct PlaceError {
  Eigen::Vector3d p_em_mm = Eigen::Vector3d::Zero();  ///< as measured, mean
  Eigen::Vector3d off_mm = Eigen::Vector3d::Zero();   ///< from where the board has it, tracker's frame
  double distance_mm = 0;                             ///< of the place from the field generator's origin
};

/// Places at about the same distance.
struct DistanceBand {
  double from_mm = 0;
  double until_mm = 0;
  int places = 0;
  double rms_mm = 0;   ///< length of what they are off by
  double axis_mm = 0;  ///< the same an axis
};

struct FieldError {
  std::vector<PlaceError> places;
  std::vector<DistanceBand> bands;  ///< of 50 mm, those with a place in it
  RigidTransform T_em_board = RigidTransform::Identity();
  double rms_mm = 0;         ///< length, corrected for the six numbers that the board's pose takes away
  double axis_mm = 0;        ///< the same an axis
  double axis_sigma_mm = 0;  ///< of it
  double max_mm = 0;
};

/// Fits the board to what the coil measured, without a scale (Umeyama 1991, rigid), and says what stays. A
/// shift and turn of the whole volume is not in it: the registration takes that. Throws CalibrationError for
/// fewer than six places, places on one line, and a coil that moved or was missing at one of them.
FieldError find_field_error(const CoilRecording& recording, int sensor,
                            const std::vector<KnownPlace>& places);

}  // namespace tubed
