#include "drivers/image_shm/shm_image_source.hpp"

#include <gtest/gtest.h>
#include <linux/futex.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <functional>
#include <optional>
#include <thread>

#include "clients/cpp/shm_image_writer.hpp"
#include "drivers/image_shm/image_shm_driver.hpp"
#include "drivers/interface/monotonic_clock.hpp"
#include "drivers/interface/read_until.hpp"
#include "tests/idl/shm_bed.hpp"

namespace tubed {
namespace {

constexpr int kWidth = 40;
constexpr int kHeight = 30;

CameraCalibration camera_named(const std::string& name) {
  CameraCalibration camera;
  camera.name = name;
  camera.width = kWidth;
  camera.height = kHeight;
  return camera;
}

/// A grabber and the daemon's source over one socket.
class ShmImageSourceTest : public ::testing::Test {
 protected:
  ShmImageSourceTest() { frame_.reserve(kWidth, kHeight); }

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

TEST_F(ShmImageSourceTest, AnImageArrivesAsTheGrabberWroteIt) {
  for (const std::uint32_t depth_bits : {8U, 16U}) {
    start_writer();
    ASSERT_TRUE(open().ok);
    const tubed_shm_image sent = image(depth_bits);
    ASSERT_TRUE(writer_->put(sent, pixels_.data()));

    ASSERT_EQ(read_now(), ReadOutcome::kFrame);
    EXPECT_EQ(to_ns(frame_.exposure), sent.exposure_ns);
    EXPECT_EQ(frame_.frame_number, sent.frame_number);
    EXPECT_EQ(frame_.origin, Origin::kDevice);
    EXPECT_TRUE(frame_.fluoroscopy_on);
    EXPECT_EQ(frame_.width, kWidth);
    EXPECT_EQ(frame_.height, kHeight);
    EXPECT_EQ(frame_.depth, depth_bits == 8 ? PixelDepth::kGrey8 : PixelDepth::kGrey16);
    EXPECT_GE(frame_.received, frame_.exposure);
    EXPECT_TRUE(std::equal(pixels_.begin(), pixels_.begin() + kWidth * kHeight * depth_bits / 8,
                           frame_.pixels.begin()));
    writer_.reset();
  }
}

TEST_F(ShmImageSourceTest, AnImageFilledInPlaceArrivesToo) {
  start_writer();
  ASSERT_TRUE(open().ok);
  std::copy_n(pixels_.begin(), kWidth * kHeight, writer_->begin());
  ASSERT_TRUE(writer_->commit(image()));
  ASSERT_EQ(read_now(), ReadOutcome::kFrame);
  EXPECT_TRUE(std::equal(pixels_.begin(), pixels_.begin() + kWidth * kHeight, frame_.pixels.begin()));
}

TEST_F(ShmImageSourceTest, AnInstantWithoutRadiationHasNoPixels) {
  start_writer();
  ASSERT_TRUE(open().ok);
  tubed_shm_image off = image();
  off.fluoroscopy_on = 0;
  ASSERT_TRUE(writer_->put(off, nullptr));
  ASSERT_EQ(read_now(), ReadOutcome::kFrame);
  EXPECT_FALSE(frame_.fluoroscopy_on);
}

TEST_F(ShmImageSourceTest, ReplayedAndSimulatedImagesSaySo) {
  start_writer();
  ASSERT_TRUE(open().ok);
  for (const auto& [word, origin] : {std::pair{TUBED_SHM_SIMULATED, Origin::kSimulated},
                                     std::pair{TUBED_SHM_REPLAYED, Origin::kReplayed}}) {
    tubed_shm_image sent = image();
    sent.origin = word;
    ASSERT_TRUE(writer_->put(sent, pixels_.data()));
    ASSERT_EQ(read_now(), ReadOutcome::kFrame);
    EXPECT_EQ(frame_.origin, origin);
  }
}

TEST_F(ShmImageSourceTest, ASlowDaemonGetsTheNewestAndNeverSlowsTheWriter) {
  start_writer();
  ASSERT_TRUE(open().ok);
  for (int i = 0; i < 1000; ++i) {
    ASSERT_TRUE(writer_->put(image(), pixels_.data()));
  }
  ASSERT_EQ(read_now(), ReadOutcome::kFrame);
  EXPECT_EQ(frame_.frame_number, 1000U);
  EXPECT_EQ(read_now(), ReadOutcome::kNothing);
}

TEST_F(ShmImageSourceTest, AnotherSizeIsHandedOnForTheChecksToRefuseAndTheNextGoodOneIsTaken) {
  start_writer();
  ASSERT_TRUE(open().ok);
  tubed_shm_image large = image(16);
  large.width = 64;
  large.height = 64;
  const std::vector<std::uint8_t> before = frame_.pixels;
  ASSERT_TRUE(writer_->put(large, pixels_.data()));
  ASSERT_EQ(read_now(), ReadOutcome::kFrame);
  EXPECT_EQ(frame_.width, 64);
  EXPECT_EQ(frame_.pixels, before);

  ASSERT_TRUE(writer_->put(image(), pixels_.data()));
  ASSERT_EQ(read_now(), ReadOutcome::kFrame);
  EXPECT_EQ(frame_.width, kWidth);
  EXPECT_EQ(frame_.pixels[5], pixels_[5]);
}

TEST_F(ShmImageSourceTest, AnExposureOfTheFutureOrOfThePastIsRefused) {
  start_writer();
  ASSERT_TRUE(open().ok);
  const tubed_shm_image good = image();
  ASSERT_TRUE(writer_->put(good, pixels_.data()));
  ASSERT_EQ(read_now(), ReadOutcome::kFrame);
  for (const std::int64_t exposure_ns :
       {good.exposure_ns, good.exposure_ns - 1, std::int64_t{0}, to_ns(monotonic_now()) + 60'000'000'000}) {
    tubed_shm_image bad = image();
    bad.exposure_ns = exposure_ns;
    ASSERT_TRUE(writer_->put(bad, pixels_.data()));
    EXPECT_EQ(read_now(), ReadOutcome::kRefused) << exposure_ns;
  }
  EXPECT_EQ(source_.condition().words.text(),
            "image refused: its exposure lies in the future of CLOCK_MONOTONIC");
}

TEST_F(ShmImageSourceTest, WhatNoHonestWriterWouldWriteIsRefused) {
  ShmWriterSettings settings = small_writer(folder_.socket(), 4, 4096);
  ShmWriter liar(settings, to_ns(monotonic_now()));
  std::atomic<bool> done{false};
  std::thread beater([&] {
    while (!done) {
      liar.beat(to_ns(monotonic_now()));
    }
  });
  const bool is_open = source_.open().ok;
  done = true;
  beater.join();
  ASSERT_TRUE(is_open);
  const auto tell = [&](const tubed_shm_image& lie, std::size_t bytes) {
    std::vector<std::byte> payload(bytes);
    std::memcpy(payload.data(), &lie, std::min(bytes, sizeof(lie)));
    liar.publish(payload, to_ns(monotonic_now()));
    return read_now();
  };
  const std::size_t right = sizeof(tubed_shm_image) + kWidth * kHeight;
  tubed_shm_image lie = image();
  lie.origin = 0;
  EXPECT_EQ(tell(lie, right), ReadOutcome::kRefused);
  lie = image();
  lie.depth_bits = 32;
  EXPECT_EQ(tell(lie, right), ReadOutcome::kRefused);
  lie = image();
  lie.width = 0xffffffff;
  lie.height = 0xffffffff;
  EXPECT_EQ(tell(lie, right), ReadOutcome::kRefused);
  EXPECT_EQ(tell(image(), right - 1), ReadOutcome::kRefused);
  EXPECT_EQ(tell(image(), 10), ReadOutcome::kRefused);
  EXPECT_EQ(tell(image(), right), ReadOutcome::kFrame);
}

TEST_F(ShmImageSourceTest, TheGeometryOfAnImageArrivesWithIt) {
  start_writer();
  ASSERT_TRUE(open().ok);
  tubed_shm_image sent = image();
  sent.geometry = TUBED_SHM_GEOMETRY;
  sent.fx = sent.fy = 1999.5F;
  sent.cx = 31.5F;
  sent.cy = 30.25F;
  sent.q_camera_world[0] = 0.6F;
  sent.q_camera_world[2] = 0.8F;
  sent.t_camera_world_mm[2] = 785.125F;
  sent.sigma_rotation_rad[1] = 0.25F;
  sent.sigma_translation_mm[2] = 1.5F;
  sent.pivot_depth_mm = 785;
  ASSERT_TRUE(writer_->put(sent, pixels_.data()));
  ASSERT_EQ(read_now(), ReadOutcome::kFrame);
  ASSERT_TRUE(frame_.geometry);
  const ViewGeometry& came = *frame_.geometry;
  EXPECT_EQ(came.fx, 1999.5);
  EXPECT_EQ(came.cy, 30.25);
  EXPECT_NEAR(came.q_camera_world[0], 0.6, 1e-7);
  EXPECT_NEAR(came.q_camera_world[2], 0.8, 1e-7);
  EXPECT_EQ(came.t_camera_world_mm, (std::array<double, 3>{0, 0, 785.125}));
  EXPECT_EQ(came.sigma.rotation_rad[1], 0.25);
  EXPECT_EQ(came.sigma.translation_mm[2], 1.5);
  EXPECT_EQ(came.sigma.pivot_depth_mm, 785);
  ASSERT_TRUE(writer_->put(image(), pixels_.data()));
  ASSERT_EQ(read_now(), ReadOutcome::kFrame);
  EXPECT_FALSE(frame_.geometry) << "of the image before";
}

TEST_F(ShmImageSourceTest, AGeometryOfAnUnknownKindIsRefused) {
  start_writer();
  ASSERT_TRUE(open().ok);
  tubed_shm_image sent = image();
  sent.geometry = 7;
  ASSERT_TRUE(writer_->put(sent, pixels_.data()));
  EXPECT_EQ(read_now(), ReadOutcome::kRefused);
  EXPECT_NE(source_.condition().words.text().find("of a kind that this version does not know"),
            std::string_view::npos);
}

TEST_F(ShmImageSourceTest, AWriterThatEndsIsLostAndItsNextStartIsFound) {
  start_writer();
  ASSERT_TRUE(open().ok);
  writer_.reset();
  EXPECT_EQ(read_now(), ReadOutcome::kLost);
  source_.close();
  EXPECT_NE(open().why.find("nobody writes at"), std::string::npos);
  start_writer();
  ASSERT_TRUE(open().ok);
  ASSERT_TRUE(writer_->put(image(), pixels_.data()));
  EXPECT_EQ(read_now(), ReadOutcome::kFrame);
}

TEST_F(ShmImageSourceTest, AnExposureFromBeforeARestartIsNotNewAfterIt) {
  start_writer();
  ASSERT_TRUE(open().ok);
  const tubed_shm_image seen = image();
  ASSERT_TRUE(writer_->put(seen, pixels_.data()));
  ASSERT_EQ(read_now(), ReadOutcome::kFrame);
  source_.close();
  writer_.reset();
  start_writer();
  ASSERT_TRUE(open().ok);
  ASSERT_TRUE(writer_->put(seen, pixels_.data()));
  EXPECT_EQ(read_now(), ReadOutcome::kRefused);
}

TEST_F(ShmImageSourceTest, WaitingEndsWhenAnImageIsThereAndTakesNone) {
  start_writer();
  ASSERT_TRUE(open().ok);
  const MonotonicTime soon = monotonic_now() + std::chrono::milliseconds(5);
  source_.wait(soon);
  EXPECT_GE(monotonic_now(), soon) << "there is none";
  ASSERT_TRUE(writer_->put(image(), pixels_.data()));
  const MonotonicTime began = monotonic_now();
  for (int i = 0; i < 3; ++i) {
    source_.wait(began + std::chrono::minutes(1));
  }
  EXPECT_LT(monotonic_now(), began + std::chrono::seconds(30));
  EXPECT_EQ(read_now(), ReadOutcome::kFrame);
  EXPECT_EQ(read_now(), ReadOutcome::kNothing);
}

TEST_F(ShmImageSourceTest, AWriterGoneMadDoesNotKeepTheThreadBusy) {
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

TEST_F(ShmImageSourceTest, AWriterThatRingsWithoutAnImageDoesNotKeepTheThreadBusyAndIsNamed) {
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
TEST_F(ShmImageSourceTest, AWriterOfTheFirstVersionIsStillRead) {
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

TEST_F(ShmImageSourceTest, AWriterOfALaterVersionIsRefusedWithBothVersions) {
  Liar later(folder_.socket(), 4096, 3);
  const Busily beating([&] { later.beat(); });
  EXPECT_NE(source_.open().why.find("images of version 3, expected images of version 2"), std::string::npos);
}

TEST_F(ShmImageSourceTest, NumbersThatGoBackwardsDoNotKeepTheThreadBusy) {
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

TEST_F(ShmImageSourceTest, MemoryLargerThanTheCameraCouldNeedIsRefused) {
  Liar liar(folder_.socket(), std::uint64_t{16} * kWidth * kHeight * 2);
  const Busily beating([&] { liar.beat(); });
  const OpenResult result = source_.open();
  EXPECT_FALSE(result.ok);
  EXPECT_NE(result.why.find("expected at most"), std::string::npos) << result.why;
}

TEST_F(ShmImageSourceTest, ItSaysWhetherItWaitsForTheFirstImageOrForTheNext) {
  EXPECT_EQ(source_.condition().state, DeviceState::kStarting);
  start_writer();
  ASSERT_TRUE(open().ok);
  ASSERT_TRUE(writer_->put(image(), pixels_.data()));
  ASSERT_EQ(read_now(), ReadOutcome::kFrame);
  EXPECT_EQ(source_.condition().state, DeviceState::kRunning);
  EXPECT_TRUE(source_.condition().words.empty());
  writer_.reset();
  EXPECT_EQ(read_now(), ReadOutcome::kLost);
  source_.close();
  start_writer();
  ASSERT_TRUE(open().ok);
  EXPECT_EQ(source_.condition().state, DeviceState::kReconnecting);
}

TEST_F(ShmImageSourceTest, ADeadWriterIsLostWithin250Ms) {
  start_writer();
  ASSERT_TRUE(open().ok);
  writer_->beat();  // its last sign of life
  const MonotonicTime died = monotonic_now();
  EXPECT_EQ(read_until(source_, frame_, died + std::chrono::seconds(60)), ReadOutcome::kLost);
  EXPECT_LT(seconds_between(died, monotonic_now()), 0.25);
}

TEST_F(ShmImageSourceTest, TheImagesOfAnotherCameraAreNotTaken) {
  start_writer();
  ShmImageSource other(camera_named("B"), folder_.socket(), {geteuid()});
  std::atomic<bool> done{false};
  std::thread beater([&] {
    while (!done) {
      writer_->beat();
    }
  });
  const OpenResult result = other.open();
  done = true;
  beater.join();
  EXPECT_FALSE(result.ok);
  EXPECT_NE(result.why.find("grabs camera 'A', expected 'B'"), std::string::npos) << result.why;
}

TEST_F(ShmImageSourceTest, AWriterRefusesWhatDoesNotFit) {
  start_writer();
  tubed_shm_image bad = image(16);
  bad.width = 65;
  bad.height = 64;
  EXPECT_FALSE(writer_->put(bad, pixels_.data()));
  bad = image();
  bad.depth_bits = 12;
  EXPECT_FALSE(writer_->put(bad, pixels_.data()));
  bad = image();
  bad.origin = 0;
  EXPECT_FALSE(writer_->put(bad, pixels_.data()));
  EXPECT_FALSE(writer_->put(image(), nullptr));
}

TEST(ImageShmDriver, ACameraWithoutDeviceHasASocketOfItsName) {
  EXPECT_EQ(image_shm_socket("", "lateral", "/etc/tubed"), "/run/tubed/image-lateral.sock");
  EXPECT_EQ(image_shm_socket("a.sock", "lateral", "/etc/tubed"), "/etc/tubed/a.sock");
  EXPECT_EQ(image_shm_socket("/tmp/a.sock", "lateral", "/etc/tubed"), "/tmp/a.sock");
}

TEST(ImageShmDriver, AUserWhoDoesNotExistIsAnError) {
  RoomDescription room;
  room.cameras = {camera_named("A")};
  const DriverSettings settings({{"user", std::string("no-such-user-here")}});
  EXPECT_THROW(make_shm_image_source(room, settings, "/tmp/a.sock", 0), std::runtime_error);
}

}  // namespace
}  // namespace tubed
