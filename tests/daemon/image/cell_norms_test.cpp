#include "daemon/image/cell_norms.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace tubed {
namespace {

constexpr int kSize = 160;  // ten cells a row

/// Sets every cell that has to be looked at to what it has now, until the greatest is known; how many.
int look(CellNorms& norms, const std::vector<float>& now) {
  ImageArea seen(kSize, kSize);
  ImageArea doubtful(kSize, kSize);
  int count = 0;
  for (norms.add_doubtful(seen, doubtful); !doubtful.empty(); norms.add_doubtful(seen, doubtful)) {
    for (std::size_t cell = 0; cell < now.size(); ++cell) {
      if (doubtful.holds_cell(cell)) {
        EXPECT_FALSE(seen.holds_cell(cell)) << "looked at twice";
        norms.set(cell, now[cell]);
        ++count;
      }
    }
    seen.add(doubtful);
    doubtful.clear();
  }
  return count;
}

CellNorms of(const std::vector<float>& values) {
  CellNorms norms{ImageArea(kSize, kSize)};
  for (std::size_t cell = 0; cell < values.size(); ++cell) {
    norms.set(cell, values[cell]);
  }
  return norms;
}

TEST(CellNorms, WhatIsGreatestIsFoundAFewCellsFromWhereItWas) {
  std::vector<float> values(100, 1);
  values[44] = 10;
  CellNorms norms = of(values);
  values[44] = 1;
  values[55] = 7;
  EXPECT_EQ(look(norms, values), 9);
  EXPECT_EQ(norms.greatest(), 7);
}

TEST(CellNorms, WhatHasBecomeSmallerIsLookedAtUntilTheGreatestIsNew) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> between(1, 10);
  for (int round = 0; round < 20; ++round) {
    std::vector<float> values(100);
    for (float& value : values) {
      value = between(random);
    }
    CellNorms norms = of(values);
    for (float& value : values) {
      value *= std::uniform_real_distribution<float>(0.2F, 1)(random);
    }
    look(norms, values);
    EXPECT_EQ(norms.greatest(), *std::max_element(values.begin(), values.end()));
  }
}

TEST(CellNorms, ASecondLookAtTheSameImageEndsToo) {
  const std::vector<float> values(100, 3);
  CellNorms norms = of(values);
  EXPECT_EQ(look(norms, values), 100) << "all are equal";
  EXPECT_EQ(norms.greatest(), 3);
}

}  // namespace
}  // namespace tubed
