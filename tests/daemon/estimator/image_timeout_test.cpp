#include "daemon/estimator/images/image_timeout.hpp"

#include <gtest/gtest.h>

namespace tubed {
namespace {

using std::chrono::milliseconds;

std::chrono::nanoseconds timeout_after(milliseconds period, int instants) {
  ImageTimeout timeout;
  for (int i = 0; i < instants; ++i) {
    timeout.saw_instant(from_ns(1'000'000'000) + i * period);
  }
  return timeout.timeout(milliseconds(500));
}

TEST(ImageTimeout, IsTheMostAllowedUntilAPeriodIsKnown) {
  EXPECT_EQ(timeout_after(milliseconds(33), 1), milliseconds(500));
}

TEST(ImageTimeout, IsTwoPeriodsAndALittle) {
  EXPECT_GT(timeout_after(milliseconds(133), 20), milliseconds(2 * 133));
  EXPECT_LT(timeout_after(milliseconds(133), 20), milliseconds(3 * 133));
  EXPECT_LT(timeout_after(milliseconds(33), 20), milliseconds(100));
}

TEST(ImageTimeout, TwoViewsOfOneInstantDoNotHalveThePeriod) {
  ImageTimeout timeout;
  for (int i = 0; i < 20; ++i) {
    timeout.saw_instant(from_ns(1'000'000'000) + i * milliseconds(100));
    timeout.saw_instant(from_ns(1'000'000'000) + i * milliseconds(100));
  }
  EXPECT_GT(timeout.timeout(milliseconds(500)), milliseconds(200));
}

TEST(ImageTimeout, AStallDoesNotTeachIt) {
  ImageTimeout timeout;
  for (int i = 0; i < 20; ++i) {
    timeout.saw_instant(from_ns(1'000'000'000) + i * milliseconds(33));
  }
  timeout.saw_instant(from_ns(1'000'000'000) + milliseconds(5000));
  EXPECT_LT(timeout.timeout(milliseconds(500)), milliseconds(100));
}

}  // namespace
}  // namespace tubed
