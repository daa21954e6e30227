#include "drivers/aurora/link_search.hpp"

#include <gtest/gtest.h>

#include <set>
#include <vector>

namespace tubed::aurora {
namespace {

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

TEST(LinkSearch, ListensAt9600BetweenAllOthersWhileTheTrackerIsAway) {
  LinkSearch search;
  search.begin_after_loss(BaudRate::k115200);
  std::set<BaudRate> tried;
  bool before_was_9600 = true;
  do {
    const bool is_9600 = search.step().rate == BaudRate::k9600;
    EXPECT_TRUE(is_9600 || before_was_9600);
    before_was_9600 = is_9600;
    tried.insert(search.step().rate);
  } while (search.advance());
  EXPECT_EQ(tried.size(), kRates.size());
}

}  // namespace
}  // namespace tubed::aurora
