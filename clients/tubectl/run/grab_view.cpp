#include "clients/tubectl/run/grab_view.hpp"

#include <algorithm>
#include <chrono>

#include "drivers/interface/monotonic_clock.hpp"
#include "drivers/interface/view_in_shm.hpp"

namespace tubed {

namespace {

constexpr std::chrono::milliseconds kBeat{50};

/// As the recording has them: the exposure is when the sequence says, and no setting makes a device of it.
tubed_shm_image image_of(const SequenceFrame& row, const GreyImage& image, const Playhead& playhead,
                         std::uint32_t numbers_a_lap) {
  tubed_shm_image described{};
  described.exposure_ns = to_ns(playhead.due());
  described.frame_number = row.frame + playhead.lap() * numbers_a_lap;
  described.origin = TUBED_SHM_REPLAYED;
  described.fluoroscopy_on = row.fluoroscopy_on() ? 1 : 0;
  described.depth_bits = image.depth == PixelDepth::kGrey8 ? 8 : 16;
  described.width = static_cast<std::uint32_t>(image.width);
  described.height = static_cast<std::uint32_t>(image.height);
  if (row.geometry) {
    write_geometry(*row.geometry, described);
  }
  return described;
}

}  // namespace

std::uint64_t write_view(const ReplayedView& view, Playhead playhead, ShmImageWriter& writer,
                         MonotonicTime end, const volatile std::sig_atomic_t& is_asked_to_end) {
  std::uint32_t numbers_a_lap = 1;
  for (const SequenceFrame& row : view.rows) {
    numbers_a_lap = std::max(numbers_a_lap, row.frame + 1);
  }
  std::uint64_t written = 0;
  while (!playhead.ended() && is_asked_to_end == 0 && monotonic_now() < end) {
    if (!sleep_until(playhead.due(), monotonic_now() + kBeat)) {
      writer.beat();
      continue;
    }
    playhead.skip_overtaken(monotonic_now());
    const GreyImage& image = view.images[playhead.row()];
    const tubed_shm_image described = image_of(view.rows[playhead.row()], image, playhead, numbers_a_lap);
    written += writer.put(described, image.pixels.data()) ? 1 : 0;
    playhead.advance();
  }
  return written;
}

}  // namespace tubed
