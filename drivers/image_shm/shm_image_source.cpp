#include "drivers/image_shm/shm_image_source.hpp"

#include <algorithm>
#include <span>

#include "drivers/interface/monotonic_clock.hpp"
#include "drivers/interface/view_in_shm.hpp"
#include "idl/printable_text.hpp"

namespace tubed {

namespace {

constexpr int kTimeoutMs = 300;  // a writer shows up at its door every 100 ms
constexpr std::int64_t kMaxAheadNs = 5'000'000;
constexpr std::int64_t kLookNs = 2'000'000;  // 500 a second, many times the rate of any fluoroscope
constexpr std::int64_t kBurst = 32;
constexpr std::chrono::seconds kTold{1};  // how long the words stay after the writer was paced last
constexpr std::uint32_t kMaxSlots = 16;   // of the writer's ring; the library's has 4
constexpr std::uint32_t kMaxSide = 1U << 15U;
constexpr std::size_t kMaxNameBytes = 63;

std::optional<Origin> origin_of(std::uint32_t word) {
  switch (word) {
    case TUBED_SHM_DEVICE:
      return Origin::kDevice;
    case TUBED_SHM_SIMULATED:
      return Origin::kSimulated;
    case TUBED_SHM_REPLAYED:
      return Origin::kReplayed;
    default:
      return {};  // zero is forgotten memory, not a device
  }
}

std::size_t pixel_bytes(const tubed_shm_image& image) {
  return image.fluoroscopy_on == 0
             ? 0
             : static_cast<std::size_t>(image.width) * image.height * (image.depth_bits / 8);
}

std::uint64_t max_segment_bytes(const CameraCalibration& camera) {
  const auto pixels = static_cast<std::uint64_t>(camera.width) * static_cast<std::uint64_t>(camera.height);
  return ShmGeometry{kMaxSlots, sizeof(tubed_shm_image) + 2 * pixels}.segment_bytes();
}

}  // namespace

ShmImageSource::ShmImageSource(const CameraCalibration& camera, std::string socket,
                               std::vector<uid_t> trusted)
    : camera_(camera),
      socket_(std::move(socket)),
      trusted_(std::move(trusted)),
      looks_(kLookNs, kBurst),
      rings_(kLookNs, kBurst) {}

OpenResult ShmImageSource::open() {
  try {
    reader_.emplace(ShmReaderSettings{.path = socket_,
                                      .content = TUBED_SHM_IMAGES,
                                      .content_version = TUBED_SHM_IMAGES_VERSION,
                                      .oldest_content_version = TUBED_SHM_OLDEST_IMAGES_VERSION,
                                      .timeout_ms = kTimeoutMs,
                                      .trusted = trusted_,
                                      .max_segment_bytes = max_segment_bytes(camera_)});
  } catch (const ShmError& error) {
    return {false, error.what()};
  }
  if (reader_->identity().name != camera_.name) {
    const std::string other = printable_text(reader_->identity().name, kMaxNameBytes);
    reader_.reset();
    return {false,
            "the writer at '" + socket_ + "' grabs camera '" + other + "', expected '" + camera_.name + "'"};
  }
  return {true, {}};
}

ReadOutcome ShmImageSource::read(ImageFrame& frame) noexcept {
  if (!reader_) {
    return ReadOutcome::kLost;
  }
  const MonotonicTime now = monotonic_now();
  switch (reader_->news(to_ns(now))) {
    case ShmNews::kSample:
      break;
    case ShmNews::kSilent:
    case ShmNews::kEnded:
      return ReadOutcome::kLost;
    case ShmNews::kNone:
      return ReadOutcome::kNothing;
  }
  may_not_look_ = !looks_.take(to_ns(now));
  if (may_not_look_) {
    return ReadOutcome::kNothing;
  }
  const ReadOutcome outcome = take(frame, now);
  if (outcome == ReadOutcome::kFrame) {
    delivers_ = has_delivered_ = true;
  }
  return outcome;
}

// Whatever the writer does with what it shares, the sleep can end early: its bell rung, its numbers changed.
void ShmImageSource::wait(MonotonicTime deadline) noexcept {
  if (!reader_) {
    return;
  }
  if (may_not_look_) {
    pause(monotonic_now(), deadline);
    return;
  }
  reader_->sleep_until(to_ns(deadline));
  const MonotonicTime now = monotonic_now();
  if (now < deadline && reader_->news(to_ns(now)) == ShmNews::kNone && !rings_.take(to_ns(now))) {
    pause(now, deadline);
  }
}

void ShmImageSource::pause(MonotonicTime now, MonotonicTime deadline) noexcept {
  paced_ = now;
  sleep_until(now + std::chrono::nanoseconds(kLookNs), deadline);
}

void ShmImageSource::close() noexcept {
  reader_.reset();
  delivers_ = false;
  refusal_ = nullptr;
}

SourceCondition ShmImageSource::condition() noexcept {
  SourceCondition condition;
  if (delivers_) {
    condition.state = DeviceState::kRunning;
  } else {
    condition.state = has_delivered_ ? DeviceState::kReconnecting : DeviceState::kStarting;
    condition.words << "the grabber's program is there, no image yet";
  }
  if (refusal_ != nullptr) {
    condition.words.clear();
    condition.words << "image refused: " << refusal_;
  }
  if (paced_ != MonotonicTime{} && monotonic_now() - paced_ < kTold) {
    condition.words.clear();
    condition.words << "the grabber's program rings without an image, or has more than 500 images a second: "
                       "looked for every 2 ms only; correct or end it";
  }
  return condition;
}

ReadOutcome ShmImageSource::take(ImageFrame& frame, MonotonicTime now) noexcept {
  const ShmSample sample = reader_->take_newest();
  tubed_shm_image image{};
  if (!sample.copy(0, std::as_writable_bytes(std::span(&image, 1)))) {
    refusal_ = "it has fewer bytes than a header of an image";
    return sample.whole() ? ReadOutcome::kRefused : ReadOutcome::kNothing;
  }
  if (!sample.whole()) {
    return ReadOutcome::kNothing;
  }
  if (reader_->identity().content_version < 2) {
    image.geometry = TUBED_SHM_NO_GEOMETRY;  // reserved then
  }
  refusal_ = refusal_of(image, sample.bytes(), now);
  if (refusal_ != nullptr) {
    return ReadOutcome::kRefused;
  }
  const bool is_on = image.fluoroscopy_on != 0;
  // `frame` may have carried an image of another size before: what counts is the camera's.
  const bool fits = !is_on || (static_cast<int>(image.width) == camera_.width &&
                               static_cast<int>(image.height) == camera_.height &&
                               pixel_bytes(image) <= frame.pixels.size());
  if (fits) {
    const auto pixels = std::as_writable_bytes(std::span(frame.pixels)).first(pixel_bytes(image));
    if (!sample.copy(sizeof(image), pixels) || !sample.whole()) {
      return ReadOutcome::kNothing;
    }
  }
  newest_exposure_ns_ = image.exposure_ns;
  frame.exposure = from_ns(image.exposure_ns);
  frame.frame_number = image.frame_number;
  frame.origin = *origin_of(image.origin);
  frame.fluoroscopy_on = is_on;
  frame.geometry = geometry_of(image);
  frame.width = is_on ? static_cast<int>(image.width) : camera_.width;
  frame.height = is_on ? static_cast<int>(image.height) : camera_.height;
  frame.depth = image.depth_bits == 8 ? PixelDepth::kGrey8 : PixelDepth::kGrey16;
  frame.received = monotonic_now();
  return ReadOutcome::kFrame;
}

const char* ShmImageSource::refusal_of(const tubed_shm_image& image, std::size_t payload_bytes,
                                       MonotonicTime now) const noexcept {
  if (!origin_of(image.origin).has_value()) {
    return "it does not say whether a device, a simulation or a recording made it";
  }
  if (image.depth_bits != 8 && image.depth_bits != 16) {
    return "its pixels have neither 8 nor 16 bit";
  }
  if (image.geometry != TUBED_SHM_NO_GEOMETRY && image.geometry != TUBED_SHM_GEOMETRY) {
    return "it has a geometry of a kind that this version does not know";
  }
  if (image.width > kMaxSide || image.height > kMaxSide ||
      payload_bytes < sizeof(image) + pixel_bytes(image)) {
    return "it has fewer pixels than its size says";
  }
  if (image.exposure_ns <= newest_exposure_ns_) {
    return "it was not exposed after the one before";
  }
  if (image.exposure_ns > to_ns(now) + kMaxAheadNs) {
    return "its exposure lies in the future of CLOCK_MONOTONIC";
  }
  return nullptr;
}

}  // namespace tubed
