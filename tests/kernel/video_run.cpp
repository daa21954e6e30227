// The driver v4l2 at a video device of the kernel, in the guest of video_guest.py.
//   video_run copy FOLDER      shows each picture of that sequence folder in the upper left of a signal of
//   800 x 600, and writes what
//                              the driver delivers of it in its place
//   video_run endure SECONDS                     reads a signal of 1280 x 720 at 30 Hz and counts what is
//   lost
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "drivers/interface/monotonic_clock.hpp"
#include "drivers/interface/read_until.hpp"
#include "drivers/replay/sequence_image.hpp"
#include "drivers/v4l2/linux_video_device.hpp"
#include "drivers/v4l2/v4l2_image_source.hpp"
#include "tests/kernel/vivid_device.hpp"

namespace tubed {
namespace {

constexpr const char* kCard = "/dev/video0";
constexpr std::chrono::seconds kPatience{60};

/// The card with a signal of that size, and nothing of its own in the picture.
int set_signal(int width, int height, double rate_hz) {
  VividNode card(kCard);
  const int timings =
      card.number_of_timings(static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height), rate_hz);
  card.set("DV Timings Signal Mode", 0);
  card.set("OSD Text Mode", 2);
  card.set("Loop Video", 1);
  for (const char* change :
       {"Enable Capture Cropping", "Enable Capture Composing", "Enable Capture Scaler"}) {
    card.set(change, 0);
  }
  card.set("Percentage of Dropped Buffers", 0);
  card.set_timings(timings);
  card.set_format(V4L2_BUF_TYPE_VIDEO_CAPTURE, V4L2_PIX_FMT_GREY, static_cast<std::uint32_t>(width),
                  static_cast<std::uint32_t>(height));
  return timings;
}

std::unique_ptr<V4l2ImageSource> source_of(int width, int height, PictureArea crop) {
  V4l2Settings settings;
  settings.request.path = kCard;
  settings.request.format = PixelFormat::kGrey;
  settings.request.size = {width, height};
  settings.shape.crop = crop;
  const PictureSize size = delivered_size(settings.shape, {width, height});
  return std::make_unique<V4l2ImageSource>(
      CameraCalibration{.name = "A", .width = size.width, .height = size.height}, settings,
      std::make_unique<LinuxVideoDevice>());
}

/// Reads until a picture comes that is not `before`: radiographs differ by their noise.
void read_another(V4l2ImageSource& source, const std::vector<std::uint8_t>& before, ImageFrame& frame) {
  const MonotonicTime until = monotonic_now() + kPatience;
  while (monotonic_now() < until) {
    if (read_until(source, frame, monotonic_now() + std::chrono::seconds(1)) == ReadOutcome::kFrame &&
        !std::equal(before.begin(), before.end(), frame.pixels.begin())) {
      return;
    }
  }
  throw std::runtime_error("no other picture has come; it says: " +
                           std::string(source.condition().words.text()));
}

int copy(const char* folder) {
  constexpr int kSignalWidth = 800;
  constexpr int kSignalHeight = 600;
  const Sequence sequence = read_sequence(folder);
  const CameraCalibration& camera = sequence.room.cameras.at(0);
  const std::size_t pixels = static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
  const int timings = set_signal(kSignalWidth, kSignalHeight, 60);
  const auto source = source_of(kSignalWidth, kSignalHeight, {0, 0, camera.width, camera.height});
  ImageFrame frame;
  frame.reserve(camera.width, camera.height);
  VividConsole console(timings, kSignalWidth, kSignalHeight);
  std::vector<std::uint8_t> signal(std::size_t{kSignalWidth} * kSignalHeight);
  std::vector<std::uint8_t> newest(pixels);
  console.show(signal);
  for (const SequenceFrame& row : sequence.frames) {
    const GreyImage shown = read_image(sequence, row);
    for (int y = 0; y < camera.height; ++y) {
      std::copy_n(shown.pixels.begin() + static_cast<std::ptrdiff_t>(y) * camera.width, camera.width,
                  signal.begin() + static_cast<std::ptrdiff_t>(y) * kSignalWidth);
    }
    console.show(signal);
    read_another(*source, newest, frame);
    std::copy_n(frame.pixels.begin(), pixels, newest.begin());
    write_image(std::filesystem::path(folder) / row.file,
                {camera.width, camera.height, PixelDepth::kGrey8, newest});
  }
  std::printf("%zu pictures shown and read\n", sequence.frames.size());
  return 0;
}

int endure(double seconds) {
  constexpr int kWidth = 1280;
  constexpr int kHeight = 720;
  set_signal(kWidth, kHeight, 30);
  const auto source = source_of(kWidth, kHeight, {});
  ImageFrame frame;
  frame.reserve(kWidth, kHeight);
  const auto duration = std::chrono::nanoseconds(static_cast<std::int64_t>(seconds * 1e9));
  MonotonicTime until = monotonic_now() + kPatience;
  MonotonicTime first{};
  std::uint32_t first_number = 0;
  while (monotonic_now() < until) {
    if (read_until(*source, frame, monotonic_now() + std::chrono::milliseconds(100)) == ReadOutcome::kFrame &&
        first == MonotonicTime{}) {
      first = monotonic_now();
      first_number = frame.frame_number;
      until = first + duration;
    }
  }
  const V4l2ImageSource::Counts& counts = source->counts();
  const double rate_hz = static_cast<double>(counts.pictures - 1) / (seconds_between(first, frame.received));
  std::printf(
      "%llu pictures in %.0f s, %.2f a second (the card: %.2f); numbers %u to %u; lost %llu, overtaken %llu, "
      "refused %llu, "
      "starts %llu\n",
      static_cast<unsigned long long>(counts.pictures), seconds_between(first, frame.received), rate_hz,
      source->stream().rate_hz(), first_number, frame.frame_number,
      static_cast<unsigned long long>(counts.lost), static_cast<unsigned long long>(counts.overtaken),
      static_cast<unsigned long long>(counts.refused), static_cast<unsigned long long>(counts.starts));
  const bool is_whole = counts.lost == 0 && counts.overtaken == 0 && counts.refused == 0 &&
                        counts.starts == 1 && frame.frame_number - first_number + 1 == counts.pictures &&
                        rate_hz > 29.5;
  if (!is_whole) std::printf("it says: %s\n", std::string(source->condition().words.text()).c_str());
  return is_whole ? 0 : 1;
}

}  // namespace
}  // namespace tubed

int main(int argc, char** argv) {
  try {
    const std::string what = argc > 1 ? argv[1] : "";
    if (what == "copy" && argc == 3) return tubed::copy(argv[2]);
    if (what == "endure" && argc == 3) return tubed::endure(std::atof(argv[2]));
    std::fprintf(stderr, "video_run copy FOLDER | endure SECONDS\n");
  } catch (const std::exception& error) {
    std::printf("%s\n", error.what());
  }
  return 1;
}
