#include "clients/view/image_feed.hpp"

#include <algorithm>
#include <ctime>
#include <utility>

namespace tubed {

namespace {

constexpr std::int64_t kRetry_ns = 200'000'000;
constexpr std::int64_t kPause_ns = 50'000'000;  // how soon the end is noticed

std::int64_t monotonic_ns() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<std::int64_t>(now.tv_sec) * 1'000'000'000 + now.tv_nsec;
}

void sleep_ns(std::int64_t ns) {
  const timespec pause{ns / 1'000'000'000, ns % 1'000'000'000};
  nanosleep(&pause, nullptr);
}

}  // namespace

ImageFeed::ImageFeed(ImageFeedSettings settings, std::function<std::uint64_t()> next_number,
                     std::function<void(SharedMessage)> publish, std::function<bool()> is_wanted)
    : settings_(std::move(settings)),
      encoder_(settings_.camera),
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
  if (const std::optional<RawImage> image = take_image(*reader_)) {
    publish_(encoder_.encode(*image, next_number_(), monotonic_ns()));
  }
}

}  // namespace tubed
