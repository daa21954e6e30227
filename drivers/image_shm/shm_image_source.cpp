#include "drivers/image_shm/shm_image_source.hpp"

#include <algorithm>
#include <span>

#include "drivers/interface/monotonic_clock.hpp"

namespace tubed {

namespace {

constexpr int kPatienceMs = 300;  // a writer shows up at its door every 100 ms
constexpr std::int64_t kMostAheadNs = 5'000'000;
constexpr std::int64_t kLookNs = 2'000'000;
constexpr std::int64_t kBurst = 32;
constexpr std::uint32_t kMostSide = 1U << 15U;

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

}  // namespace

ShmImageSource::ShmImageSource(const CameraCalibration& camera, std::string socket,
                               std::vector<uid_t> trusted)
    : camera_(camera), socket_(std::move(socket)), trusted_(std::move(trusted)) {}

OpenResult ShmImageSource::open() {
  try {
    reader_.emplace(ShmReaderSettings{.path = socket_,
                                      .content = TUBED_SHM_IMAGES,
                                      .content_version = TUBED_SHM_IMAGES_VERSION,
                                      .patience_ms = kPatienceMs,
                                      .trusted = trusted_});
  } catch (const ShmError& error) {
    return {false, error.what()};
  }
  if (reader_->identity().name != camera_.name) {
    const std::string other = reader_->identity().name;
    reader_.reset();
    return {false,
            "the writer at '" + socket_ + "' grabs camera '" + other + "', expected '" + camera_.name + "'"};
  }
  return {true, {}};
}

ReadOutcome ShmImageSource::read(ImageFrame& frame, MonotonicTime deadline) noexcept {
  if (!reader_) {
    return ReadOutcome::kLost;
  }
  while (true) {
    const MonotonicTime now = monotonic_now();
    switch (reader_->news(to_ns(now))) {
      case ShmNews::kSample: {
        if (!may_look(to_ns(now))) {
          sleep_until(now + std::chrono::nanoseconds(kLookNs), deadline);
          break;
        }
        const Taken taken = take(frame, now);
        if (taken != Taken::kOvertaken) {
          return taken == Taken::kFrame ? ReadOutcome::kFrame : ReadOutcome::kRefused;
        }
        break;
      }
      case ShmNews::kSilent:
      case ShmNews::kEnded:
        return ReadOutcome::kLost;
      case ShmNews::kNone:
        break;
    }
    if (now >= deadline) {
      return ReadOutcome::kTimeout;
    }
    reader_->sleep_until(to_ns(deadline));
  }
}

/// A look costs kLookNs of time that passes anyhow, of which kBurst looks may be owed.
bool ShmImageSource::may_look(std::int64_t now_ns) noexcept {
  const std::int64_t from_ns = std::max(looked_until_ns_, now_ns - kBurst * kLookNs);
  if (from_ns + kLookNs > now_ns) {
    return false;
  }
  looked_until_ns_ = from_ns + kLookNs;
  return true;
}

ShmImageSource::Taken ShmImageSource::take(ImageFrame& frame, MonotonicTime now) noexcept {
  const ShmSample sample = reader_->take_newest();
  tubed_shm_image image{};
  if (!sample.copy(0, std::as_writable_bytes(std::span(&image, 1)))) {
    return sample.whole() ? Taken::kRefused : Taken::kOvertaken;
  }
  if (!sample.whole()) {
    return Taken::kOvertaken;
  }
  if (!is_plausible(image, sample.bytes(), now)) {
    return Taken::kRefused;
  }
  const bool is_on = image.fluoroscopy_on != 0;
  // `frame` may have carried an image of another size before: what counts is the camera's.
  const bool fits = !is_on || (static_cast<int>(image.width) == camera_.width &&
                               static_cast<int>(image.height) == camera_.height &&
                               pixel_bytes(image) <= frame.pixels.size());
  if (fits) {
    const auto pixels = std::as_writable_bytes(std::span(frame.pixels)).first(pixel_bytes(image));
    if (!sample.copy(sizeof(image), pixels) || !sample.whole()) {
      return Taken::kOvertaken;
    }
  }
  newest_exposure_ns_ = image.exposure_ns;
  frame.exposure = from_ns(image.exposure_ns);
  frame.frame_number = image.frame_number;
  frame.origin = *origin_of(image.origin);
  frame.fluoroscopy_on = is_on;
  frame.width = is_on ? static_cast<int>(image.width) : camera_.width;
  frame.height = is_on ? static_cast<int>(image.height) : camera_.height;
  frame.depth = image.depth_bits == 8 ? PixelDepth::kGrey8 : PixelDepth::kGrey16;
  frame.received = monotonic_now();
  return Taken::kFrame;
}

bool ShmImageSource::is_plausible(const tubed_shm_image& image, std::size_t payload_bytes,
                                  MonotonicTime now) const noexcept {
  return origin_of(image.origin).has_value() && (image.depth_bits == 8 || image.depth_bits == 16) &&
         image.width <= kMostSide && image.height <= kMostSide &&
         payload_bytes >= sizeof(image) + pixel_bytes(image) && image.exposure_ns > newest_exposure_ns_ &&
         image.exposure_ns <= to_ns(now) + kMostAheadNs;
}

}  // namespace tubed
