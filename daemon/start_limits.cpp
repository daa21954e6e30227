#include "daemon/start_limits.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <stdexcept>
#include <string>
#include <vector>

#include "daemon/pipeline/stage_thread.hpp"

namespace tubed {

namespace {

constexpr std::size_t kMiB = std::size_t{1} << 20U;
// The deepest stack was seen to hold 148 kB; Cyclone's threads, the stages' and the main thread share the
// limit.
constexpr rlim_t kMinStackBytes = kMiB;
// Main thread, log and Cyclone's (receive, events, timed callbacks, discovery, garbage collection, ...).
constexpr int kThreadsBesideStages = 12;
constexpr int kThreadsACamera = 2;
constexpr int kStageThreads = 3;
// Sockets of DDS and its event queues, the log, shared memory and its door, sources; each camera's source.
constexpr int kDescriptors = 48;
constexpr int kDescriptorsACamera = 8;
// Beside stacks and images: libraries are there already, Cyclone's buffers and the heap are not.
constexpr std::size_t kHeapBytes = 192 * kMiB;
// Of address space, that the heap of a thread reserves at once (HEAP_MAX_SIZE of glibc).
constexpr std::size_t kArenaBytes = 64 * kMiB;
// Mailboxes of three images of 16 bit, measurements and the filter's planes of floats.
constexpr std::size_t kBytesAPixel = 160;

int thread_count(const Configuration& configuration) {
  return kThreadsBesideStages + kStageThreads +
         kThreadsACamera * static_cast<int>(configuration.room.cameras.size());
}

std::size_t bytes_of_images(const Configuration& configuration) {
  std::size_t pixels = 0;
  for (const CameraCalibration& camera : configuration.room.cameras) {
    pixels += static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
  }
  return pixels * kBytesAPixel;
}

struct MemoryLimit {
  int protection;    ///< of the trial: only what can be written counts as data
  const char* what;  ///< of memory
  const char* advice;
};
constexpr MemoryLimit kAddressSpace{PROT_NONE, "address space",
                                    "raise RLIMIT_AS (LimitAS=infinity in the unit, or ulimit -v unlimited); "
                                    "most of it is reserved and never "
                                    "used"};
constexpr MemoryLimit kData{PROT_READ | PROT_WRITE, "memory for data",
                            "raise RLIMIT_DATA (LimitDATA=infinity in the unit, or ulimit -d unlimited)"};

void require_memory(std::size_t bytes, const MemoryLimit& limit) {
  void* const memory =
      mmap(nullptr, bytes, limit.protection, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (memory == MAP_FAILED) {
    throw std::runtime_error("there are not " + std::to_string(bytes / kMiB) + " MiB of " + limit.what +
                             " left; " + limit.advice);
  }
  munmap(memory, bytes);
}

/// Holds as many descriptors as it could get.
class Descriptors {
 public:
  explicit Descriptors(int wanted) {
    held_.reserve(static_cast<std::size_t>(wanted));
    int descriptor = open("/dev/null", O_RDONLY | O_CLOEXEC);
    while (descriptor >= 0 && static_cast<int>(held_.size()) < wanted) {
      held_.push_back(descriptor);
      descriptor = fcntl(held_.front(), F_DUPFD_CLOEXEC, 0);
    }
    if (descriptor >= 0) held_.push_back(descriptor);
  }
  ~Descriptors() {
    for (const int descriptor : held_) close(descriptor);
  }
  Descriptors(const Descriptors&) = delete;
  Descriptors& operator=(const Descriptors&) = delete;
  [[nodiscard]] int count() const { return static_cast<int>(held_.size()); }

 private:
  std::vector<int> held_;
};

void require_descriptors(int count) {
  if (const Descriptors held(count); held.count() < count) {
    throw std::runtime_error(
        "only " + std::to_string(held.count()) + " of " + std::to_string(count) +
        " files and sockets can be opened; raise RLIMIT_NOFILE (LimitNOFILE= in the unit, "
        "or ulimit -n)");
  }
}

void require_threads(int count) {
  const int started = startable_threads(count);
  if (started < count) {
    throw std::runtime_error("only " + std::to_string(started) + " of " + std::to_string(count) +
                             " threads can be started; raise RLIMIT_NPROC (LimitNPROC= and TasksMax= in the "
                             "unit, or ulimit -u)");
  }
}

}  // namespace

void require_stack() {
  rlimit stack{};
  if (getrlimit(RLIMIT_STACK, &stack) == 0 && stack.rlim_cur < kMinStackBytes) {
    throw std::runtime_error(
        "a stack of " + std::to_string(stack.rlim_cur / 1024) +
        " KiB is too small, 1024 are needed; raise RLIMIT_STACK (LimitSTACK= in the unit, "
        "or ulimit -s 8192)");
  }
}

void require_limits(const Configuration& configuration) {
  const int threads = thread_count(configuration);
  const std::size_t data_bytes = kHeapBytes + bytes_of_images(configuration) +
                                 static_cast<std::size_t>(threads) * stack_bytes_of_a_thread();
  require_memory(data_bytes + static_cast<std::size_t>(threads) * kArenaBytes, kAddressSpace);
  require_memory(data_bytes, kData);
  require_descriptors(kDescriptors +
                      kDescriptorsACamera * static_cast<int>(configuration.room.cameras.size()));
  require_threads(threads);
}

}  // namespace tubed
