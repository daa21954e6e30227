#include "drivers/image_shm/shm_image_source.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <optional>
#include <thread>

#include "clients/cpp/shm_image_writer.hpp"
#include "drivers/image_shm/image_shm_driver.hpp"
#include "drivers/interface/monotonic_clock.hpp"
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
            .most_width = 64,
            .most_height = 64,
            .most_depth_bits = 16,
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

  ReadOutcome read_now() { return source_.read(frame_, monotonic_now()); }

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
  EXPECT_EQ(read_now(), ReadOutcome::kTimeout);
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
    looks += source_.read(frame_, until) == ReadOutcome::kRefused ? 1 : 0;
  }
  done = true;
  mad.join();
  EXPECT_GT(looks, 32);
  EXPECT_LE(looks, 32 + 50 + 1);
}

TEST_F(ShmImageSourceTest, ADeadWriterIsLostWithin250Ms) {
  start_writer();
  ASSERT_TRUE(open().ok);
  writer_->beat();  // its last sign of life
  const MonotonicTime died = monotonic_now();
  EXPECT_EQ(source_.read(frame_, died + std::chrono::seconds(60)), ReadOutcome::kLost);
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
