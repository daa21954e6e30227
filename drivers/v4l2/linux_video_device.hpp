#pragma once

#include "drivers/v4l2/video_device.hpp"

namespace tubed {

/// The kernel's. A call that hangs inside the kernel's driver hangs here as well; all others end at once.
class LinuxVideoDevice final : public VideoDevice {
 public:
  ~LinuxVideoDevice() override { LinuxVideoDevice::close(); }

  int open(const char* path) noexcept override;
  void close() noexcept override;
  int control(unsigned long request, void* argument) noexcept override;
  std::span<const std::uint8_t> map(std::size_t bytes, std::uint32_t offset) noexcept override;
  void unmap(std::span<const std::uint8_t> buffer) noexcept override;
  void wait(MonotonicTime deadline) noexcept override;
  void sleep(MonotonicTime deadline) noexcept override;
  [[nodiscard]] MonotonicTime now() noexcept override;

 private:
  int descriptor_ = -1;
};

}  // namespace tubed
