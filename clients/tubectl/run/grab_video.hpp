// The driver v4l2 in a process of its own: a card's pictures into shared memory.
#pragma once

#include <csignal>
#include <optional>
#include <string>

#include "clients/cpp/shm_image_writer.hpp"
#include "drivers/interface/driver_settings.hpp"
#include "drivers/interface/timestamps.hpp"

namespace tubed {

struct VideoGrabArguments {
  std::string device;
  std::string camera;
  std::string socket;
  std::optional<gid_t> group;
  DriverSettings settings;  ///< of v4l2_settings()
  MonotonicTime end = MonotonicTime::max();
};

/// Waits for the card as long as it takes, then writes what it delivers until `end`, or until
/// `is_asked_to_end` is not 0; says on standard error what is wrong meanwhile. How many images were written.
/// Throws ShmError for a socket that cannot be made, std::runtime_error for settings that do not go together.
std::uint64_t grab_video(const VideoGrabArguments& arguments,
                         const volatile std::sig_atomic_t& is_asked_to_end);

}  // namespace tubed
