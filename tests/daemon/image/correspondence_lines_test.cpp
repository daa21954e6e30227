#include "daemon/image/correspondence_lines.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>

namespace tubed {
namespace {

constexpr int kSize = 200;
constexpr int kLines = 60;

/// Vesselness with a ridge at y = `row_of(x)`, plus even noise of height `noise`.
template <typename RowOf>
ImageMeasurement vesselness_with_ridge(RowOf row_of, double noise) {
  ImageMeasurement image;
  image.reserve(kSize, kSize);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> even(0, noise);
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      const double distance = y - row_of(x);
      image.vesselness[static_cast<std::size_t>(y * kSize + x)] =
          static_cast<float>(0.8 * std::exp(-0.5 * distance * distance / 2.0) + even(random));
    }
  }
  return image;
}

struct Search {
  std::array<CorrespondenceLine, LineSearch::kMaxLines> lines{};
  std::unique_ptr<LineSearch> search = std::make_unique<LineSearch>();

  /// Upright lines along y = 100, 3 px apart.
  Search() {
    for (int i = 0; i < kLines; ++i) {
      lines[static_cast<std::size_t>(i)].base_px = {10.0 + 3 * i, 100.0};
      lines[static_cast<std::size_t>(i)].normal = {0, 1};
      lines[static_cast<std::size_t>(i)].in_view = true;
    }
  }
  LineSearch::Outcome run(const ImageMeasurement& image) {
    return search->search(image, lines, kLines, 14, 0.7);
  }
};

TEST(LineSearch, FindsARidgeFourPixelsOffOnEveryLine) {
  Search search;
  const auto outcome = search.run(vesselness_with_ridge([](int) { return 104.0; }, 0.1));
  EXPECT_EQ(outcome.in_view, kLines);
  EXPECT_GT(outcome.inlier_ratio, 0.95);
  for (int i = 0; i < kLines; ++i) {
    EXPECT_NEAR(search.lines[static_cast<std::size_t>(i)].offset_px, 4, 0.4) << i;
  }
}

TEST(LineSearch, FollowsARidgeThatBends) {
  Search search;
  const auto row = [](double x) { return 100 + 6 * std::sin(x / 40); };
  search.run(vesselness_with_ridge(row, 0.1));
  for (int i = 2; i + 2 < kLines; ++i) {
    const CorrespondenceLine& line = search.lines[static_cast<std::size_t>(i)];
    EXPECT_NEAR(line.offset_px, row(line.base_px.x()) - 100, 0.6) << i;
  }
}

TEST(LineSearch, AGapIsCarriedByItsNeighboursAndSaysSo) {
  Search search;
  ImageMeasurement image = vesselness_with_ridge([](int) { return 103.0; }, 0.1);
  for (int y = 0; y < kSize; ++y) {
    for (int x = 85; x < 115; ++x) {
      image.vesselness[static_cast<std::size_t>(y * kSize + x)] = 0;
    }
  }
  search.run(image);
  const CorrespondenceLine& hidden = search.lines[30];
  const CorrespondenceLine& seen = search.lines[5];
  EXPECT_NEAR(hidden.offset_px, 3, 1.5);
  EXPECT_GT(hidden.variance_px2, 3 * seen.variance_px2);
  EXPECT_FALSE(hidden.agrees);
  EXPECT_TRUE(seen.agrees);
}

TEST(LineSearch, PureNoiseIsNotTakenForATube) {
  Search search;
  const auto outcome = search.run(vesselness_with_ridge([](int) { return -1000.0; }, 0.5));
  double mean_variance = 0;
  for (int i = 0; i < kLines; ++i) {
    mean_variance += search.lines[static_cast<std::size_t>(i)].variance_px2 / kLines;
  }
  EXPECT_GT(mean_variance, 1.0) << "it does not know, and says so; inlier ratio " << outcome.inlier_ratio;
}

TEST(LineSearch, LinesOutOfViewTakeNoPart) {
  Search search;
  for (int i = 20; i < kLines; ++i) {
    search.lines[static_cast<std::size_t>(i)].in_view = false;
  }
  const auto outcome = search.run(vesselness_with_ridge([](int) { return 102.0; }, 0.1));
  EXPECT_EQ(outcome.in_view, 20);
  EXPECT_GT(search.lines[50].variance_px2, search.lines[5].variance_px2);
}

}  // namespace
}  // namespace tubed
