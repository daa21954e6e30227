#include "clients/cpp/shm_tube_reader.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <cstring>
#include <memory>
#include <span>
#include <thread>

#include "clients/cpp/tubed_shm.h"
#include "tests/idl/shm_bed.hpp"

namespace tubed {
namespace {

using std::chrono::milliseconds;

ShmWriterSettings daemon_at(const std::string& socket) {
  return {.door = {.path = socket, .group = {}},
          .geometry = {8, sizeof(tubed_shm_estimate)},
          .identity = {TUBED_SHM_ESTIMATES, TUBED_SHM_ESTIMATES_VERSION, "tubed", 0}};
}

/// Plays the daemon: publishes estimates, and beats while `use` runs.
class PlayedDaemon {
 public:
  explicit PlayedDaemon(const std::string& socket, std::uint64_t start = 1)
      : start_(start), writer_(daemon_at(socket), shm_test_now_ns()) {}

  void publish(std::uint64_t number, const char* instrument = "cath-1", std::int64_t age_ns = 0) {
    tubed_shm_estimate estimate{};
    std::strcpy(estimate.instrument_id, instrument);
    estimate.sequence_number = number;
    estimate.daemon_start = start_;
    estimate.points[127].p_world_mm[2] = static_cast<double>(number);
    publish(estimate, age_ns);
  }

  void publish(const tubed_shm_estimate& estimate, std::int64_t age_ns = 0) {
    writer_.publish(std::as_bytes(std::span(&estimate, 1)), shm_test_now_ns() - age_ns);
  }

  template <typename Function>
  void while_beating(Function&& use) {
    std::atomic<bool> done{false};
    std::thread beater([&] {
      while (!done) {
        writer_.beat(shm_test_now_ns());
        std::this_thread::yield();
      }
    });
    use();
    done = true;
    beater.join();
  }

 private:
  std::uint64_t start_;
  ShmWriter writer_;
};

void connect(ShmTubeReader& reader, PlayedDaemon& daemon) {
  daemon.while_beating([&] {
    while (!reader.why().empty()) {
      reader.wait_for(milliseconds(5));
    }
  });
}

class ShmTubeReaderTest : public ::testing::Test {
 protected:
  ShmFolder folder_;
  ShmTubeReader reader_{
      {.socket = folder_.socket(), .instrument_id = {}, .delivery = ShmDelivery::kEvery, .trusted = {}}};
};

TEST_F(ShmTubeReaderTest, EveryShapeArrivesWholeAndInOrder) {
  PlayedDaemon daemon(folder_.socket());
  connect(reader_, daemon);
  for (std::uint64_t number = 1; number <= 3; ++number) {
    daemon.publish(number);
  }
  for (std::uint64_t number = 1; number <= 3; ++number) {
    const ShmTubeNews news = reader_.wait_for(milliseconds(0));
    ASSERT_EQ(news.event, ShmTubeEvent::kEstimate);
    EXPECT_EQ(news.estimate->sequence_number, number);
    EXPECT_EQ(news.estimate->points[127].p_world_mm[2], static_cast<double>(number));
    EXPECT_EQ(news.lost_before, 0U);
  }
  EXPECT_EQ(reader_.wait_for(milliseconds(0)).event, ShmTubeEvent::kTimeout);
}

TEST_F(ShmTubeReaderTest, ShapesThatWereOverwrittenAreCounted) {
  PlayedDaemon daemon(folder_.socket());
  connect(reader_, daemon);
  for (std::uint64_t number = 1; number <= 20; ++number) {
    daemon.publish(number);
  }
  const ShmTubeNews news = reader_.wait_for(milliseconds(0));
  EXPECT_EQ(news.estimate->sequence_number, 14U);  // of eight slots seven are safe
  EXPECT_EQ(news.lost_before, 13U);
}

TEST_F(ShmTubeReaderTest, AnOldShapeIsNotHandedOver) {
  PlayedDaemon daemon(folder_.socket());
  connect(reader_, daemon);
  daemon.publish(1, "cath-1", 210'000'000);
  daemon.publish(2);
  const ShmTubeNews news = reader_.wait_for(milliseconds(0));
  EXPECT_EQ(news.estimate->sequence_number, 2U);
  EXPECT_EQ(news.lost_before, 1U);
}

TEST_F(ShmTubeReaderTest, ADaemonThatStopsIsMissedAfter100AndLostWithin250Ms) {
  PlayedDaemon daemon(folder_.socket());
  connect(reader_, daemon);
  daemon.publish(1);
  ASSERT_EQ(reader_.wait_for(milliseconds(0)).event, ShmTubeEvent::kEstimate);
  const std::int64_t stopped_ns = shm_test_now_ns();
  EXPECT_EQ(reader_.wait_for(milliseconds(5000)).event, ShmTubeEvent::kDeadlineMissed);
  EXPECT_EQ(reader_.wait_for(milliseconds(5000)).event, ShmTubeEvent::kLivelinessLost);
  EXPECT_LT(shm_test_now_ns() - stopped_ns, 250'000'000);
  EXPECT_EQ(reader_.wait_for(milliseconds(1)).event, ShmTubeEvent::kTimeout);  // said once
}

TEST_F(ShmTubeReaderTest, ARestartedDaemonIsFoundAndSaidToBeAnother) {
  auto first = std::make_unique<PlayedDaemon>(folder_.socket(), 1);
  connect(reader_, *first);
  first->publish(1);
  ASSERT_EQ(reader_.wait_for(milliseconds(0)).event, ShmTubeEvent::kEstimate);
  first.reset();
  EXPECT_EQ(reader_.wait_for(milliseconds(5000)).event, ShmTubeEvent::kWriterGone);
  EXPECT_FALSE(reader_.why().empty());
  PlayedDaemon second(folder_.socket(), 2);
  connect(reader_, second);
  second.publish(1);
  const ShmTubeNews news = reader_.wait_for(milliseconds(0));
  ASSERT_EQ(news.event, ShmTubeEvent::kEstimate);
  EXPECT_TRUE(news.is_restart);
}

TEST_F(ShmTubeReaderTest, OnlyTheInstrumentAskedForIsHandedOver) {
  PlayedDaemon daemon(folder_.socket());
  ShmTubeReader reader({.socket = folder_.socket(),
                        .instrument_id = "cath-2",
                        .delivery = ShmDelivery::kEvery,
                        .trusted = {}});
  connect(reader, daemon);
  daemon.publish(1, "cath-1");
  daemon.publish(1, "cath-2");
  EXPECT_STREQ(reader.wait_for(milliseconds(0)).estimate->instrument_id, "cath-2");
}

TEST_F(ShmTubeReaderTest, WhoNeverWaitsIsConnectedToo) {
  PlayedDaemon daemon(folder_.socket());
  EXPECT_EQ(reader_.wait_for(milliseconds(0)).event, ShmTubeEvent::kTimeout);
  EXPECT_NE(reader_.why().find("has not answered yet"), std::string::npos) << reader_.why();
  daemon.publish(1);  // lets in who waits at the door
  reader_.wait_for(milliseconds(0));
  EXPECT_EQ(reader_.why(), "");
}

TEST_F(ShmTubeReaderTest, TheNewestOfEachInstrumentIsHandedOverToALateReader) {
  PlayedDaemon daemon(folder_.socket());
  ShmTubeReader all(
      {.socket = folder_.socket(), .instrument_id = {}, .delivery = ShmDelivery::kNewest, .trusted = {}});
  ShmTubeReader one({.socket = folder_.socket(),
                     .instrument_id = "cath-1",
                     .delivery = ShmDelivery::kNewest,
                     .trusted = {}});
  connect(all, daemon);
  connect(one, daemon);
  for (std::uint64_t number = 1; number <= 3; ++number) {
    daemon.publish(number, "cath-1");
    daemon.publish(number, "cath-2");
  }
  for (const char* instrument : {"cath-1", "cath-2"}) {
    const ShmTubeNews news = all.wait_for(milliseconds(0));
    ASSERT_EQ(news.event, ShmTubeEvent::kEstimate);
    EXPECT_STREQ(news.estimate->instrument_id, instrument);
    EXPECT_EQ(news.estimate->sequence_number, 3U);
  }
  EXPECT_EQ(all.wait_for(milliseconds(0)).event, ShmTubeEvent::kTimeout);
  EXPECT_EQ(one.wait_for(milliseconds(0)).estimate->sequence_number, 3U);
}

TEST_F(ShmTubeReaderTest, AShapeWithMorePointsThanItHasRoomForIsNotHandedOver) {
  PlayedDaemon daemon(folder_.socket());
  connect(reader_, daemon);
  const auto lie = [&](auto&& about) {
    tubed_shm_estimate estimate{};
    about(estimate);
    daemon.publish(estimate);
    return reader_.wait_for(milliseconds(0)).event;
  };
  EXPECT_EQ(lie([](tubed_shm_estimate& e) { e.point_count = 129; }), ShmTubeEvent::kTimeout);
  EXPECT_EQ(lie([](tubed_shm_estimate& e) { e.view_count = 5; }), ShmTubeEvent::kTimeout);
  EXPECT_EQ(lie([](tubed_shm_estimate& e) {
              const std::uint8_t two = 2;
              std::memcpy(&e.views[3].has_own_geometry, &two, 1);
            }),
            ShmTubeEvent::kTimeout);
  EXPECT_EQ(lie([](tubed_shm_estimate& e) { e.coefficient_count = 65; }), ShmTubeEvent::kTimeout);
  EXPECT_EQ(lie([](tubed_shm_estimate& e) { e.coil_count = 17; }), ShmTubeEvent::kTimeout);
  EXPECT_EQ(lie([](tubed_shm_estimate& e) { std::memset(&e.has_image, 2, 1); }), ShmTubeEvent::kTimeout);
  EXPECT_EQ(lie([](tubed_shm_estimate& e) { std::memset(e.instrument_id, 'x', 65); }),
            ShmTubeEvent::kTimeout);
  EXPECT_EQ(lie([](tubed_shm_estimate& e) { e.point_count = 128; }), ShmTubeEvent::kEstimate);
}

TEST_F(ShmTubeReaderTest, AShapeOfAnotherTimeIsNotHandedOver) {
  PlayedDaemon daemon(folder_.socket());
  connect(reader_, daemon);
  for (const std::int64_t age_ns : {std::int64_t{-300'000'000}, std::int64_t{4'000'000'000'000'000'000}}) {
    daemon.publish(1, "cath-1", age_ns);
    EXPECT_NE(reader_.wait_for(milliseconds(0)).event, ShmTubeEvent::kEstimate) << age_ns;
  }
}

TEST_F(ShmTubeReaderTest, WithoutADaemonItSaysWhy) {
  EXPECT_EQ(reader_.wait_for(milliseconds(1)).event, ShmTubeEvent::kTimeout);
  EXPECT_NE(reader_.why().find("nobody writes at"), std::string::npos);
}

TEST_F(ShmTubeReaderTest, TheCFunctionsGiveTheSame) {
  PlayedDaemon daemon(folder_.socket());
  tubed_estimate_reader* reader = tubed_estimate_reader_open(folder_.socket().c_str(), nullptr);
  auto estimate = std::make_unique<tubed_shm_estimate>();
  daemon.while_beating([&] {
    while (tubed_estimate_reader_why(reader)[0] != '\0') {
      tubed_estimate_reader_wait(reader, estimate.get(), 5);
    }
  });
  daemon.publish(7);
  EXPECT_EQ(tubed_estimate_reader_wait(reader, estimate.get(), 0), TUBED_ESTIMATE);
  EXPECT_EQ(estimate->sequence_number, 7U);
  tubed_estimate_reader_close(reader);
}

TEST_F(ShmTubeReaderTest, ACWriterThatCannotBeOpenedSaysWhy) {
  char why[64] = "";
  const tubed_image_writer_settings nowhere{"/no/such/folder/a.sock", "A", 8, 8, 8, -1};
  EXPECT_EQ(tubed_image_writer_open(&nowhere, why, sizeof(why)), nullptr);
  EXPECT_NE(std::string(why).find("cannot bind"), std::string::npos) << why;
  const std::string socket = folder_.socket();  // the settings only point to it
  const tubed_image_writer_settings empty{socket.c_str(), "A", 0, 8, 8, -1};
  EXPECT_EQ(tubed_image_writer_open(&empty, nullptr, 0), nullptr);
  // Cut to 32 bits it would be root's.
  const tubed_image_writer_settings group{socket.c_str(), "A", 8, 8, 8, std::int64_t{1} << 32U};
  EXPECT_EQ(tubed_image_writer_open(&group, why, sizeof(why)), nullptr);
  EXPECT_NE(std::string(why).find("no group 4294967296"), std::string::npos) << why;
}

}  // namespace
}  // namespace tubed
