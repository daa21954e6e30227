// Images of one camera out of shared memory, as JPEG.
#pragma once

#include <atomic>
#include <functional>
#include <optional>
#include <string>
#include <thread>

#include "clients/view/image_encoder.hpp"
#include "idl/shm_reader.hpp"

namespace tubed {

/// How the pictures are made.
struct ImageFeedSettings {
  std::string camera;
  std::string socket;       ///< the daemon's preview, or a grabber's own
  double max_rate_hz = 15;  ///< however fast they come
};

/// A thread that follows one camera through restarts of whoever writes.
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

  ImageFeedSettings settings_;
  ImageEncoder encoder_;
  std::function<std::uint64_t()> next_number_;
  std::function<void(SharedMessage)> publish_;
  std::function<bool()> is_wanted_;
  std::optional<ShmReader> reader_;
  std::int64_t next_ns_ = 0;  ///< when the next picture may be made
  std::atomic<bool> must_end_{false};
  std::thread thread_;
};

}  // namespace tubed
