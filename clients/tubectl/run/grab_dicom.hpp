// A fluoroscopic run of DICOM files into shared memory, in real time.
#pragma once

#include <csignal>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "clients/cpp/shm_image_writer.hpp"
#include "drivers/interface/timestamps.hpp"

namespace tubed {

struct DicomGrabArguments {
  std::string run;     ///< file or folder
  double rate_hz = 0;  ///< instead of what the run says; 0: as it says
  std::string camera;
  std::string socket;
  std::optional<gid_t> group;
  std::int64_t start_monotonic_ns = 0;  ///< of the first image; 0: in 300 ms
  bool loop = false;
  std::string config;  ///< configuration whose [camera.c_arm] the run's angles turn; empty: no poses are sent
  MonotonicTime end = MonotonicTime::max();
};

/// A run beside coils that were recorded while it was taken: a sequence folder of both.
struct DicomFolderArguments {
  std::string run;     ///< file or folder
  double rate_hz = 0;  ///< instead of what the run says; 0: as it says
  std::string camera;  ///< of the coils' recording, whose images are taken from the run; empty: its first
  std::string config;  ///< as above
  std::string coils;   ///< sequence folder with the coils and the room
  double at_s = 0;     ///< when the run's first image was exposed, in that folder's time
  std::string into;    ///< folder to write
};

/// Writes coils and room of the one with the images of the other, for `tubectl reconstruct`; images of that
/// folder are left out. How many were written. Throws std::runtime_error for what cannot be read or does not
/// go together: an image of another size than the camera's, a camera that is not there, a folder that is not
/// empty.
std::size_t write_dicom_folder(const DicomFolderArguments& arguments);

/// Plays the run until its end, `end`, or `is_asked_to_end` is not 0. How many images were written. Throws
/// ShmError for a socket that cannot be made, std::runtime_error for a run that cannot be read, and in a
/// build without DCMTK.
std::uint64_t grab_dicom(const DicomGrabArguments& arguments,
                         const volatile std::sig_atomic_t& is_asked_to_end);

}  // namespace tubed
