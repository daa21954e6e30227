// What a video device of Linux is to this driver: a file with controls, buffers and something to wait for.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "drivers/interface/timestamps.hpp"

namespace tubed {

/// The calls of the system that a card is driven with, and the clock; a test brings a card of its own. One
/// thread. Nothing here allocates or throws.
class VideoDevice {
 public:
  virtual ~VideoDevice() = default;
  VideoDevice() = default;
  VideoDevice(const VideoDevice&) = delete;
  VideoDevice& operator=(const VideoDevice&) = delete;

  /// 0, or errno. Precondition: it is not open.
  virtual int open(const char* path) noexcept = 0;
  virtual void close() noexcept = 0;
  /// ioctl(2) with a request of V4L2 and its struct: 0, or errno.
  virtual int control(unsigned long request, void* argument) noexcept = 0;
  /// A buffer of the device, to be read; empty when that fails.
  virtual std::span<const std::uint8_t> map(std::size_t bytes, std::uint32_t offset) noexcept = 0;
  virtual void unmap(std::span<const std::uint8_t> buffer) noexcept = 0;
  /// Sleeps until there is a picture, an event or an error, until `deadline` at most. Precondition: it is
  /// open.
  virtual void wait(MonotonicTime deadline) noexcept = 0;
  /// Sleeps until `deadline`, whatever comes.
  virtual void sleep(MonotonicTime deadline) noexcept = 0;
  [[nodiscard]] virtual MonotonicTime now() noexcept = 0;
};

}  // namespace tubed
