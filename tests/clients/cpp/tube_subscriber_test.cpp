#include "clients/cpp/tube_subscriber.hpp"

#include <unistd.h>

#include <cstring>
#include <memory>
#include <set>
#include <vector>

#include "clients/cpp/topic_reader.hpp"
#include "idl/dds_contract.hpp"
#include "tests/support/own_namespace.hpp"

namespace tubed {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using std::chrono::steady_clock;

std::string own_partition() { return ::testing::UnitTest::GetInstance()->current_test_info()->name(); }

Subscription own_subscription() {
  Subscription subscription;
  subscription.partition = own_partition();
  return subscription;
}

/// Writes whatever sequence number and start a test wants: a daemon, or somebody who replays one.
class ScriptedWriter {
 public:
  ScriptedWriter()
      : participant_(join_domain(0, "lo")),
        writer_(make_writer(participant_, contract_of<tubed_TubeEstimate>(), own_partition())) {}

  void wait_for_subscriber() const {
    dds_publication_matched_status_t matched{};
    while (matched.current_count == 0) {
      dds_sleepfor(DDS_MSECS(1));
      require_dds(dds_get_publication_matched_status(writer_.get(), &matched), "ask for subscribers");
    }
  }

  void write(std::uint64_t daemon_start, std::uint64_t sequence_number, std::int64_t time = 0,
             const char* instrument_id = "catheter") {
    auto sample = std::make_unique<tubed_TubeEstimate>();
    std::strcpy(sample->instrument_id, instrument_id);
    sample->daemon_start = daemon_start;
    sample->sequence_number = sequence_number;
    sample->publish_time_ns = time == 0 ? dds_time() : time;
    sample->stamps.publish_started_monotonic_ns = sample->publish_time_ns;
    require_dds(dds_write(writer_.get(), sample.get()), "write");
  }

 private:
  DdsEntity participant_;
  DdsEntity writer_;
};

class TubeSubscriberTest : public DdsTest {};

TEST_F(TubeSubscriberTest, AnEstimateIsHandedOverOnceAndNeverAgain) {
  TubeSubscriber subscriber(own_subscription());
  ScriptedWriter writer;
  writer.wait_for_subscriber();
  writer.write(9, 5);

  const TubeNews news = subscriber.wait_for(seconds(5));

  ASSERT_EQ(news.event, TubeEvent::kEstimate);
  EXPECT_EQ(news.sample->estimate.sequence_number, 5U);
  EXPECT_EQ(news.instrument_id, "catheter");
  EXPECT_EQ(subscriber.take().event, TubeEvent::kTimeout);
  EXPECT_EQ(subscriber.take().sample, nullptr);
  EXPECT_TRUE(subscriber.status().is_alive);
}

TEST_F(TubeSubscriberTest, AWriterThatHangsIsToldAfter100And250Milliseconds) {
  TubeSubscriber subscriber(own_subscription());
  ScriptedWriter writer;
  writer.wait_for_subscriber();
  writer.write(9, 1);
  ASSERT_EQ(subscriber.wait_for(seconds(5)).event, TubeEvent::kEstimate);
  const auto last_sample = steady_clock::now();

  const TubeNews first = subscriber.wait_for(seconds(5));
  const auto told_late = steady_clock::now() - last_sample;
  const TubeNews second = subscriber.wait_for(seconds(5));
  const auto told_lost = steady_clock::now() - last_sample;

  EXPECT_EQ(first.event, TubeEvent::kDeadlineMissed);
  EXPECT_EQ(first.sample, nullptr);
  EXPECT_EQ(second.event, TubeEvent::kLivelinessLost);
  EXPECT_EQ(second.sample, nullptr);
  EXPECT_GT(told_late, milliseconds(80));
  EXPECT_GT(told_lost, milliseconds(200));
  EXPECT_LT(told_lost, milliseconds(350));  // 250 and the noise of a shared machine
  EXPECT_FALSE(subscriber.status().is_alive);
  EXPECT_EQ(subscriber.wait_for(milliseconds(300)).event, TubeEvent::kTimeout);  // said once
}

TEST_F(TubeSubscriberTest, AWriterThatComesBackIsAliveAgain) {
  TubeSubscriber subscriber(own_subscription());
  ScriptedWriter writer;
  writer.wait_for_subscriber();
  writer.write(9, 1);
  while (subscriber.wait_for(seconds(5)).event != TubeEvent::kLivelinessLost) {
  }

  writer.write(9, 2);

  EXPECT_EQ(subscriber.wait_for(seconds(5)).event, TubeEvent::kEstimate);
  EXPECT_EQ(subscriber.take().event, TubeEvent::kTimeout);
  EXPECT_TRUE(subscriber.status().is_alive);
}

TEST_F(TubeSubscriberTest, AWriterThatSaysGoodbyeIsToldAtOnce) {
  TubeSubscriber subscriber(own_subscription());
  auto writer = std::make_unique<ScriptedWriter>();
  writer->wait_for_subscriber();
  writer->write(9, 1);
  ASSERT_EQ(subscriber.wait_for(seconds(5)).event, TubeEvent::kEstimate);

  writer.reset();

  EXPECT_EQ(subscriber.wait_for(milliseconds(90)).event, TubeEvent::kWriterGone);
}

TEST_F(TubeSubscriberTest, ReplayedSamplesAreDroppedAndCounted) {
  TubeSubscriber subscriber(own_subscription(), Delivery::kEvery);
  ScriptedWriter writer;
  writer.wait_for_subscriber();
  writer.write(9, 10, 1000);
  ASSERT_EQ(subscriber.wait_for(seconds(5)).event, TubeEvent::kEstimate);

  writer.write(9, 9, 1001);   // a number from before
  writer.write(9, 10, 1002);  // the same again
  writer.write(9, 11, 999);   // a time from before
  writer.write(7, 1, 500);    // another start, from before
  writer.write(9, 12, 1003);

  const TubeNews news = subscriber.wait_for(seconds(5));
  ASSERT_EQ(news.event, TubeEvent::kEstimate);
  EXPECT_EQ(news.sample->estimate.sequence_number, 12U);
  EXPECT_EQ(news.sample->lost_before, 1U);
  EXPECT_EQ(subscriber.status().lost, 1U);
  EXPECT_EQ(subscriber.status().refused_backward, 3U);
  EXPECT_EQ(subscriber.status().refused_rival, 1U);
}

TEST_F(TubeSubscriberTest, ReplayedSamplesDoNotKeepADeadDaemonAlive) {
  TubeSubscriber subscriber(own_subscription());
  ScriptedWriter writer;
  writer.wait_for_subscriber();
  writer.write(9, 10);
  ASSERT_EQ(subscriber.wait_for(seconds(5)).event, TubeEvent::kEstimate);

  TubeEvent event = TubeEvent::kTimeout;
  for (int i = 0; i < 100 && event != TubeEvent::kLivelinessLost; ++i) {
    writer.write(9, 10);
    event = subscriber.wait_for(milliseconds(10)).event;
    ASSERT_NE(event, TubeEvent::kEstimate);
  }

  EXPECT_EQ(event, TubeEvent::kLivelinessLost);
  EXPECT_GT(subscriber.status().refused_backward, 5U);
}

TEST_F(TubeSubscriberTest, ARestartedDaemonIsAcceptedAtItsThirdSampleAndSaidToBeOne) {
  TubeSubscriber subscriber(own_subscription());
  auto first = std::make_unique<ScriptedWriter>();
  first->wait_for_subscriber();
  first->write(9, 5000);
  ASSERT_EQ(subscriber.wait_for(seconds(5)).event, TubeEvent::kEstimate);
  first.reset();
  ASSERT_EQ(subscriber.wait_for(seconds(5)).event, TubeEvent::kWriterGone);

  ScriptedWriter second;
  second.wait_for_subscriber();
  TubeNews news;
  for (std::uint64_t number = 1; number <= 3; ++number) {
    EXPECT_EQ(news.sample, nullptr);
    second.write(8, number);
    news = subscriber.wait_for(milliseconds(33));
  }

  ASSERT_EQ(news.event, TubeEvent::kEstimate);
  EXPECT_EQ(news.sample->estimate.sequence_number, 3U);
  EXPECT_TRUE(news.sample->is_restart);
  EXPECT_EQ(subscriber.status().restarts, 1U);
}

/// Publishes 30 times a second, as a daemon does, while a subscriber listens.
class Daemon {
 public:
  explicit Daemon(std::uint64_t start) : start_(start) { writer_.wait_for_subscriber(); }
  void write() { writer_.write(start_, ++number_); }

 private:
  ScriptedWriter writer_;
  std::uint64_t start_;
  std::uint64_t number_ = 0;
};

/// Everything that is told within a period of 33 ms.
std::vector<TubeNews> period(TubeSubscriber& subscriber) {
  std::vector<TubeNews> all;
  const auto until = steady_clock::now() + milliseconds(33);
  while (steady_clock::now() < until) {
    const TubeNews news = subscriber.wait_for(
        std::chrono::duration_cast<milliseconds>(until - steady_clock::now()) + milliseconds(1));
    if (news.event != TubeEvent::kTimeout) all.push_back(news);
  }
  return all;
}

TEST_F(TubeSubscriberTest, ARivalIsToldWithItsProcessAndNothingOfItIsHandedOver) {
  TubeSubscriber subscriber(own_subscription(), Delivery::kEvery);
  Daemon real(9);
  real.write();
  ASSERT_EQ(subscriber.wait_for(seconds(5)).event, TubeEvent::kEstimate);

  std::vector<TubeEvent> told;
  std::string who;
  {
    Daemon rival(8);
    for (int k = 0; k < 20; ++k) {
      rival.write();
      real.write();
      for (const TubeNews& news : period(subscriber)) {
        EXPECT_TRUE(news.sample == nullptr || news.sample->estimate.daemon_start == 9U);
        if (news.event == TubeEvent::kRivalSeen) who = news.rival;
        if (news.event != TubeEvent::kEstimate) told.push_back(news.event);
      }
    }
    EXPECT_EQ(subscriber.status().rivals, 1U);
  }
  for (const TubeNews& news : period(subscriber)) {
    if (news.event != TubeEvent::kEstimate) told.push_back(news.event);
  }

  EXPECT_EQ(told, (std::vector{TubeEvent::kRivalSeen, TubeEvent::kRivalGone}));
  EXPECT_NE(who.find("clients_cpp_tes"), std::string::npos) << who;
  EXPECT_NE(who.find("process " + std::to_string(getpid())), std::string::npos) << who;
  EXPECT_NE(who.find("DDS writer "), std::string::npos) << who;
  EXPECT_EQ(subscriber.status().refused_rival, 20U);
  EXPECT_EQ(subscriber.status().rivals, 0U);
}

TEST_F(TubeSubscriberTest, AForgedSampleWithAHugeNumberMakesNobodyDeaf) {
  TubeSubscriber subscriber(own_subscription(), Delivery::kEvery);
  Daemon real(9);
  real.write();
  ASSERT_EQ(subscriber.wait_for(seconds(5)).event, TubeEvent::kEstimate);
  ScriptedWriter forger;
  forger.wait_for_subscriber();

  int heard = 0;
  for (int k = 0; k < 10; ++k) {
    forger.write(9, std::uint64_t{1} << 60U);
    real.write();
    for (const TubeNews& news : period(subscriber)) heard += news.sample != nullptr ? 1 : 0;
  }

  EXPECT_EQ(heard, 10);
  EXPECT_EQ(subscriber.status().refused_implausible, 10U);
}

TEST_F(TubeSubscriberTest, EightInstrumentsAreHeardAndInventedOnesBeyondThemAreCounted) {
  TubeSubscriber subscriber(own_subscription(), Delivery::kEvery);
  Daemon real(9);
  ScriptedWriter forger;
  forger.wait_for_subscriber();

  std::set<std::string> heard;
  int real_heard = 0;
  for (int k = 0; k < 10; ++k) {
    real.write();
    for (int i = 0; i < 20; ++i) forger.write(7, 1, 0, ("invented-" + std::to_string(20 * k + i)).c_str());
    for (const TubeNews& news : period(subscriber)) {
      if (news.sample != nullptr) heard.emplace(news.instrument_id);
      real_heard += news.sample != nullptr && news.instrument_id == "catheter" ? 1 : 0;
    }
  }

  EXPECT_EQ(real_heard, 10);
  // Seven beside the real one, and after 200 ms of silence seven others in their places.
  EXPECT_GE(heard.size(), 8U);
  EXPECT_LE(heard.size(), 1U + 2 * 7U);
  EXPECT_GE(subscriber.status().refused_instruments, 180U - 14U);
}

TEST_F(TubeSubscriberTest, ABusySubscriberGetsTheNewestAndIsToldHowManyItNeverGot) {
  TubeSubscriber subscriber(own_subscription());
  ScriptedWriter writer;
  writer.wait_for_subscriber();
  writer.write(9, 1);
  ASSERT_EQ(subscriber.wait_for(seconds(5)).event, TubeEvent::kEstimate);
  for (const std::uint64_t number : {2U, 3U, 6U}) {
    writer.write(9, number);
    dds_sleepfor(DDS_MSECS(20));  // the network, not the test, decides when a sample is there
  }

  const TubeNews news = subscriber.take();

  ASSERT_EQ(news.event, TubeEvent::kEstimate);
  EXPECT_EQ(news.sample->estimate.sequence_number, 6U);
  EXPECT_EQ(news.sample->lost_before, 2U);
}

TEST_F(TubeSubscriberTest, OneInstrumentIsSilentWhileAnotherSpeaks) {
  TubeSubscriber subscriber(own_subscription());
  ScriptedWriter writer;
  writer.wait_for_subscriber();
  writer.write(9, 1, 0, "silent");
  ASSERT_EQ(subscriber.wait_for(seconds(5)).event, TubeEvent::kEstimate);

  std::string lost;
  for (std::uint64_t i = 1; i < 100 && lost.empty(); ++i) {
    writer.write(9, i, 0, "speaking");
    dds_sleepfor(DDS_MSECS(10));
    TubeNews news = subscriber.take();
    while (news.event == TubeEvent::kEstimate) {
      news = subscriber.take();
    }
    if (news.event == TubeEvent::kLivelinessLost) {
      lost = news.instrument_id;
    }
  }

  EXPECT_EQ(lost, "silent");
}

TEST_F(TubeSubscriberTest, OtherInstrumentsAreNotHeard) {
  Subscription subscription = own_subscription();
  subscription.instrument_id = "wanted";
  TubeSubscriber subscriber(subscription);
  ScriptedWriter writer;
  writer.wait_for_subscriber();
  writer.write(9, 1, 0, "other");
  writer.write(9, 2, 0, "wanted");

  const TubeNews news = subscriber.wait_for(seconds(5));

  ASSERT_EQ(news.event, TubeEvent::kEstimate);
  EXPECT_STREQ(news.sample->estimate.instrument_id, "wanted");
}

TEST_F(TubeSubscriberTest, AnUnknownInterfaceIsAnErrorThatNamesIt) {
  Subscription subscription;
  subscription.domain = 7;
  subscription.network_interface = "nosuch0";

  EXPECT_THROW(TubeSubscriber{subscription}, DdsError);
}

TEST_F(TubeSubscriberTest, TheIdentityReachesALateJoiner) {
  const DdsEntity participant = join_domain(0, "lo");
  const DdsEntity writer = make_writer(participant, contract_of<tubed_TubeIdentity>(), own_partition());
  auto identity = std::make_unique<tubed_TubeIdentity>();
  std::strcpy(identity->instrument_id, "catheter");
  identity->diameter_mm = 2.5F;
  require_dds(dds_write(writer.get(), identity.get()), "write the identity");

  TopicReader<tubed_TubeIdentity> late(own_subscription());

  const tubed_TubeIdentity* received = late.wait_for(seconds(5));
  ASSERT_NE(received, nullptr);
  EXPECT_STREQ(received->instrument_id, "catheter");
  EXPECT_EQ(received->diameter_mm, 2.5F);
}

}  // namespace
}  // namespace tubed
