// Writes a "sequence folder, format 1" as it happens, or from memory.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>
#include <vector>

#include "drivers/replay/sequence_folder.hpp"
#include "drivers/replay/sequence_image.hpp"

namespace tubed {

/// Writes one folder row by row, in order of time. Numbers are written so that reading gives them back to the
/// last bit. Any failure throws SequenceError. Called from one thread; blocks on the disk.
class SequenceWriter {
 public:
  /// Creates the folder (and images/ in it), writes sequence.toml and the headers. Precondition: exactly one
  /// instrument, whose coil i is sensor i + 1.
  SequenceWriter(const std::filesystem::path& folder, const std::string& note, const RoomDescription& room);

  /// One exposure with its picture, stored as images/<camera><frame>.png.
  void add_exposure(std::uint32_t frame, double t_s, int camera, const GreyImage& image);
  /// The same with the bytes of encode_image().
  void add_encoded_exposure(std::uint32_t frame, double t_s, int camera, std::span<const std::uint8_t> png);
  /// One instant without fluoroscopy.
  void add_instant_without_fluoroscopy(std::uint32_t frame, double t_s, int camera);
  /// How the view stood at a frame already added.
  void add_geometry(std::uint32_t frame, const ViewGeometry& geometry);
  /// All coils of one measurement.
  void add_measurement(const SequenceMeasurement& measurement);
  /// The true centreline at a frame already added.
  void add_truth(const SequenceTruth& truth);
  /// Hands over to the system what was added: a process that is killed afterwards leaves a whole folder.
  void flush();
  /// Makes sure that everything reached the files; nothing may be added afterwards.
  void finish();

 private:
  void add_frame_row(std::uint32_t frame, double t_s, int camera, const std::string& file);

  std::filesystem::path folder_;
  std::vector<std::string> cameras_;
  std::ofstream frames_;
  std::ofstream measurements_;
  std::ofstream geometry_;  ///< opened with the first geometry: geometry.csv is optional
  std::ofstream truth_;     ///< opened with the first centreline: truth.csv is optional
};

/// Writes a whole sequence into `folder`; `images` holds one picture for each frame with fluoroscopy, in
/// their order. File names of the frames are given anew.
void write_sequence(const std::filesystem::path& folder, const Sequence& sequence,
                    const std::vector<GreyImage>& images);

}  // namespace tubed
