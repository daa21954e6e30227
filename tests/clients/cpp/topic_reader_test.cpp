#include "clients/cpp/topic_reader.hpp"

#include <cstring>
#include <memory>
#include <set>

#include "tests/support/own_namespace.hpp"

namespace tubed {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

/// A daemon's status under any id, or somebody else's.
class StatusWriter {
 public:
  explicit StatusWriter(const std::string& partition)
      : participant_(join_domain(0, "lo")),
        writer_(make_writer(participant_, contract_of<tubed_TubeStatus>(), partition)) {
    dds_publication_matched_status_t matched{};
    while (matched.current_count == 0) {
      dds_sleepfor(DDS_MSECS(1));
      require_dds(dds_get_publication_matched_status(writer_.get(), &matched), "ask for subscribers");
    }
  }

  void write(const std::string& id, const std::string& why = "") {
    auto sample = std::make_unique<tubed_TubeStatus>();
    std::strncpy(sample->instrument_id, id.c_str(), sizeof(sample->instrument_id) - 1);
    std::strncpy(sample->stages[0].why, why.c_str(), sizeof(sample->stages[0].why) - 1);
    sample->stage_count = 1;
    require_dds(dds_write(writer_.get(), sample.get()), "write");
  }

 private:
  DdsEntity participant_;
  DdsEntity writer_;
};

class TopicReaderTest : public DdsTest {
 protected:
  static Subscription own_subscription() {
    Subscription subscription;
    subscription.partition = ::testing::UnitTest::GetInstance()->current_test_info()->name();
    return subscription;
  }
};

TEST_F(TopicReaderTest, RemembersAsManyInstrumentsAsAllowedWhoeverInventsMore) {
  TopicReader<tubed_TubeStatus> reader(own_subscription());
  StatusWriter writer(own_subscription().partition);
  writer.write("cath-1");
  for (int k = 0; k < 200; ++k) writer.write("invented-" + std::to_string(k));
  std::set<std::string> heard;
  while (const tubed_TubeStatus* status = reader.wait_for(milliseconds(500)))
    heard.insert(status->instrument_id);
  EXPECT_EQ(heard.size(), own_subscription().max_instruments);
  EXPECT_TRUE(heard.contains("cath-1"));
  EXPECT_TRUE(reader.has("cath-1"));
  EXPECT_FALSE(reader.has("invented-199"));
}

TEST_F(TopicReaderTest, TheInstrumentAskedForIsHeardAlone) {
  Subscription subscription = own_subscription();
  subscription.instrument_id = "cath-2";
  TopicReader<tubed_TubeStatus> reader(subscription);
  StatusWriter writer(subscription.partition);
  writer.write("cath-1");
  writer.write("cath-2");
  const tubed_TubeStatus* const status = reader.wait_for(seconds(5));
  ASSERT_NE(status, nullptr);
  EXPECT_STREQ(status->instrument_id, "cath-2");
  EXPECT_EQ(reader.wait_for(milliseconds(200)), nullptr);
}

TEST_F(TopicReaderTest, TextsAreMadePrintable) {
  TopicReader<tubed_TubeStatus> reader(own_subscription());
  StatusWriter writer(own_subscription().partition);
  writer.write("evil\n\x1b[2J\xff", "a\nb");
  const tubed_TubeStatus* const status = reader.wait_for(seconds(5));
  ASSERT_NE(status, nullptr);
  EXPECT_STREQ(status->instrument_id, "evil\uFFFD\uFFFD[2J\uFFFD");
  EXPECT_STREQ(status->stages[0].why, "a\uFFFDb");
  EXPECT_TRUE(reader.has(status->instrument_id)) << "known by the id that is handed out";
}

}  // namespace
}  // namespace tubed
