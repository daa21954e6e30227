#include "drivers/image_shm/shm_image_source.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <thread>

#include "clients/cpp/shm_image_writer.hpp"
#include "drivers/image_shm/image_shm_driver.hpp"
#include "drivers/interface/monotonic_clock.hpp"
#include "drivers/interface/read_until.hpp"
#include "tests/drivers/image_shm/shm_image_source_bed.hpp"

namespace tubed {
namespace {

using ShmImageSourceTest = ShmImageSourceBed;

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
