#include "daemon/image/nth_smallest.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <random>
#include <vector>

namespace tubed {
namespace {

TEST(NthSmallest, IsWhatSortingPutsThere) {
  constexpr std::size_t kMost = 73;
  std::mt19937 random(3);
  std::normal_distribution<float> normal(0, 1);
  for (std::size_t count = 1; count <= kMost; ++count) {
    for (const float step : {0.0F, 0.5F, 5.0F}) {  // as they are, many that are equal, nearly all
      std::vector<float> values(count);
      for (float& value : values) {
        value = normal(random);
        if (step > 0) value = step * std::round(value / step);
      }
      std::vector<float> sorted = values;
      std::ranges::sort(sorted);
      for (std::size_t rank = 0; rank < count; ++rank) {
        std::vector<float> changed = values;
        ASSERT_EQ(nth_smallest<kMost>(changed, rank), sorted[rank]) << count << " values, rank " << rank;
        changed = sorted;
        ASSERT_EQ(nth_smallest<kMost>(changed, rank), sorted[rank]) << "sorted";
      }
    }
  }
}

}  // namespace
}  // namespace tubed
