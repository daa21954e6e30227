#include "daemon/publishing/shm_publisher.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <memory>
#include <optional>
#include <span>
#include <thread>

#include "idl/shm_reader.hpp"
#include "tests/idl/shm_bed.hpp"

namespace tubed {
namespace {

ShmReaderSettings estimates_at(const std::string& socket) {
  return {.path = socket,
          .content = TUBED_SHM_ESTIMATES,
          .content_version = TUBED_SHM_ESTIMATES_VERSION,
          .timeout_ms = 5000,
          .trusted = {}};
}

TEST(ShmPublisher, AnEstimateIsReadAsDdsWouldCarryIt) {
  const ShmFolder folder;
  ShmPublisher publisher({folder.socket(), ""}, {"left", "right"}, 4711);
  auto estimate = std::make_unique<TubeEstimate>();
  std::atomic<bool> done{false};
  std::thread daemon([&] {
    while (!done) {
      publisher.publish(*estimate);  // also what lets readers in
    }
  });
  ShmReader reader(estimates_at(folder.socket()));
  done = true;
  daemon.join();
  estimate->instrument = 1;
  estimate->sequence_number = 99;
  estimate->valid_time_ns = 1000;
  estimate->validity = Validity::kQuestionable;
  estimate->reasons.add(Reason::kImageStale);
  estimate->has_image = true;
  estimate->point_count = 2;
  estimate->points[1].p_world_mm = {1, 2, 3};
  estimate->points[1].covariance_mm2[5] = 0.25F;
  estimate->coil_count = 1;
  estimate->coils[0].position_mm = std::nanf("");
  estimate->stamps.exposure_ns = 900;

  publisher.publish(*estimate, {5000, 1'000'000});

  ASSERT_EQ(reader.news(5000), ShmNews::kSample);
  const ShmSample sample = reader.take_newest();
  auto got = std::make_unique<tubed_shm_estimate>();
  ASSERT_TRUE(sample.copy(0, std::as_writable_bytes(std::span(got.get(), 1))) && sample.whole());
  EXPECT_STREQ(got->instrument_id, "right");
  EXPECT_EQ(got->sequence_number, 99U);
  EXPECT_EQ(got->daemon_start, 4711U);
  EXPECT_EQ(got->valid_time_monotonic_ns, 1000);
  EXPECT_EQ(got->valid_time_ns, 996'000);
  EXPECT_EQ(got->publish_time_ns, 1'000'000);
  EXPECT_EQ(got->validity, 2U);
  EXPECT_EQ(got->reasons, 64U);
  EXPECT_TRUE(got->has_image);
  EXPECT_EQ(got->points[1].p_world_mm[2], 3.0);
  EXPECT_EQ(got->points[1].covariance_mm2[5], 0.25F);
  EXPECT_TRUE(std::isnan(got->coils[0].position_mm));
  EXPECT_EQ(got->stamps.exposure_monotonic_ns, 900);
  EXPECT_EQ(got->stamps.publish_started_monotonic_ns, 5000);
}

TEST(ShmPublisher, FewReadersLeaveNothingForAnotherThreadToWake) {
  const ShmFolder folder;
  ShmPublisher publisher({folder.socket(), ""}, {"left"}, 1);
  EXPECT_FALSE(publisher.publish(*std::make_unique<TubeEstimate>()));
}

TEST(ShmPublisher, AGroupThatDoesNotExistIsAnError) {
  const ShmFolder folder;
  EXPECT_THROW(ShmPublisher({folder.socket(), "no-such-group-here"}, {"left"}, 1), ShmError);
}

}  // namespace
}  // namespace tubed
