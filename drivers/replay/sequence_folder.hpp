// A recorded or simulated run as plain files: "sequence folder, format 1", README.md. Lengths mm, times s on
// one clock of the sequence, world and em frames as in the room's description.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/csv/sequence_error.hpp"
#include "drivers/interface/em_source.hpp"
#include "drivers/interface/room.hpp"

namespace tubed {

/// One row of frames.csv: an exposure, or an instant at which fluoroscopy is off and a shape is still due.
struct SequenceFrame {
  std::uint32_t frame = 0;     ///< unique in the sequence
  double t_s = 0;              ///< middle of the exposure
  int camera = 0;              ///< index in room.cameras
  std::filesystem::path file;  ///< grey PNG relative to the folder; empty: fluoroscopy is off
  /// Its row of geometry.csv; nothing: as the room has its camera.
  std::optional<ViewGeometry> geometry{};
  SequencePosition position;  ///< of the row's `file`, for messages

  [[nodiscard]] bool fluoroscopy_on() const { return !file.empty(); }
};

/// The rows of em.csv that belong to one measurement. Coil i is the tracker's sensor i + 1; a sensor without
/// a row is missing. The pose of a coil is NaN unless its row gave one.
struct SequenceMeasurement {
  double t_s = 0;              ///< time of measurement
  std::uint32_t em_frame = 0;  ///< the tracker's own frame number
  int coil_count = 0;          ///< highest sensor number of the measurement
  std::array<CoilSample, kMaxTrackerCoils> coils;
};

/// The true centreline at one frame.
struct SequenceTruth {
  std::uint32_t frame = 0;
  Eigen::Matrix3Xd points_world_mm;  ///< 3 x n, tip first, at arc length 0, 1, 2, ... mm
};

/// A whole folder, without the pixels.
struct Sequence {
  std::filesystem::path folder;
  std::string note;
  RoomDescription room;                           ///< exactly one instrument; coil i of it is sensor i + 1
  std::vector<SequenceFrame> frames;              ///< ordered by time
  std::vector<SequenceMeasurement> measurements;  ///< ordered by time
  std::vector<SequenceTruth> truth;               ///< empty when the folder has no truth.csv
};

/// Reads a folder. Throws SequenceError with file:line:column and what to do for anything the format forbids.
Sequence read_sequence(const std::filesystem::path& folder);

/// The camera of a frame as it stood then.
CameraCalibration camera_of(const Sequence& sequence, const SequenceFrame& frame);

/// The truth at that frame, nullptr when there is none.
const SequenceTruth* find_truth(const Sequence& sequence, std::uint32_t frame);

/// The word for a coil's status in em.csv.
std::string_view status_word(CoilStatus status);

/// Reads sequence.toml into note and room of `sequence`. Part of read_sequence.
void read_sequence_description(const std::filesystem::path& file, Sequence& sequence);

}  // namespace tubed
