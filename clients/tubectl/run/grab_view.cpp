#include "clients/tubectl/run/grab_view.hpp"

#include <algorithm>
#include <array>
#include <chrono>

#include "drivers/interface/monotonic_clock.hpp"

namespace tubed {

namespace {

constexpr std::chrono::milliseconds kBeat{50};

template <std::size_t count>
void copy_to(float (&to)[count], const std::array<double, count>& from) {
  std::transform(from.begin(), from.end(), to, [](double value) { return static_cast<float>(value); });
}

void describe(const ViewGeometry& geometry, tubed_shm_image& described) {
  described.geometry = TUBED_SHM_GEOMETRY;
  described.fx = static_cast<float>(geometry.fx);
  described.fy = static_cast<float>(geometry.fy);
  described.cx = static_cast<float>(geometry.cx);
  described.cy = static_cast<float>(geometry.cy);
  copy_to(described.q_camera_world, geometry.q_camera_world);
  copy_to(described.t_camera_world_mm, geometry.t_camera_world_mm);
  copy_to(described.sigma_rotation_rad, geometry.sigma.rotation_rad);
  copy_to(described.sigma_translation_mm, geometry.sigma.translation_mm);
  described.pivot_depth_mm = static_cast<float>(geometry.sigma.pivot_depth_mm);
}

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
    describe(*row.geometry, described);
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
