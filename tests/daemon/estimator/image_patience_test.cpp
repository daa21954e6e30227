#include "daemon/estimator/image_patience.hpp"

#include <gtest/gtest.h>

namespace tubed {
namespace {

using std::chrono::milliseconds;

std::chrono::nanoseconds patience_after(milliseconds period, int instants) {
  ImagePatience patience;
  for (int i = 0; i < instants; ++i) {
    patience.saw_instant(from_ns(1'000'000'000) + i * period);
  }
  return patience.patience(milliseconds(500));
}

TEST(ImagePatience, IsTheMostAllowedUntilAPeriodIsKnown) {
  EXPECT_EQ(patience_after(milliseconds(33), 1), milliseconds(500));
}

TEST(ImagePatience, IsTwoPeriodsAndALittle) {
  EXPECT_GT(patience_after(milliseconds(133), 20), milliseconds(2 * 133));
  EXPECT_LT(patience_after(milliseconds(133), 20), milliseconds(3 * 133));
  EXPECT_LT(patience_after(milliseconds(33), 20), milliseconds(100));
}

TEST(ImagePatience, TwoViewsOfOneInstantDoNotHalveThePeriod) {
  ImagePatience patience;
  for (int i = 0; i < 20; ++i) {
    patience.saw_instant(from_ns(1'000'000'000) + i * milliseconds(100));
    patience.saw_instant(from_ns(1'000'000'000) + i * milliseconds(100));
  }
  EXPECT_GT(patience.patience(milliseconds(500)), milliseconds(200));
}

TEST(ImagePatience, AStallDoesNotTeachIt) {
  ImagePatience patience;
  for (int i = 0; i < 20; ++i) {
    patience.saw_instant(from_ns(1'000'000'000) + i * milliseconds(33));
  }
  patience.saw_instant(from_ns(1'000'000'000) + milliseconds(5000));
  EXPECT_LT(patience.patience(milliseconds(500)), milliseconds(100));
}

}  // namespace
}  // namespace tubed
