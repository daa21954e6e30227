#include "clients/cpp/estimate_connection.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "idl/dds_contract.hpp"
#include "tests/support/own_namespace.hpp"

namespace tubed {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;

TEST(RenewalTimer, ASilenceOf150MillisecondsIsDue) {
  const RenewalTimer timer;
  EXPECT_EQ(timer.due_ns(7 * kSecond), 7 * kSecond + 150'000'000);
}

TEST(RenewalTimer, EachRenewalThatHelpsNothingDoublesTheIntervalUpToTenSeconds) {
  RenewalTimer timer;
  std::int64_t now_ns = kSecond;
  for (const double interval_s : {0.5, 1.0, 2.0, 4.0, 8.0, 10.0, 10.0}) {
    timer.renewed(now_ns);
    EXPECT_EQ(timer.due_ns(kSecond) - now_ns, static_cast<std::int64_t>(interval_s * 1e9));
    now_ns = timer.due_ns(kSecond);
  }
}

TEST(RenewalTimer, AfterAShapeTheNextSilenceIsAnotherOne) {
  RenewalTimer timer;
  for (int i = 0; i < 5; ++i) timer.renewed(kSecond);
  timer.heard();
  timer.renewed(100 * kSecond);
  EXPECT_EQ(timer.due_ns(100 * kSecond), 100 * kSecond + 500'000'000);
}

class EstimateConnectionTest : public DdsTest {
 protected:
  EstimateConnectionTest() { subscription_.partition = "estimate_connection"; }

  /// The first writer that `connection` is matched with, and its handle.
  static std::uint64_t matched(EstimateConnection& connection) {
    for (int i = 0; i < 500; ++i) {
      const auto writers = connection.matched_writers();
      if (writers && !writers->empty()) return writers->front();
      dds_sleepfor(DDS_MSECS(10));
    }
    return 0;
  }

  Subscription subscription_;
  InstrumentGate gate_{"", 8};
};

TEST_F(EstimateConnectionTest, AWriterHasOneNameInEveryConnection) {
  const DdsEntity participant = join_domain(0, "lo");
  const DdsEntity writer =
      make_writer(participant, contract_of<tubed_TubeEstimate>(), subscription_.partition);
  EstimateConnection shared(subscription_, gate_, DomainUse::kShared);
  EstimateConnection separate(subscription_, gate_, DomainUse::kSeparate);

  const std::uint64_t in_shared = matched(shared);
  const std::uint64_t in_separate = matched(separate);

  ASSERT_NE(in_shared, 0U);
  EXPECT_EQ(in_shared, in_separate);
  const auto handle = separate.handle_of(in_separate);
  ASSERT_TRUE(handle.has_value());
  EXPECT_EQ(separate.writer_of(*handle), in_separate);
  EXPECT_FALSE(separate.handle_of(in_separate + 1).has_value());
}

TEST_F(EstimateConnectionTest, ASeparateConnectionHearsWhatIsWritten) {
  const DdsEntity participant = join_domain(0, "lo");
  const DdsEntity writer =
      make_writer(participant, contract_of<tubed_TubeEstimate>(), subscription_.partition);
  EstimateConnection separate(subscription_, gate_, DomainUse::kSeparate);
  ASSERT_NE(matched(separate), 0U);
  dds_publication_matched_status_t readers{};
  while (readers.current_count == 0) {
    dds_sleepfor(DDS_MSECS(1));
    dds_get_publication_matched_status(writer.get(), &readers);
  }

  auto sample = std::make_unique<tubed_TubeEstimate>();
  sample->sequence_number = 77;
  require_dds(dds_write(writer.get(), sample.get()), "write");

  tubed_TubeEstimate heard{};
  void* buffer = &heard;
  dds_sample_info_t about{};
  int taken = 0;
  for (int i = 0; i < 500 && taken == 0; ++i) {
    dds_sleepfor(DDS_MSECS(10));
    taken = dds_take(separate.reader().get(), &buffer, &about, 1, 1);
  }
  ASSERT_EQ(taken, 1);
  EXPECT_EQ(heard.sequence_number, 77U);
}

}  // namespace
}  // namespace tubed
