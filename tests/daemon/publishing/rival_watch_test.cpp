#include "daemon/publishing/rival_watch.hpp"

#include <unistd.h>

#include <cstring>
#include <memory>

#include "daemon/publishing/clock_pair.hpp"
#include "daemon/publishing/dds_publisher.hpp"
#include "idl/dds_contract.hpp"
#include "idl/writer_description.hpp"
#include "tests/support/own_namespace.hpp"

namespace tubed {
namespace {

/// A daemon's publisher of two instruments, and its watch.
class RivalWatchTest : public DdsTest {
 protected:
  static DdsSettings settings() {
    return {.partition = ::testing::UnitTest::GetInstance()->current_test_info()->name()};
  }

  static std::unique_ptr<DdsPublisher> publisher_of(const std::vector<std::string>& ids) {
    std::vector<TubeIdentityValues> identities(ids.size());
    for (std::size_t i = 0; i < ids.size(); ++i) identities[i].instrument_id = ids[i];
    return std::make_unique<DdsPublisher>(settings(), identities);
  }

  /// Both publish for up to five seconds, until the watch has something to say; whether it had.
  static bool has_news(RivalWatch& watch, DdsPublisher& own, DdsPublisher& other) {
    for (int i = 0; i < 500; ++i) {
      own.publish(TubeEstimate{});
      other.publish(TubeEstimate{});
      dds_sleepfor(DDS_MSECS(10));
      if (watch.look(read_clocks().monotonic_ns)) return true;
    }
    return false;
  }
};

TEST_F(RivalWatchTest, AnotherWriterOfAnOwnInstrumentIsARivalUntilItHasBeenSilentForASecond) {
  const auto own = publisher_of({"cath-1", "cath-2"});
  RivalWatch watch(own->participant(), settings(), {"cath-1", "cath-2"});
  const auto other = publisher_of({"cath-2"});

  ASSERT_TRUE(has_news(watch, *own, *other));
  EXPECT_FALSE(watch.reports()[0].is_there);
  EXPECT_TRUE(watch.reports()[1].is_there);
  EXPECT_TRUE(watch.reports()[1].has_changed);
  EXPECT_NE(watch.reports()[1].who.find("process " + std::to_string(getpid())), std::string::npos)
      << watch.reports()[1].who;

  dds_sleepfor(DDS_MSECS(50));
  watch.look(read_clocks().monotonic_ns);
  const std::int64_t now_ns = read_clocks().monotonic_ns;
  EXPECT_FALSE(watch.look(now_ns + 900'000'000));
  EXPECT_TRUE(watch.look(now_ns + 1'001'000'000));
  EXPECT_FALSE(watch.reports()[1].is_there);
  EXPECT_FALSE(watch.look(now_ns + 1'002'000'000));
}

TEST_F(RivalWatchTest, NeitherTheOwnWriterNorAnotherInstrumentIsARival) {
  const auto own = publisher_of({"cath-1"});
  RivalWatch watch(own->participant(), settings(), {"cath-1"});
  const auto other = publisher_of({"cath-3"});

  for (int i = 0; i < 50; ++i) {
    own->publish(TubeEstimate{});
    other->publish(TubeEstimate{});
    dds_sleepfor(DDS_MSECS(10));
    EXPECT_FALSE(watch.look(read_clocks().monotonic_ns));
  }
}

}  // namespace
}  // namespace tubed
