#include "clients/tubectl/see/demo_image.hpp"

#include "drivers/interface/view_in_shm.hpp"

namespace tubed {

namespace {

constexpr std::int64_t kRetry_ns = 200'000'000;
constexpr std::int64_t kOld_ns = 500'000'000;

}  // namespace

void DemoImage::connect(std::int64_t now_ns) {
  if (now_ns < next_try_ns_) return;
  next_try_ns_ = now_ns + kRetry_ns;
  try {
    reader_.emplace(ShmReaderSettings{.path = socket_,
                                      .content = TUBED_SHM_IMAGES,
                                      .content_version = TUBED_SHM_IMAGES_VERSION,
                                      .trusted = {}});
  } catch (const ShmError&) {
    // Not there yet, or gone: the picture is drawn without.
  }
}

void DemoImage::look(std::int64_t now_ns) {
  if (!reader_) return connect(now_ns);
  const ShmNews news = reader_->news(now_ns);
  if (news == ShmNews::kSilent || news == ShmNews::kEnded) return reader_.reset();
  if (news != ShmNews::kSample) return;
  const std::optional<RawImage> image = take_image(*reader_);
  if (!image) return;
  came_ns_ = image->pixels.empty() ? 0 : now_ns;
  if (image->pixels.empty()) return;
  picture_ = follower_.take(*image);
  geometry_ = geometry_of(image->head);
}

const GreyPicture* DemoImage::picture(std::int64_t now_ns) const {
  return came_ns_ != 0 && now_ns - came_ns_ < kOld_ns ? &picture_ : nullptr;
}

}  // namespace tubed
