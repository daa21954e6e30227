// A fluoroscopic run as DICOM files have it: XA or RF, one multi-frame file or a folder of them.
#pragma once

#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "drivers/interface/image_source.hpp"

namespace tubed {

/// Why a run cannot be read, with the file and what to do. Names no field of a patient.
class DicomError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// One exposure, row by row, no padding; 16 bit in host order. Grey levels as stored, signed ones from their
/// lowest on: no window, no modality transformation; MONOCHROME1 inverted, so that the greatest level is
/// always white.
struct DicomFrame {
  double t_s = 0;          ///< since the first
  std::size_t file = 0;    ///< of DicomRun::files
  int number_in_file = 0;  ///< counts from 0
  std::vector<std::uint8_t> pixels;
};

struct DicomRun {
  int width = 0, height = 0;  ///< px
  PixelDepth depth = PixelDepth::kGrey8;
  int bits_stored = 8;             ///< of each pixel
  double period_s = 0;             ///< mean time from one exposure to the next
  std::vector<DicomFrame> frames;  ///< one at least
  std::vector<std::filesystem::path> files;
  /// What a person should know: what the detector's response is, that the C-arm turned.
  std::vector<std::string> remarks;
};

struct DicomRunOptions {
  double rate_hz = 0;  ///< exposures a second, instead of what the files say; 0: as they say
  std::uintmax_t memory_limit = std::uintmax_t{2048} << 20;  ///< bytes of the decoded run
};

/// Reads a file, or all files of a folder as one run: of one series, in the order of their InstanceNumber.
/// Pixels of 8 to 16 bits, uncompressed, RLE, JPEG (baseline, extended, lossless), or JPEG-LS. Times are
/// FrameTimeVector (0018,1065), FrameTime (0018,1063), CineRate (0018,0040) or RecommendedDisplayFrameRate
/// (0008,2144), the first that is there. Reads attributes of pixels, time and the positioner, none of the
/// patient. Throws DicomError.
DicomRun read_dicom_run(const std::filesystem::path& path, const DicomRunOptions& options = {});

}  // namespace tubed
