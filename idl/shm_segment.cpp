#include "idl/shm_segment.hpp"

#include <fcntl.h>
#include <linux/magic.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/vfs.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

namespace tubed {

namespace {

constexpr int kSeals = F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_FUTURE_WRITE | F_SEAL_SEAL;

[[noreturn]] void fail(const char* what) {
  throw ShmError("cannot " + std::string(what) + ": " + std::strerror(errno));
}

}  // namespace

ShmSegment ShmSegment::create(const std::string& name, std::size_t bytes) {
  ShmSegment segment(memfd_create(name.c_str(), MFD_CLOEXEC | MFD_ALLOW_SEALING));
  if (segment.descriptor_ < 0) {
    fail("make shared memory");
  }
  // Pages now: later a full memory would be a SIGBUS in the middle of a sample.
  if (fallocate(segment.descriptor_, 0, 0, static_cast<off_t>(bytes)) != 0) {
    fail("reserve the pages of the shared memory");
  }
  segment.bytes_ = bytes;
  segment.map(PROT_READ | PROT_WRITE);
  madvise(segment.memory_, bytes, MADV_DONTFORK);
  fchmod(segment.descriptor_, S_IRUSR);  // /proc/PID/fd cannot be opened for writing either
  if (fcntl(segment.descriptor_, F_ADD_SEALS, kSeals) != 0) {
    fail("seal the shared memory (Linux 5.1 or newer is needed)");
  }
  return segment;
}

ShmSegment ShmSegment::adopt(int descriptor) {
  ShmSegment segment(descriptor);
  const int seals = fcntl(descriptor, F_GET_SEALS);
  // FUTURE_WRITE too: without it the writer could take pages away later.
  constexpr int kNeeded = F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_FUTURE_WRITE;
  struct stat status {};
  struct statfs system {};
  if (seals < 0 || (seals & kNeeded) != kNeeded || fstat(descriptor, &status) != 0 ||
      fstatfs(descriptor, &system) != 0 || system.f_type != TMPFS_MAGIC || status.st_size <= 0) {
    throw ShmError("what the writer handed out is no sealed shared memory; it is not believed");
  }
  if (static_cast<std::int64_t>(status.st_blocks) * 512 < status.st_size) {
    throw ShmError("the writer's shared memory has holes; it is not believed");
  }
  segment.bytes_ = static_cast<std::size_t>(status.st_size);
  segment.map(PROT_READ);
  return segment;
}

void ShmSegment::map(int protection) {
  void* place = mmap(nullptr, bytes_, protection, MAP_SHARED | MAP_POPULATE, descriptor_, 0);
  if (place == MAP_FAILED) {
    fail("map the shared memory");
  }
  memory_ = static_cast<std::byte*>(place);
}

ShmSegment::~ShmSegment() {
  if (memory_ != nullptr) {
    munmap(memory_, bytes_);
  }
  if (descriptor_ >= 0) {
    close(descriptor_);
  }
}

ShmSegment::ShmSegment(ShmSegment&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)),
      memory_(std::exchange(other.memory_, nullptr)),
      bytes_(std::exchange(other.bytes_, 0)) {}

ShmSegment& ShmSegment::operator=(ShmSegment&& other) noexcept {
  std::swap(descriptor_, other.descriptor_);
  std::swap(memory_, other.memory_);
  std::swap(bytes_, other.bytes_);
  return *this;
}

}  // namespace tubed
