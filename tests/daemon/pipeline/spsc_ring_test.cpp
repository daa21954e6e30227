#include "daemon/pipeline/spsc_ring.hpp"

#include <gtest/gtest.h>

#include <thread>

namespace tubed {
namespace {

TEST(SpscRing, AFullRingRefusesTheNewestAndCountsIt) {
  SpscRing<int, 2> ring;
  EXPECT_TRUE(ring.push(1));
  EXPECT_TRUE(ring.push(2));
  EXPECT_FALSE(ring.push(3));
  EXPECT_EQ(ring.refused(), 1U);
  int value = 0;
  ASSERT_TRUE(ring.pop(value));
  EXPECT_EQ(value, 1);
}

TEST(SpscRing, UnderTwoThreadsEverythingAcceptedArrivesInOrder) {
  constexpr int kValues = 200'000;
  SpscRing<int, 64> ring;
  std::thread producer([&] {
    for (int value = 1; value <= kValues; ++value) {
      while (!ring.push(value)) {
        std::this_thread::yield();
      }
    }
  });
  int expected = 1;
  int value = 0;
  while (expected <= kValues) {
    if (ring.pop(value)) {
      ASSERT_EQ(value, expected);
      ++expected;
    }
  }
  producer.join();
}

}  // namespace
}  // namespace tubed
