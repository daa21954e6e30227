#include "drivers/aurora/link_search.hpp"

#include <gtest/gtest.h>

#include <set>
#include <vector>

namespace tubed::aurora {
namespace {

using std::chrono::milliseconds;

TEST(LinkSearch, Tries9600ThenTheLikelyRateThenABreakThenAll) {
  LinkSearch search;
  search.begin(BaudRate::k230400);
  std::vector<SearchStep> steps;
  do {
    steps.push_back(search.step());
  } while (search.advance());
  EXPECT_EQ(steps[0].rate, BaudRate::k9600);
  EXPECT_EQ(steps[1].rate, BaudRate::k230400);
  EXPECT_TRUE(steps[2].serial_break);
  EXPECT_EQ(steps[2].rate, BaudRate::k9600);
  std::set<BaudRate> swept;
  for (std::size_t i = 3; i < steps.size(); ++i) {
    EXPECT_FALSE(steps[i].serial_break);
    swept.insert(steps[i].rate);
  }
  EXPECT_EQ(swept.size(), kRates.size());
}

class LinkSearchWhileWaiting : public testing::TestWithParam<bool> {
 protected:
  LinkSearchWhileWaiting() {
    if (GetParam()) {
      search.begin_after_loss(BaudRate::k115200);
    } else {
      search.begin(BaudRate::k115200);
      while (search.advance()) {
      }
    }
  }
  LinkSearch search;
};

TEST_P(LinkSearchWhileWaiting, TriesTheLikelyRateAnd9600TwiceASecondWhateverElse) {
  EXPECT_EQ(search.step().rate, BaudRate::k115200) << "it may have lost only its cable";
  std::set<BaudRate> tried;
  milliseconds since_9600{0};
  milliseconds since_likely{0};
  for (int i = 0; i < 1000; ++i) {
    const SearchStep step = search.step();
    tried.insert(step.rate);
    since_9600 = step.rate == BaudRate::k9600 ? milliseconds(0) : since_9600 + step.timeout;
    since_likely = step.rate == BaudRate::k115200 ? milliseconds(0) : since_likely + step.timeout;
    ASSERT_LE(since_9600, milliseconds(400)) << i;
    ASSERT_LE(since_likely, milliseconds(600)) << i;
    search.advance();
  }
  EXPECT_EQ(tried.size(), kRates.size());
}

TEST_P(LinkSearchWhileWaiting, SendsABreakAfterEightSecondsAndThenOnceAMinute) {
  std::vector<double> breaks_s;
  double now_s = 0;
  while (now_s < 200) {
    if (search.step().serial_break) {
      breaks_s.push_back(now_s);
    }
    now_s += static_cast<double>(search.step().timeout.count()) * 1e-3;
    search.advance();
  }
  ASSERT_EQ(breaks_s.size(), 3U);
  EXPECT_NEAR(breaks_s[0], 8, 0.5);
  EXPECT_GT(breaks_s[1] - breaks_s[0], 60);
}

INSTANTIATE_TEST_SUITE_P(All, LinkSearchWhileWaiting, testing::Bool());

}  // namespace
}  // namespace tubed::aurora
