#include "daemon/publishing/dds_publisher.hpp"

#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>

#include <cstring>
#include <stdexcept>

#include "daemon/publishing/wire_conversion.hpp"
#include "idl/dds_contract.hpp"
#include "tests/daemon/publishing/distinct_values.hpp"
#include "tests/support/own_namespace.hpp"

namespace tubed {
namespace {

constexpr ClockPair kNow{.monotonic_ns = 1'000'000, .realtime_ns = 5'000'000};
constexpr const char* kStoppedPartition = "stopped";

/// A bare reader of one topic, and the wait for what it expects.
template <typename Sample>
class BareReader {
 public:
  explicit BareReader(const std::string& partition)
      : participant_(join_domain(0, "lo")),
        reader_(make_reader(participant_, contract_of<Sample>(), partition, 1000)) {}

  /// The next sample; fails the test after 5 s without one.
  Sample next() {
    Sample sample{};
    void* buffer = &sample;
    dds_sample_info_t about{};
    EXPECT_TRUE(
        eventually([&] { return dds_take(reader_.get(), &buffer, &about, 1, 1) > 0 && about.valid_data; }));
    return sample;
  }

  [[nodiscard]] bool is_matched() const {
    dds_subscription_matched_status_t matched{};
    dds_get_subscription_matched_status(reader_.get(), &matched);
    return matched.current_count > 0;
  }

  template <typename Condition>
  static bool eventually(const Condition& condition) {
    for (int attempt = 0; attempt < 5000; ++attempt) {
      if (condition()) {
        return true;
      }
      dds_sleepfor(DDS_MSECS(1));
    }
    return false;
  }

  /// The QoS the writer announced.
  DdsQos announced_qos() {
    EXPECT_TRUE(eventually([&] { return is_matched(); }));
    dds_instance_handle_t writer = 0;
    dds_get_matched_publications(reader_.get(), &writer, 1);
    dds_builtintopic_endpoint_t* endpoint = dds_get_matched_publication_data(reader_.get(), writer);
    DdsQos qos(dds_create_qos());
    dds_copy_qos(qos.get(), endpoint->qos);
    dds_builtintopic_free_endpoint(endpoint);
    return qos;
  }

 private:
  DdsEntity participant_;
  DdsEntity reader_;
};

class DdsPublisherTest : public DdsTest {
 protected:
  /// A partition of its own, so that tests in one process do not hear each other.
  [[nodiscard]] static DdsSettings settings() {
    return {.domain = 0, .partition = ::testing::UnitTest::GetInstance()->current_test_info()->name()};
  }
};

/// What the publisher adds to every sample.
template <typename Sample>
Sample addressed(const char* instrument_id, const DdsPublisher& publisher) {
  Sample sample{};
  std::strcpy(sample.instrument_id, instrument_id);
  sample.daemon_start = publisher.daemon_start();
  return sample;
}

template <typename Sample>
bool is_bytewise_equal(const Sample& a, const Sample& b) {
  return std::memcmp(&a, &b, sizeof(Sample)) == 0;
}

template <typename Sample>
dds_reliability_kind_t reliability_of(const DdsQos& qos) {
  dds_reliability_kind_t kind{};
  dds_qget_reliability(qos.get(), &kind, nullptr);
  return kind;
}

template <typename Sample>
dds_durability_kind_t durability_of(const DdsQos& qos) {
  dds_durability_kind_t kind{};
  dds_qget_durability(qos.get(), &kind);
  return kind;
}

template <typename Sample>
void expect_xcdr1_and_reliable(const DdsQos& qos) {
  EXPECT_EQ(reliability_of<Sample>(qos), DDS_RELIABILITY_RELIABLE);
  std::uint32_t count = 0;
  dds_data_representation_id_t* representations = nullptr;
  ASSERT_TRUE(dds_qget_data_representation(qos.get(), &count, &representations));
  ASSERT_EQ(count, 1U);
  EXPECT_EQ(representations[0], DDS_DATA_REPRESENTATION_XCDR1);
  dds_free(representations);
}

TEST_F(DdsPublisherTest, EveryFieldOfAnEstimateArrives) {
  BareReader<tubed_TubeEstimate> reader(settings().partition);
  DdsPublisher publisher(settings(), {distinct_identity("catheter")});
  ASSERT_TRUE(reader.eventually([&] { return reader.is_matched(); }));
  auto expected = addressed<tubed_TubeEstimate>("catheter", publisher);
  to_wire(distinct_estimate(), kNow, expected);

  ASSERT_EQ(publisher.publish(distinct_estimate(), kNow), PublishResult::kWritten);

  EXPECT_TRUE(is_bytewise_equal(reader.next(), expected));
}

TEST_F(DdsPublisherTest, EveryFieldOfTheSlowTopicsArrives) {
  BareReader<tubed_EmSamples> em_reader(settings().partition);
  BareReader<tubed_TubeStatus> status_reader(settings().partition);
  BareReader<tubed_TubeHealth> health_reader(settings().partition);
  DdsPublisher publisher(settings(), {distinct_identity("a"), distinct_identity("b")});
  ASSERT_TRUE(em_reader.eventually(
      [&] { return em_reader.is_matched() && status_reader.is_matched() && health_reader.is_matched(); }));
  const NamedStageReport stage = distinct_stage();
  auto em = addressed<tubed_EmSamples>("b", publisher);
  auto status = addressed<tubed_TubeStatus>("b", publisher);
  auto health = addressed<tubed_TubeHealth>("b", publisher);
  to_wire(distinct_em_samples(), kNow, em);
  to_wire(distinct_status(), std::span(&stage, 1), kNow, status);
  to_wire(distinct_health(), std::span(&stage, 1), kNow, health);

  publisher.publish_em(1, distinct_em_samples(), kNow);
  publisher.publish_status(1, distinct_status(), std::span(&stage, 1), kNow);
  publisher.publish_health(1, distinct_health(), std::span(&stage, 1), kNow);

  EXPECT_TRUE(is_bytewise_equal(em_reader.next(), em));
  EXPECT_TRUE(is_bytewise_equal(status_reader.next(), status));
  EXPECT_TRUE(is_bytewise_equal(health_reader.next(), health));
}

TEST_F(DdsPublisherTest, ALateJoinerGetsTheIdentity) {
  DdsPublisher publisher(settings(), {distinct_identity("catheter")});
  auto expected = addressed<tubed_TubeIdentity>("catheter", publisher);
  to_wire(distinct_identity("catheter"), expected);

  BareReader<tubed_TubeIdentity> late(settings().partition);

  EXPECT_TRUE(is_bytewise_equal(late.next(), expected));
}

TEST_F(DdsPublisherTest, EstimatesAreOfferedWithTheContractsQos) {
  BareReader<tubed_TubeEstimate> reader(settings().partition);
  const DdsPublisher publisher(settings(), {distinct_identity("catheter")});

  const DdsQos qos = reader.announced_qos();

  expect_xcdr1_and_reliable<tubed_TubeEstimate>(qos);
  EXPECT_EQ(durability_of<tubed_TubeEstimate>(qos), DDS_DURABILITY_VOLATILE);
  dds_duration_t deadline = 0;
  dds_qget_deadline(qos.get(), &deadline);
  EXPECT_EQ(deadline, DDS_MSECS(100));
  dds_duration_t lifespan = 0;
  dds_qget_lifespan(qos.get(), &lifespan);
  EXPECT_EQ(lifespan, DDS_MSECS(200));
  dds_liveliness_kind_t liveliness{};
  dds_duration_t lease = 0;
  dds_qget_liveliness(qos.get(), &liveliness, &lease);
  EXPECT_EQ(liveliness, DDS_LIVELINESS_MANUAL_BY_TOPIC);
  EXPECT_EQ(lease, DDS_MSECS(250));
}

TEST_F(DdsPublisherTest, TheSlowTopicsAreOfferedWithTheContractsQos) {
  BareReader<tubed_EmSamples> em(settings().partition);
  BareReader<tubed_TubeStatus> status(settings().partition);
  BareReader<tubed_TubeIdentity> identity(settings().partition);
  BareReader<tubed_TubeHealth> health(settings().partition);
  const DdsPublisher publisher(settings(), {distinct_identity("catheter")});

  const DdsQos em_qos = em.announced_qos();
  expect_xcdr1_and_reliable<tubed_EmSamples>(em_qos);
  dds_duration_t lifespan = 0;
  dds_qget_lifespan(em_qos.get(), &lifespan);
  EXPECT_EQ(lifespan, DDS_SECS(1));
  EXPECT_EQ(durability_of<tubed_EmSamples>(em_qos), DDS_DURABILITY_VOLATILE);
  EXPECT_EQ(durability_of<tubed_TubeStatus>(status.announced_qos()), DDS_DURABILITY_TRANSIENT_LOCAL);
  EXPECT_EQ(durability_of<tubed_TubeIdentity>(identity.announced_qos()), DDS_DURABILITY_TRANSIENT_LOCAL);
  EXPECT_EQ(durability_of<tubed_TubeHealth>(health.announced_qos()), DDS_DURABILITY_VOLATILE);
  expect_xcdr1_and_reliable<tubed_TubeStatus>(status.announced_qos());
  expect_xcdr1_and_reliable<tubed_TubeIdentity>(identity.announced_qos());
  expect_xcdr1_and_reliable<tubed_TubeHealth>(health.announced_qos());
}

TEST_F(DdsPublisherTest, AnUnknownInterfaceIsAnErrorThatNamesItAndSaysWhatToDo) {
  try {
    const DdsPublisher publisher({.domain = 7, .partition = "", .network_interface = "nosuch0"}, {});
    FAIL() << "no error";
  } catch (const DdsError& error) {
    const std::string words = error.what();
    EXPECT_NE(words.find("nosuch0"), std::string::npos) << words;
    EXPECT_NE(words.find("ip address"), std::string::npos) << words;
    EXPECT_NE(words.find("does not match an available interface"), std::string::npos) << words;
  }
}

TEST_F(DdsPublisherTest, InstrumentIdsAreCheckedBeforeAnythingIsSent) {
  EXPECT_THROW(DdsPublisher(settings(), {distinct_identity("")}), std::invalid_argument);
  EXPECT_THROW(DdsPublisher(settings(), {distinct_identity(std::string(65, 'x'))}), std::invalid_argument);
  EXPECT_THROW(DdsPublisher(settings(), {distinct_identity("a"), distinct_identity("a")}),
               std::invalid_argument);
}

TEST_F(DdsPublisherTest, AnInstrumentThatDoesNotExistIsCountedAsFailed) {
  DdsPublisher publisher(settings(), {distinct_identity("catheter")});
  TubeEstimate estimate;
  estimate.instrument = 1;

  EXPECT_EQ(publisher.publish(estimate), PublishResult::kFailed);

  EXPECT_EQ(publisher.counters().failed, 1U);
  EXPECT_EQ(publisher.counters().written, 1U);  // the identity
}

// The other process of the next test: stops itself as soon as a sample has reached it.
TEST(StoppedSubscriber, DISABLED_StopsItself) {
  BareReader<tubed_TubeEstimate> reader(kStoppedPartition);
  static_cast<void>(reader.next());
  raise(SIGSTOP);
}

pid_t spawn_subscriber() {
  char program[] = "/proc/self/exe";
  char filter[] = "--gtest_filter=StoppedSubscriber.*";
  char disabled[] = "--gtest_also_run_disabled_tests";
  char* arguments[] = {program, filter, disabled, nullptr};
  pid_t child = -1;
  EXPECT_EQ(posix_spawn(&child, program, nullptr, nullptr, arguments, environ), 0);
  return child;
}

TEST_F(DdsPublisherTest, PublishingDoesNotWaitForAStoppedSubscriber) {
  DdsPublisher publisher({.domain = 0, .partition = kStoppedPartition}, {distinct_identity("catheter")});
  const pid_t child = spawn_subscriber();
  int state = 0;
  while (waitpid(child, &state, WUNTRACED | WNOHANG) == 0) {
    publisher.publish(distinct_estimate());
    dds_sleepfor(DDS_MSECS(33));
  }
  ASSERT_TRUE(WIFSTOPPED(state));
  const std::uint64_t written_before = publisher.counters().written;

  const dds_time_t started = dds_time();
  for (int i = 0; i < 300; ++i) {
    publisher.publish(distinct_estimate());
  }
  const dds_duration_t took = dds_time() - started;

  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  EXPECT_EQ(publisher.counters().written, written_before + 300);
  EXPECT_EQ(publisher.counters().timed_out, 0U);
  EXPECT_LT(took, 300 * DDS_MSECS(2));  // measured 0.01 ms each; a writer that waits gives up after 2 ms each
}

}  // namespace
}  // namespace tubed
