// A grabber's program and the daemon's source of its images, in one process.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "clients/cpp/shm_image_writer.hpp"
#include "drivers/image_shm/shm_image_source.hpp"
#include "drivers/interface/monotonic_clock.hpp"
#include "tests/idl/shm_bed.hpp"

namespace tubed {

inline constexpr int kWidth = 40;
inline constexpr int kHeight = 30;

inline CameraCalibration camera_named(const std::string& name) {
  CameraCalibration camera;
  camera.name = name;
  camera.width = kWidth;
  camera.height = kHeight;
  return camera;
}

/// A grabber and the daemon's source over one socket.
class ShmImageSourceBed : public ::testing::Test {
 protected:
  ShmImageSourceBed() { frame_.reserve(kWidth, kHeight); }

  ShmImageWriterSettings writer_settings() const {
    return {.socket = folder_.socket(),
            .camera = "A",
            .max_width = 64,
            .max_height = 64,
            .max_depth_bits = 16,
            .group = {}};
  }

  void start_writer() { writer_.emplace(writer_settings()); }

  /// open() while the writer beats, which is what lets readers in.
  OpenResult open() {
    std::atomic<bool> done{false};
    std::thread beater([&] {
      while (writer_ && !done) {
        writer_->beat();
        std::this_thread::yield();
      }
    });
    const OpenResult result = source_.open();
    done = true;
    beater.join();
    return result;
  }

  ReadOutcome read_now() { return source_.read(frame_); }

  /// Of this instant, a moment after the one before.
  tubed_shm_image image(std::uint32_t depth_bits = 8) {
    tubed_shm_image image{};
    image.exposure_ns = to_ns(monotonic_now());
    image.frame_number = ++number_;
    image.origin = TUBED_SHM_DEVICE;
    image.fluoroscopy_on = 1;
    image.depth_bits = depth_bits;
    image.width = kWidth;
    image.height = kHeight;
    return image;
  }

  static std::vector<std::uint8_t> pixels(std::size_t bytes) {
    std::vector<std::uint8_t> result(bytes);
    for (std::size_t i = 0; i < bytes; ++i) {
      result[i] = static_cast<std::uint8_t>(i * 7 + i / 251);
    }
    return result;
  }

  ShmFolder folder_;
  std::optional<ShmImageWriter> writer_;
  ShmImageSource source_{camera_named("A"), folder_.socket(), {geteuid()}};
  ImageFrame frame_;
  std::uint32_t number_ = 0;
  const std::vector<std::uint8_t> pixels_ = pixels(64 * 64 * 2);
};

}  // namespace tubed
