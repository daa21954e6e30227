// Writers that are broken or mean harm: what the source of their images makes of them.
#include <gtest/gtest.h>
#include <linux/futex.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <functional>
#include <span>
#include <thread>

#include "drivers/interface/read_until.hpp"
#include "tests/drivers/image_shm/shm_image_source_bed.hpp"

namespace tubed {
namespace {

using ShmImageWriterFaults = ShmImageSourceBed;

TEST_F(ShmImageWriterFaults, AWriterGoneMadDoesNotKeepTheThreadBusy) {
  start_writer();
  ASSERT_TRUE(open().ok);
  tubed_shm_image bad = image();
  bad.exposure_ns = 0;
  std::atomic<bool> done{false};
  std::thread mad([&] {
    while (!done) {
      writer_->put(bad, pixels_.data());
    }
  });
  int looks = 0;
  const MonotonicTime until = monotonic_now() + std::chrono::milliseconds(100);
  while (monotonic_now() < until) {
    looks += read_until(source_, frame_, until) == ReadOutcome::kRefused ? 1 : 0;
  }
  done = true;
  mad.join();
  EXPECT_GT(looks, 32);
  EXPECT_LE(looks, 32 + 50 + 1);
}

/// A writer of somebody's own making: all of its memory is in its hands.
class Liar {
 public:
  Liar(const std::string& socket, std::uint64_t payload_bytes,
       std::uint32_t version = TUBED_SHM_IMAGES_VERSION)
      : geometry_{4, payload_bytes},
        segment_(ShmSegment::create("liar", geometry_.segment_bytes())),
        ring_(segment_.memory(), geometry_, {TUBED_SHM_IMAGES, version, "A", 1}, to_ns(monotonic_now())),
        door_({socket, {}}) {}

  void beat() {
    ring_.beat(to_ns(monotonic_now()));
    door_.serve(segment_.descriptor(), to_ns(monotonic_now()));
  }
  ShmRingWriter& ring() { return ring_; }
  tubed_shm_header& header() { return *reinterpret_cast<tubed_shm_header*>(segment_.memory()); }

 private:
  ShmGeometry geometry_;
  ShmSegment segment_;
  ShmRingWriter ring_;
  ShmDoor door_;
};

/// Runs `act` without pause in a thread of its own as long as it lives.
class Busily {
 public:
  explicit Busily(std::function<void()> act)
      : thread_([this, act = std::move(act)] {
          while (!done_) {
            act();
          }
        }) {}
  ~Busily() {
    done_ = true;
    thread_.join();
  }

 private:
  std::atomic<bool> done_{false};
  std::thread thread_;
};

/// Share of the time that this thread computes while it reads for 200 ms.
double share_of_reading(ShmImageSource& source, ImageFrame& frame) {
  const auto cpu_s = [] {
    timespec used{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &used);
    return static_cast<double>(used.tv_sec) + 1e-9 * static_cast<double>(used.tv_nsec);
  };
  const double before_s = cpu_s();
  const MonotonicTime from = monotonic_now();
  read_until(source, frame, from + std::chrono::milliseconds(200));
  return (cpu_s() - before_s) / seconds_between(from, monotonic_now());
}

TEST_F(ShmImageWriterFaults, AWriterThatRingsWithoutAnImageDoesNotKeepTheThreadBusyAndIsNamed) {
  Liar liar(folder_.socket(), 4096);
  {
    const Busily beating([&] { liar.beat(); });
    ASSERT_TRUE(source_.open().ok);
  }
  {
    const Busily ringing([&] {
      std::atomic_ref(liar.header().wake).fetch_add(1);
      syscall(SYS_futex, &liar.header().wake, FUTEX_WAKE, 1, nullptr, nullptr, 0);
      liar.beat();
    });
    EXPECT_LT(share_of_reading(source_, frame_), 0.2);
  }
  EXPECT_NE(source_.condition().words.text().find("rings without an image"), std::string_view::npos);
}

// Version 1 had no geometry: whatever lies in what was reserved is none.
TEST_F(ShmImageWriterFaults, AWriterOfTheFirstVersionIsStillRead) {
  const std::size_t bytes = sizeof(tubed_shm_image) + kWidth * kHeight;
  Liar old(folder_.socket(), bytes, 1);
  {
    const Busily beating([&] { old.beat(); });
    ASSERT_TRUE(source_.open().ok);
  }
  tubed_shm_image sent = image();
  sent.geometry = 0xffffffff;
  old.ring().begin();
  old.ring().write(0, std::as_bytes(std::span(&sent, 1)));
  old.ring().write(sizeof(sent), std::as_bytes(std::span(pixels_)).first(kWidth * kHeight));
  old.ring().commit(bytes, to_ns(monotonic_now()));
  ASSERT_EQ(read_now(), ReadOutcome::kFrame);
  EXPECT_FALSE(frame_.geometry);
  EXPECT_EQ(frame_.pixels[100], pixels_[100]);
}

TEST_F(ShmImageWriterFaults, AWriterOfALaterVersionIsRefusedWithBothVersions) {
  Liar later(folder_.socket(), 4096, 3);
  const Busily beating([&] { later.beat(); });
  EXPECT_NE(source_.open().why.find("images of version 3, expected images of version 2"), std::string::npos);
}

TEST_F(ShmImageWriterFaults, NumbersThatGoBackwardsDoNotKeepTheThreadBusy) {
  Liar liar(folder_.socket(), 4096);
  {
    const Busily beating([&] { liar.beat(); });
    ASSERT_TRUE(source_.open().ok);
  }
  liar.ring().publish(std::array<std::byte, 8>{}, to_ns(monotonic_now()));
  liar.ring().publish(std::array<std::byte, 8>{}, to_ns(monotonic_now()));
  EXPECT_EQ(read_now(), ReadOutcome::kRefused);
  std::atomic_ref(liar.header().newest).store(1);
  const Busily beating([&] { liar.beat(); });
  EXPECT_LT(share_of_reading(source_, frame_), 0.2);
}

TEST_F(ShmImageWriterFaults, MemoryLargerThanTheCameraCouldNeedIsRefused) {
  Liar liar(folder_.socket(), std::uint64_t{16} * kWidth * kHeight * 2);
  const Busily beating([&] { liar.beat(); });
  const OpenResult result = source_.open();
  EXPECT_FALSE(result.ok);
  EXPECT_NE(result.why.find("expected at most"), std::string::npos) << result.why;
}

}  // namespace
}  // namespace tubed
