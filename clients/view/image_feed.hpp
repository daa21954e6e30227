// Images of one camera out of shared memory, as JPEG.
#pragma once

#include <atomic>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "clients/view/outbox.hpp"
#include "clients/view/picture.hpp"
#include "idl/shm_reader.hpp"

namespace tubed {

/// How the pictures are made.
struct ImageFeedSettings {
  std::string camera;
  std::string socket;       ///< the daemon's preview, or a grabber's own
  double max_rate_hz = 15;  ///< however fast they come
  int max_side = 1024;      ///< px; larger ones are halved until they fit
  int quality = 80;         ///< of JPEG, 1 .. 100
};

/// One image as it lies in shared memory.
struct RawImage {
  tubed_shm_image head{};
  std::vector<std::uint8_t> pixels;
};

/// The newest sample of the reader; nothing when it was overtaken meanwhile or contradicts itself.
/// Precondition: ShmNews::kSample.
std::optional<RawImage> take_image(ShmReader& reader);

/// A thread that follows one camera through restarts of whoever writes. Messages are binary: the length of
/// the head (4 bytes, little-endian), the head as JSON, {"type": "image", "camera", "n", "frame",
/// "exposed_at" (ms, CLOCK_MONOTONIC), "on", "origin" (1 device, 2 simulated, 3 replayed), "width", "height"
/// (of the camera, px), "shrunk", "black", "white" (grey values shown so), "received" (ms)}, then the JPEG;
/// without fluoroscopy there is none. The messages have no number of their own: `publish` gives one.
class ImageFeed {
 public:
  /// `publish` is called by the feed's thread, with the number that goes into the head. `is_wanted`: any
  /// thread; while it is false nothing is read or encoded.
  ImageFeed(ImageFeedSettings settings, std::function<std::uint64_t()> next_number,
            std::function<void(SharedMessage)> publish, std::function<bool()> is_wanted);
  ~ImageFeed();
  ImageFeed(const ImageFeed&) = delete;
  ImageFeed& operator=(const ImageFeed&) = delete;

 private:
  void follow();
  void connect();
  void wait(std::int64_t now_ns);
  void show(const RawImage& image);
  std::span<const std::uint8_t> encode(const RawImage& image, int& shrunk);

  ImageFeedSettings settings_;
  std::function<std::uint64_t()> next_number_;
  std::function<void(SharedMessage)> publish_;
  std::function<bool()> is_wanted_;
  std::optional<ShmReader> reader_;
  JpegEncoder encoder_;
  GreyPicture picture_;
  GreyWindow window_;
  bool has_window_ = false;
  std::int64_t next_ns_ = 0;  ///< when the next picture may be made
  std::atomic<bool> must_end_{false};
  std::thread thread_;
};

}  // namespace tubed
