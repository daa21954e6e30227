#include "drivers/v4l2/linux_video_device.hpp"

#include <fcntl.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <utility>

#include "drivers/interface/descriptor_wait.hpp"

namespace tubed {

int LinuxVideoDevice::open(const char* path) noexcept {
  descriptor_ = ::open(path, O_RDWR | O_NONBLOCK | O_CLOEXEC);
  if (descriptor_ < 0) {
    return errno;
  }
  struct stat file {};
  if (::fstat(descriptor_, &file) != 0 || !S_ISCHR(file.st_mode)) {
    close();
    return ENOTTY;
  }
  return 0;
}

void LinuxVideoDevice::close() noexcept {
  if (descriptor_ >= 0) {
    ::close(std::exchange(descriptor_, -1));
  }
}

int LinuxVideoDevice::control(unsigned long request, void* argument) noexcept {
  for (;;) {
    if (::ioctl(descriptor_, request, argument) >= 0) {
      return 0;
    }
    if (errno != EINTR) {
      return errno;
    }
  }
}

std::span<const std::uint8_t> LinuxVideoDevice::map(std::size_t bytes, std::uint32_t offset) noexcept {
  void* const memory = ::mmap(nullptr, bytes, PROT_READ, MAP_SHARED, descriptor_, static_cast<off_t>(offset));
  return memory == MAP_FAILED ? std::span<const std::uint8_t>()
                              : std::span(static_cast<const std::uint8_t*>(memory), bytes);
}

void LinuxVideoDevice::unmap(std::span<const std::uint8_t> buffer) noexcept {
  ::munmap(const_cast<std::uint8_t*>(buffer.data()), buffer.size());
}

void LinuxVideoDevice::wait(MonotonicTime deadline) noexcept {
  wait_for(descriptor_, POLLIN | POLLPRI, deadline);
}

void LinuxVideoDevice::sleep(MonotonicTime deadline) noexcept { sleep_until(deadline, deadline); }

MonotonicTime LinuxVideoDevice::now() noexcept { return monotonic_now(); }

}  // namespace tubed
