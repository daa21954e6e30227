// A decoded recording into shared memory, in real time: what `tubectl grab` does with sequences and DICOM
// runs.
#pragma once

#include <csignal>
#include <cstdint>

#include "clients/cpp/shm_image_writer.hpp"
#include "drivers/interface/timestamps.hpp"
#include "drivers/replay/playhead.hpp"
#include "drivers/replay/replayed_folder.hpp"

namespace tubed {

/// Each image when it is due, copied once, until the recording's end, `end`, or `is_asked_to_end` is not 0;
/// marked as replayed. How many were written.
std::uint64_t write_view(const ReplayedView& view, Playhead playhead, ShmImageWriter& writer,
                         MonotonicTime end, const volatile std::sig_atomic_t& is_asked_to_end);

}  // namespace tubed
