// A malicious program in the place of a frame grabber.
//   evil_writer SOCKET CAMERA WIDTH HEIGHT LIE
// Says "ready" when its door is open, and goes on until it is ended.
#include <fcntl.h>
#include <linux/futex.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <functional>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "idl/shm_door.hpp"
#include "idl/shm_ring.hpp"
#include "idl/shm_segment.hpp"

namespace {

using tubed::ShmGeometry;
using tubed::ShmSegment;

constexpr std::int64_t kMillisecond = 1'000'000;
constexpr int kSeals = F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_FUTURE_WRITE | F_SEAL_SEAL;
constexpr off_t kLarge = off_t{64} << 20;

std::int64_t now_ns() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<std::int64_t>(now.tv_sec) * 1'000'000'000 + now.tv_nsec;
}

struct Camera {
  std::string name;
  std::uint32_t width;
  std::uint32_t height;
  [[nodiscard]] ShmGeometry geometry() const {
    return {4, sizeof(tubed_shm_image) + std::uint64_t{2} * width * height};
  }
};

/// A ring that is in order, all of whose memory is at hand.
class Writer {
 public:
  Writer(const std::string& socket, const Camera& camera)
      : camera_(camera),
        segment_(ShmSegment::create("evil", camera.geometry().segment_bytes())),
        ring_(segment_.memory(), camera.geometry(),
              {TUBED_SHM_IMAGES, TUBED_SHM_IMAGES_VERSION, camera.name, 1}, now_ns()),
        door_({socket, {}}) {}

  tubed_shm_header& header() { return *reinterpret_cast<tubed_shm_header*>(segment_.memory()); }
  tubed_shm_slot& slot(std::uint64_t number) {
    return *reinterpret_cast<tubed_shm_slot*>(segment_.memory() + TUBED_SHM_HEADER_BYTES +
                                              number % 4 * camera_.geometry().slot_bytes());
  }
  void serve() {
    ring_.beat(now_ns());
    door_.serve(segment_.descriptor(), now_ns());
  }
  [[nodiscard]] std::uint64_t visits() const { return door_.counters().admitted; }

  void ring_bell() {
    __atomic_fetch_add(&header().wake, 1, __ATOMIC_RELEASE);
    syscall(SYS_futex, &header().wake, FUTEX_WAKE, 1, nullptr, nullptr, 0);
  }

  /// An image of noise.
  void put(std::int64_t exposure_ns) {
    tubed_shm_image image{};
    image.exposure_ns = exposure_ns;
    image.frame_number = ++frame_;
    image.origin = TUBED_SHM_DEVICE;
    image.fluoroscopy_on = 1;
    image.depth_bits = 8;
    image.width = camera_.width;
    image.height = camera_.height;
    std::byte* payload = ring_.begin();
    std::memcpy(payload, &image, sizeof(image));
    const std::size_t pixels = std::size_t{camera_.width} * camera_.height;
    for (std::size_t i = 0; i + 4 <= pixels; i += 4) {
      const std::uint32_t grey = 0x80808080U + (random_() & 0x3f3f3f3fU);
      std::memcpy(payload + sizeof(image) + i, &grey, sizeof(grey));
    }
    ring_.commit(sizeof(image) + pixels, now_ns());
  }

 private:
  Camera camera_;
  ShmSegment segment_;
  tubed::ShmRingWriter ring_;
  tubed::ShmDoor door_;
  std::uint32_t frame_ = 0;
  std::minstd_rand random_;
};

void say_ready() {
  std::puts("ready");
  std::fflush(stdout);
}

/// `act` every `period_ns` (0: without pause), the door served at least every millisecond.
[[noreturn]] void again_and_again(Writer& writer, std::int64_t period_ns, const std::function<void()>& act) {
  say_ready();
  std::int64_t served_ns = 0;
  while (true) {
    if (now_ns() - served_ns > kMillisecond) {
      writer.serve();
      served_ns = now_ns();
    }
    act();
    if (period_ns > 0) usleep(static_cast<useconds_t>(period_ns / 1000));
  }
}

/// Hands out what is no ring's memory at all.
[[noreturn]] void hand_out(const std::string& socket, int descriptor) {
  tubed::ShmDoor door({socket, {}});
  say_ready();
  while (true) {
    door.serve(descriptor, now_ns());
    usleep(1000);
  }
}

/// A memfd with a good header, of `size` bytes of which only the first page is there.
int memory_of(const Camera& camera, off_t size) {
  const int descriptor = memfd_create("evil", MFD_CLOEXEC | MFD_ALLOW_SEALING);
  std::vector<std::uint64_t> page(TUBED_SHM_HEADER_BYTES / 8);
  alignas(64) static std::byte scratch[TUBED_SHM_HEADER_BYTES];
  tubed::ShmRingWriter(scratch, camera.geometry(),
                       {TUBED_SHM_IMAGES, TUBED_SHM_IMAGES_VERSION, camera.name, 1}, now_ns());
  if (ftruncate(descriptor, size) != 0 || pwrite(descriptor, scratch, sizeof(scratch), 0) < 0) {
    std::perror("evil_writer");
    std::exit(1);
  }
  return descriptor;
}

int sealed(int descriptor, int seals = kSeals) {
  fcntl(descriptor, F_ADD_SEALS, seals);
  return descriptor;
}

using Lie = std::function<void(const std::string& socket, const Camera& camera)>;

const std::map<std::string, Lie>& memory_lies() {
  static const std::map<std::string, Lie> lies{
      // Blocks beyond the end make up for the holes before it.
      {"hollow",
       [](const std::string& socket, const Camera& camera) {
         const auto size = static_cast<off_t>(camera.geometry().segment_bytes());
         const int descriptor = memory_of(camera, size);
         fallocate(descriptor, FALLOC_FL_KEEP_SIZE, size, size);
         hand_out(socket, sealed(descriptor));
       }},
      {"large",
       [](const std::string& socket, const Camera& camera) {
         const int descriptor = memory_of(camera, kLarge);
         fallocate(descriptor, 0, 0, kLarge);
         hand_out(socket, sealed(descriptor));
       }},
      {"hollow and large",
       [](const std::string& socket, const Camera& camera) {
         const int descriptor = memory_of(camera, kLarge);
         fallocate(descriptor, FALLOC_FL_KEEP_SIZE, kLarge, kLarge);
         hand_out(socket, sealed(descriptor));
       }},
      {"small", [](const std::string& socket,
                   const Camera& camera) { hand_out(socket, sealed(memory_of(camera, 4096))); }},
      {"not sealed",
       [](const std::string& socket, const Camera& camera) {
         const int descriptor = memory_of(camera, static_cast<off_t>(camera.geometry().segment_bytes()));
         fallocate(descriptor, 0, 0, static_cast<off_t>(camera.geometry().segment_bytes()));
         hand_out(socket, descriptor);
       }},
      // Shrunk as soon as it was handed out: only possible without the seal.
      {"shrunk after",
       [](const std::string& socket, const Camera& camera) {
         const auto size = static_cast<off_t>(camera.geometry().segment_bytes());
         const int descriptor = sealed(memory_of(camera, size), F_SEAL_GROW | F_SEAL_FUTURE_WRITE);
         tubed::ShmDoor door({socket, {}});
         say_ready();
         while (true) {
           door.serve(descriptor, now_ns());
           if (door.counters().admitted > 0 && ftruncate(descriptor, 4096) != 0) std::perror("shrink");
           usleep(1000);
         }
       }},
  };
  return lies;
}

/// Another field of the header is wrong for every visitor.
void lie_in_the_header(Writer& writer) {
  tubed_shm_header& header = writer.header();
  const tubed_shm_header good = header;
  const std::vector<std::function<void()>> lies{
      [&] { header.magic = 0; },
      [&] { header.layout_version = 77; },
      [&] { header.content = TUBED_SHM_ESTIMATES; },
      [&] { header.content_version = 99; },
      [&] { header.slot_count = 0; },
      [&] { header.slot_count = 0xffffffff; },
      [&] { header.slot_bytes = 8; },
      [&] { header.payload_bytes = ~std::uint64_t{0}; },
      [&] { header.payload_bytes = 0; },
      [&] { std::memset(header.name, 'A', sizeof(header.name)); },
      [&] { std::strcpy(header.name, "another"); },
  };
  again_and_again(writer, kMillisecond, [&] {
    std::memcpy(&header, &good, offsetof(tubed_shm_header, wake));
    lies[writer.visits() % lies.size()]();
  });
}

const std::map<std::string, std::function<void(Writer&)>>& ring_lies() {
  static std::mt19937 random(7);
  static const std::map<std::string, std::function<void(Writer&)>> lies{
      {"headers", lie_in_the_header},
      {"rings without news", [](Writer& writer) { again_and_again(writer, 0, [&] { writer.ring_bell(); }); }},
      {"ten times the rate",
       [](Writer& writer) { again_and_again(writer, 3'333'333, [&] { writer.put(now_ns()); }); }},
      // A sample that is announced, and whose slot is never complete, or complete between two looks.
      {"torn",
       [](Writer& writer) {
         std::uint64_t number = 4;
         for (int slot = 0; slot < 4; ++slot) writer.put(now_ns());  // good images, but for their marks
         again_and_again(writer, kMillisecond, [&] {
           number += 1 + random() % 2;
           __atomic_store_n(&writer.slot(number).sequence, 2 * number - random() % 2, __ATOMIC_RELEASE);
           __atomic_store_n(&writer.header().newest, number, __ATOMIC_RELEASE);
           writer.ring_bell();
         });
       }},
      {"from the future",
       [](Writer& writer) {
         again_and_again(writer, 10 * kMillisecond, [&] { writer.put(now_ns() + 3'600'000'000'000); });
       }},
      {"backwards",
       [](Writer& writer) {
         std::int64_t exposure_ns = now_ns() - 1'000'000'000;
         again_and_again(writer, 10 * kMillisecond, [&] { writer.put(exposure_ns -= kMillisecond); });
       }},
      {"numbers at random",
       [](Writer& writer) {
         again_and_again(writer, 0, [&] {
           __atomic_store_n(&writer.header().newest, random() % 4, __ATOMIC_RELEASE);
           __atomic_store_n(&writer.header().heartbeat_ns,
                            now_ns() - static_cast<std::int64_t>(random() % 400) * kMillisecond,
                            __ATOMIC_RELEASE);
           writer.ring_bell();
         });
       }},
  };
  return lies;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 6) return 64;
  const Camera camera{argv[2], static_cast<std::uint32_t>(std::atoi(argv[3])),
                      static_cast<std::uint32_t>(std::atoi(argv[4]))};
  const std::string lie = argv[5];
  if (const auto found = memory_lies().find(lie); found != memory_lies().end())
    found->second(argv[1], camera);
  const auto found = ring_lies().find(lie);
  if (found == ring_lies().end()) return 64;
  Writer writer(argv[1], camera);
  found->second(writer);
}
