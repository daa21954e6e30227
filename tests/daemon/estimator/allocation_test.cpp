// Counts calls of operator new in this executable: what runs in the optimizer's thread may not make any.
#include <gtest/gtest.h>

#include <array>

#include "tests/daemon/estimator/misread_bench.hpp"
#include "tests/daemon/estimator/reference_bench.hpp"
#include "tests/support/counted_allocations.hpp"

namespace tubed {
namespace {

TEST(EmReferenceOnItsWay, NeverAllocates) {
  for (MovingGenerator generator : {MovingGenerator::with_sensor(), MovingGenerator::with_coils()}) {
    EmReference reference(generator.room.reference);
    std::array<char, 256> words{};
    const long before = allocations;
    ASSERT_GT(before, 0) << "allocations are not counted";
    for (int k = 0; k < 100; ++k) {
      counting = false;
      if (k == 50) generator.push(30, 5);
      EmFrame frame = generator.measure(25 * k);
      if (k > 80) frame.coils[5] = CoilSample{};
      counting = true;
      reference.take(frame);
      reference.describe(frame.measured, words);
    }
    EXPECT_EQ(allocations - before, 0);
    EXPECT_NE(words[0], '\0') << "it has been said that it is missing";
  }
}

TEST(MisreadImagesLookedFor, NeverAllocates) {
  MisreadBench bench(Picture::kNegative);
  counting = false;
  bench.look(0.5);
  counting = true;
  const long before = allocations;
  ASSERT_GT(before, 0) << "allocations are not counted";
  for (int i = 0; i < 20; ++i) {
    counting = false;
    const Observation& observation = bench.next();
    counting = true;
    bench.look_at(observation);
  }
  EXPECT_EQ(allocations - before, 0);
  EXPECT_TRUE(bench.look(0).found());
}

}  // namespace
}  // namespace tubed
