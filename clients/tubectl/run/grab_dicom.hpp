// A fluoroscopic run of DICOM files into shared memory, in real time.
#pragma once

#include <csignal>
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
  MonotonicTime end = MonotonicTime::max();
};

/// Plays the run until its end, `end`, or `is_asked_to_end` is not 0. How many images were written. Throws
/// ShmError for a socket that cannot be made, std::runtime_error for a run that cannot be read, and in a
/// build without DCMTK.
std::uint64_t grab_dicom(const DicomGrabArguments& arguments,
                         const volatile std::sig_atomic_t& is_asked_to_end);

}  // namespace tubed
