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

#include "idl/shm_header.hpp"

namespace tubed {

namespace {

constexpr int kSeals = F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_FUTURE_WRITE | F_SEAL_SEAL;
constexpr std::size_t kPageBytes = 4096;

[[noreturn]] void fail(const char* what) {
  throw ShmError("cannot " + std::string(what) + ": " + std::strerror(errno));
}

/// Size of shared memory that can neither shrink nor lose a page. Throws ShmError when it is anything else.
std::uint64_t sealed_bytes(int descriptor) {
  // The seals first: on another kind of file the calls below could block for ever.
  const int seals = fcntl(descriptor, F_GET_SEALS);
  // FUTURE_WRITE too: without it the writer could take pages away later.
  constexpr int kNeeded = F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_FUTURE_WRITE;
  struct stat status {};
  struct statfs system {};
  if (seals < 0 || (seals & kNeeded) != kNeeded || fstat(descriptor, &status) != 0 ||
      fstatfs(descriptor, &system) != 0 || system.f_type != TMPFS_MAGIC || status.st_size <= 0) {
    throw ShmError("what the writer handed out is no sealed shared memory; it is not believed");
  }
  return static_cast<std::uint64_t>(status.st_size);
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
  // Written, not only reserved: SEEK_HOLE reports what was never written as a hole.
  for (std::size_t at = 0; at < bytes; at += kPageBytes) {
    static_cast<volatile std::byte&>(segment.memory_[at]) = std::byte{0};
  }
  madvise(segment.memory_, bytes, MADV_DONTFORK);
  fchmod(segment.descriptor_, S_IRUSR);  // /proc/PID/fd cannot be opened for writing either
  if (fcntl(segment.descriptor_, F_ADD_SEALS, kSeals) != 0) {
    fail("seal the shared memory (Linux 5.1 or newer is needed)");
  }
  return segment;
}

ShmSegment ShmSegment::adopt(int descriptor, std::uint64_t max_bytes) {
  ShmSegment segment(descriptor);
  const std::uint64_t size = sealed_bytes(descriptor);
  if (size > max_bytes) {
    throw ShmError("the writer's shared memory has " + std::to_string(size) + " bytes, expected at most " +
                   std::to_string(max_bytes) + "; is it meant for somebody else?");
  }
  // Not st_blocks: blocks beyond the end (FALLOC_FL_KEEP_SIZE) make up for holes there.
  if (static_cast<std::uint64_t>(lseek(descriptor, 0, SEEK_HOLE)) != size) {
    throw ShmError("the writer's shared memory has holes; it is not believed");
  }
  tubed_shm_header header{};
  if (pread(descriptor, &header, sizeof(header), 0) != sizeof(header)) {
    throw ShmError("the shared memory is none of tubed's");
  }
  segment.bytes_ = checked_geometry(header, size).segment_bytes();
  segment.map(PROT_READ);
  segment.touch_pages();
  return segment;
}

void ShmSegment::map(int protection) {
  // Not MAP_POPULATE: after mlockall(MCL_FUTURE | MCL_ONFAULT) it does nothing.
  void* place = mmap(nullptr, bytes_, protection, MAP_SHARED, descriptor_, 0);
  if (place == MAP_FAILED) {
    fail("map the shared memory");
  }
  memory_ = static_cast<std::byte*>(place);
}

void ShmSegment::touch_pages() const {
  for (std::size_t at = 0; at < bytes_; at += kPageBytes) {
    const volatile std::byte* page = memory_ + at;
    static_cast<void>(*page);
  }
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
