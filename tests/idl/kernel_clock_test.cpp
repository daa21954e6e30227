#include "idl/kernel_clock.hpp"

#include <gtest/gtest.h>
#include <sys/timex.h>

namespace tubed {
namespace {

TEST(KernelClock, FollowsAReferenceUnlessTheKernelSaysOtherwise) {
  EXPECT_EQ(judge_kernel_clock(TIME_OK, STA_PLL, 1500).reference, ClockReference::kFollowed);
  EXPECT_EQ(judge_kernel_clock(TIME_OK, STA_PLL, 1500).max_error_ns, 1'500'000);
  EXPECT_EQ(judge_kernel_clock(TIME_INS, 0, 0).reference, ClockReference::kFollowed)
      << "a leap second is due";
}

TEST(KernelClock, FollowsNothingWhenItIsUnsynchronised) {
  EXPECT_EQ(judge_kernel_clock(TIME_ERROR, STA_UNSYNC, 16'000'000).reference, ClockReference::kNone);
  EXPECT_EQ(judge_kernel_clock(TIME_ERROR, STA_CLOCKERR, 0).reference, ClockReference::kNone);
  EXPECT_EQ(judge_kernel_clock(TIME_OK, STA_UNSYNC, 0).reference, ClockReference::kNone);
}

TEST(KernelClock, IsUnknownWhereTheKernelRefuses) {
  EXPECT_EQ(judge_kernel_clock(-1, 0, 0).reference, ClockReference::kUnknown);
}

}  // namespace
}  // namespace tubed
