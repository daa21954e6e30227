#include "daemon/pipeline/triple_buffer.hpp"

#include <gtest/gtest.h>

#include <array>
#include <thread>

namespace tubed {
namespace {

TEST(TripleBuffer, ReaderSeesNothingBeforeTheFirstValue) {
  TripleBuffer<int> buffer;
  EXPECT_FALSE(buffer.fetch());
}

TEST(TripleBuffer, ReaderGetsTheNewestValueOnce) {
  TripleBuffer<int> buffer;
  buffer.back() = 1;
  EXPECT_FALSE(buffer.publish());
  buffer.back() = 2;
  EXPECT_TRUE(buffer.publish()) << "1 was never seen and has been superseded";
  ASSERT_TRUE(buffer.fetch());
  EXPECT_EQ(buffer.front(), 2);
  EXPECT_FALSE(buffer.fetch());
  EXPECT_EQ(buffer.front(), 2) << "what was taken stays";
}

TEST(TripleBuffer, WriterNeverTouchesWhatTheReaderHolds) {
  TripleBuffer<int> buffer;
  buffer.back() = 1;
  buffer.publish();
  buffer.fetch();
  for (int value = 2; value < 10; ++value) {
    buffer.back() = value;
    buffer.publish();
    EXPECT_EQ(buffer.front(), 1);
  }
}

// Two threads: every value read is whole and newer than the one before, and the last one always arrives.
TEST(TripleBuffer, UnderTwoThreadsNothingIsTornOrGoesBackwards) {
  constexpr std::uint64_t kValues = 200'000;
  TripleBuffer<std::array<std::uint64_t, 32>> buffer;
  std::thread writer([&] {
    for (std::uint64_t value = 1; value <= kValues; ++value) {
      buffer.back().fill(value);
      buffer.publish();
    }
  });
  std::uint64_t newest = 0;
  std::uint64_t torn = 0;
  std::uint64_t backward = 0;
  while (newest < kValues) {
    if (buffer.fetch()) {
      const auto& words = buffer.front();
      for (const std::uint64_t word : words) {
        torn += word != words[0] ? 1 : 0;
      }
      backward += words[0] <= newest ? 1 : 0;
      newest = words[0];
    }
  }
  writer.join();
  EXPECT_EQ(torn, 0U);
  EXPECT_EQ(backward, 0U);
}

}  // namespace
}  // namespace tubed
