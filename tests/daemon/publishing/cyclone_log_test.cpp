#include "daemon/publishing/cyclone_log.hpp"

#include <gtest/gtest.h>

namespace tubed {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;

TEST(MessageLimit, AFloodIsCountedAndNotWritten) {
  MessageLimit limit(2, 10 * kSecond_ns);

  EXPECT_EQ(limit.admit("first", 5), "first");
  EXPECT_EQ(limit.admit("second", 6), "second");
  for (int i = 0; i < 1000; ++i) EXPECT_FALSE(limit.admit("more", kSecond_ns + i).has_value());
  EXPECT_EQ(limit.admit("later", 5 + 10 * kSecond_ns), "later (and 1000 messages before it)");
  EXPECT_EQ(limit.admit("then", 6 + 10 * kSecond_ns), "then");
}

TEST(MessageLimit, APeriodBeginsWithItsFirstMessage) {
  MessageLimit limit(1, 10 * kSecond_ns);

  EXPECT_TRUE(limit.admit("a", 100 * kSecond_ns));
  EXPECT_FALSE(limit.admit("b", 109 * kSecond_ns));
  EXPECT_TRUE(limit.admit("c", 111 * kSecond_ns));
  EXPECT_FALSE(limit.admit("d", 120 * kSecond_ns));
}

TEST(MessageLimit, AMessageIsOneLineOfBoundedLength) {
  MessageLimit limit(9, kSecond_ns);

  EXPECT_EQ(limit.admit("one\ntwo \n\n", 0), "one two");
  EXPECT_EQ(limit.admit(std::string(5000, 'x'), 0), std::string(300, 'x') + " ...");
  EXPECT_EQ(limit.admit("", 0), "");
}

}  // namespace
}  // namespace tubed
