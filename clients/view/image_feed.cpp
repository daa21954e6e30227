#include "clients/view/image_feed.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <ctime>
#include <nlohmann/json.hpp>
#include <utility>

namespace tubed {

namespace {

constexpr std::int64_t kRetry_ns = 200'000'000;
constexpr std::int64_t kPause_ns = 50'000'000;  // how soon the end is noticed
constexpr std::uint32_t kMaxSide = 1U << 14U;
constexpr double kWindowShare = 0.2;

std::int64_t monotonic_ns() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<std::int64_t>(now.tv_sec) * 1'000'000'000 + now.tv_nsec;
}

void sleep_ns(std::int64_t ns) {
  const timespec pause{ns / 1'000'000'000, ns % 1'000'000'000};
  nanosleep(&pause, nullptr);
}

std::size_t pixel_bytes(const tubed_shm_image& head) {
  return head.fluoroscopy_on == 0 ? 0 : std::size_t{head.width} * head.height * (head.depth_bits / 8);
}

bool is_sound(const tubed_shm_image& head, std::size_t payload_bytes) {
  return head.origin >= TUBED_SHM_DEVICE && head.origin <= TUBED_SHM_REPLAYED &&
         (head.depth_bits == 8 || head.depth_bits == 16) && head.width > 0 && head.height > 0 &&
         head.width <= kMaxSide && head.height <= kMaxSide &&
         payload_bytes >= sizeof(head) + pixel_bytes(head);
}

std::string framed(const nlohmann::json& head, std::span<const std::uint8_t> jpeg) {
  const std::string words = head.dump();
  std::string payload;
  payload.reserve(4 + words.size() + jpeg.size());
  for (unsigned shift = 0; shift < 32; shift += 8)
    payload += static_cast<char>((words.size() >> shift) & 0xFFU);
  payload += words;
  payload.append(jpeg.begin(), jpeg.end());
  return payload;
}

}  // namespace

std::optional<RawImage> take_image(ShmReader& reader) {
  const ShmSample sample = reader.take_newest();
  RawImage image;
  if (!sample.copy(0, std::as_writable_bytes(std::span(&image.head, 1))) || !sample.whole() ||
      !is_sound(image.head, sample.bytes())) {
    return {};
  }
  image.pixels.resize(pixel_bytes(image.head));
  const auto pixels = std::as_writable_bytes(std::span(image.pixels));
  if (!sample.copy(sizeof(image.head), pixels) || !sample.whole()) return {};
  return image;
}

ImageFeed::ImageFeed(ImageFeedSettings settings, std::function<std::uint64_t()> next_number,
                     std::function<void(SharedMessage)> publish, std::function<bool()> is_wanted)
    : settings_(std::move(settings)),
      next_number_(std::move(next_number)),
      publish_(std::move(publish)),
      is_wanted_(std::move(is_wanted)),
      thread_([this] { follow(); }) {}

ImageFeed::~ImageFeed() {
  must_end_ = true;
  thread_.join();
}

void ImageFeed::follow() {
  while (!must_end_) {
    const std::int64_t now_ns = monotonic_ns();
    if (!is_wanted_() || now_ns < next_ns_) {
      sleep_ns(is_wanted_() ? std::min(next_ns_ - now_ns, kPause_ns) : kPause_ns);
    } else if (!reader_) {
      connect();
    } else {
      wait(now_ns);
    }
  }
}

void ImageFeed::connect() {
  try {
    reader_.emplace(ShmReaderSettings{.path = settings_.socket,
                                      .content = TUBED_SHM_IMAGES,
                                      .content_version = TUBED_SHM_IMAGES_VERSION,
                                      .trusted = {}});
    if (reader_->identity().name != settings_.camera) reader_.reset();  // another camera's
  } catch (const ShmError&) {
    // Nobody there yet: the page says that there is no picture.
  }
  if (!reader_) next_ns_ = monotonic_ns() + kRetry_ns;
}

void ImageFeed::wait(std::int64_t now_ns) {
  switch (reader_->news(now_ns)) {
    case ShmNews::kNone:
      return reader_->sleep_until(now_ns + kPause_ns);
    case ShmNews::kSilent:
    case ShmNews::kEnded:
      return reader_.reset();
    case ShmNews::kSample:
      break;
  }
  next_ns_ = now_ns + static_cast<std::int64_t>(1e9 / settings_.max_rate_hz);
  if (const std::optional<RawImage> image = take_image(*reader_)) show(*image);
}

namespace {

/// How the view stood for this image; null where the room says it for all of them.
nlohmann::json view_json(const tubed_shm_image& head) {
  if (head.geometry != TUBED_SHM_GEOMETRY) return {};
  return {{"f", {head.fx, head.fy}},
          {"c", {head.cx, head.cy}},
          {"q", head.q_camera_world},
          {"t", head.t_camera_world_mm}};
}

}  // namespace

void ImageFeed::show(const RawImage& image) {
  int shrunk = 1;
  const std::span<const std::uint8_t> jpeg =
      image.pixels.empty() ? std::span<const std::uint8_t>() : encode(image, shrunk);
  auto message = std::make_shared<Message>();
  message->kind = MessageKind::kImage;
  message->about = settings_.camera;
  message->number = next_number_();
  message->is_binary = true;
  message->payload = framed({{"type", "image"},
                             {"camera", settings_.camera},
                             {"n", message->number},
                             {"frame", image.head.frame_number},
                             {"exposed_at", static_cast<double>(image.head.exposure_ns) * 1e-6},
                             {"view", view_json(image.head)},
                             {"on", image.head.fluoroscopy_on != 0},
                             {"origin", image.head.origin},
                             {"width", image.head.width},
                             {"height", image.head.height},
                             {"shrunk", shrunk},
                             {"black", std::lround(window_.black)},
                             {"white", std::lround(window_.white)},
                             {"received", static_cast<double>(monotonic_ns()) * 1e-6}},
                            jpeg);
  publish_(std::move(message));
}

std::span<const std::uint8_t> ImageFeed::encode(const RawImage& image, int& shrunk) {
  picture_.width = static_cast<int>(image.head.width);
  picture_.height = static_cast<int>(image.head.height);
  picture_.pixels.resize(std::size_t{image.head.width} * image.head.height);
  std::vector<std::uint16_t> deep(picture_.pixels.size());
  if (image.head.depth_bits == 8) {
    std::copy(image.pixels.begin(), image.pixels.end(), deep.begin());
  } else {
    std::memcpy(deep.data(), image.pixels.data(), image.pixels.size());
  }
  const GreyWindow now = window_of(deep);
  window_ = has_window_ ? between(window_, now, kWindowShare) : now;
  has_window_ = true;
  apply_window(deep, window_, picture_.pixels);
  shrunk = shrink(picture_, settings_.max_side);
  return encoder_.encode(picture_, settings_.quality);
}

}  // namespace tubed
