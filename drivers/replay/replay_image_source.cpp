#include "drivers/replay/replay_image_source.hpp"

#include <algorithm>
#include <exception>

#include "drivers/interface/monotonic_clock.hpp"
#include "drivers/replay/playhead_over.hpp"

namespace tubed {

namespace {

std::string size_words(const CameraCalibration& camera) {
  return std::to_string(camera.width) + " x " + std::to_string(camera.height) + " pixels";
}

}  // namespace

ReplayImageSource::ReplayImageSource(const CameraCalibration& camera, const DriverSettings& settings)
    : camera_(camera), settings_(settings), lease_(settings.get<std::string>("folder"), camera.name) {}

OpenResult ReplayImageSource::open() {
  if (view_ == nullptr) {
    try {
      find_view(lease_.open(settings_.get<std::int64_t>("memory_limit_mb")));
    } catch (const std::exception& error) {
      return {false, error.what()};
    }
  }
  is_open_ = true;
  return {true, {}};
}

void ReplayImageSource::find_view(const ReplayedFolder& folder) {
  const auto& cameras = folder.sequence.room.cameras;
  const auto found = std::find_if(cameras.begin(), cameras.end(), [&](const CameraCalibration& camera) {
    return camera.name == camera_.name;
  });
  const SequencePosition description{folder.sequence.folder / "sequence.toml"};
  if (found == cameras.end()) {
    throw SequenceError(description, "has no camera " + in_quotes(camera_.name) +
                                         "; name the configured camera after " +
                                         in_quotes(cameras.front().name) + " or another of the sequence");
  }
  if (found->width != camera_.width || found->height != camera_.height) {
    throw SequenceError(description, "camera " + in_quotes(camera_.name) + " is " + size_words(*found) +
                                         ", the configured one " + size_words(camera_) +
                                         "; give both the same size");
  }
  const ReplayedView& view = folder.views[static_cast<std::size_t>(found - cameras.begin())];
  playhead_ = playhead_over(view.rows, folder, settings_);
  std::uint32_t last_number = 0;
  for (const SequenceFrame& row : folder.sequence.frames) {
    last_number = std::max(last_number, row.frame);
  }
  numbers_a_lap_ = last_number + 1;
  view_ = &view;
}

void ReplayImageSource::wait(MonotonicTime deadline) noexcept {
  if (is_open_ && !playhead_.ended()) {
    sleep_until(playhead_.due(), deadline);
  }
}

ReadOutcome ReplayImageSource::read(ImageFrame& frame) noexcept {
  if (!is_open_) {
    return ReadOutcome::kLost;
  }
  if (playhead_.ended()) {
    return ReadOutcome::kEnded;
  }
  const MonotonicTime now = monotonic_now();
  if (now < playhead_.due()) {
    return ReadOutcome::kNothing;
  }
  playhead_.skip_overtaken(now);
  const SequenceFrame& row = view_->rows[playhead_.row()];
  const GreyImage& image = view_->images[playhead_.row()];
  if (frame.pixels.size() < image.pixels.size()) {
    playhead_.advance();
    return ReadOutcome::kRefused;
  }
  std::copy(image.pixels.begin(), image.pixels.end(), frame.pixels.begin());
  frame.exposure = playhead_.due();
  frame.frame_number = row.frame + playhead_.lap() * numbers_a_lap_;
  frame.origin = Origin::kReplayed;
  frame.fluoroscopy_on = row.fluoroscopy_on();
  frame.geometry = row.geometry;
  frame.width = camera_.width;
  frame.height = camera_.height;
  frame.depth = image.depth;
  frame.received = monotonic_now();
  playhead_.advance();
  return ReadOutcome::kFrame;
}

}  // namespace tubed
