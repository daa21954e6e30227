#include <gtest/gtest.h>

#include <algorithm>

#include "tests/daemon/image/frangi_bed.hpp"

namespace tubed {
namespace {

// Tiles as the filter uses them: inside the image and at least 16 px wide.
bool in_tiles(int x, int y) {
  for (PixelRectangle tile : kTiles) {
    if (tile == PixelRectangle{96, 50, 99, 60}) {
      tile = {85, 50, 101, 60};
    }
    if (x >= tile.left && x < tile.right && y >= tile.top && y < tile.bottom) {
      return true;
    }
  }
  return false;
}

TEST(FrangiTiles, HoldTheSamePixelsAsTheWholeImageAndLeaveTheOthersAlone) {
  for (const FrangiSmoothing smoothing : {FrangiSmoothing::kFloat, FrangiSmoothing::kInteger16}) {
    FrangiSettings settings = fixed_settings();
    settings.smoothing = smoothing;
    FrangiFilter of_whole(kBedWidth, kBedHeight, settings);
    FrangiFilter of_tiles(kBedWidth, kBedHeight, settings);
    OwnedMaps whole;
    OwnedMaps tiles;
    of_whole.filter(tubes<std::uint16_t>(), whole.all());
    of_tiles.filter_tiles(tubes<std::uint16_t>(), kTiles, tiles.all());
    for (int y = 0; y < kBedHeight; ++y) {
      for (int x = 0; x < kBedWidth; ++x) {
        const auto i = static_cast<std::size_t>(y * kBedWidth + x);
        ASSERT_EQ(tiles.vesselness[i], in_tiles(x, y) ? whole.vesselness[i] : -1) << x << ", " << y;
        ASSERT_EQ(tiles.sine[i], in_tiles(x, y) ? whole.sine[i] : -1) << x << ", " << y;
      }
    }
  }
}

TEST(FrangiTiles, TakeTheStructurenessOfTheLastWholeImage) {
  FrangiFilter filter(kBedWidth, kBedHeight, FrangiSettings{});
  OwnedMaps maps;
  filter.filter(tubes<std::uint8_t>(), maps.all());
  const float c = filter.structureness(0);
  std::vector<float> fainter = tubes<float>();
  for (float& pixel : fainter) {
    pixel *= 0.5F;
  }
  filter.filter_tiles(fainter, kTiles, maps.all());
  EXPECT_EQ(filter.structureness(0), c);
  EXPECT_GT(c, 0);
}

TEST(FrangiTiles, TakeTheStructurenessOfTheirOwnImageWhenThereWasNone) {
  FrangiFilter of_whole(kBedWidth, kBedHeight, FrangiSettings{});
  FrangiFilter of_tiles(kBedWidth, kBedHeight, FrangiSettings{});
  OwnedMaps whole;
  OwnedMaps tiles;
  of_whole.filter(tubes<float>(), whole.all());
  of_tiles.filter_tiles(tubes<float>(), kTiles, tiles.all());
  EXPECT_EQ(of_tiles.structureness(0), of_whole.structureness(0));
  EXPECT_EQ(tiles.vesselness[5 * kBedWidth + 5], whole.vesselness[5 * kBedWidth + 5]);
}

TEST(FrangiTiles, AFilterOfFewRowsGivesTheSameWholeImage) {
  FrangiFilter of_whole(kBedWidth, kBedHeight, FrangiSettings{});
  FrangiFilter of_rows(kBedWidth, kBedHeight, FrangiSettings{}, FrangiMemory::kRows);
  OwnedMaps whole;
  OwnedMaps rows;
  of_whole.filter(tubes<std::uint16_t>(), whole.all());
  of_rows.filter(tubes<std::uint16_t>(), rows.all());
  EXPECT_EQ(of_rows.structureness(1), of_whole.structureness(1));
  EXPECT_EQ(rows.vesselness, whole.vesselness);
  EXPECT_EQ(rows.sine, whole.sine);
}

TEST(FrangiTiles, WholeNumbersInFloatAreSmoothedAsTheIntegersTheyAre) {
  FrangiSettings settings;
  settings.smoothing = FrangiSmoothing::kInteger16;
  FrangiFilter filter(kBedWidth, kBedHeight, settings);
  OwnedMaps of_words;
  OwnedMaps of_floats;
  const std::vector<std::uint16_t> words = tubes<std::uint16_t>();
  const std::vector<float> floats(words.begin(), words.end());
  filter.filter(words, of_words.all());
  filter.filter(GreyPixels::WholeNumbers{floats, *std::max_element(floats.begin(), floats.end())},
                of_floats.all());
  EXPECT_EQ(of_floats.vesselness, of_words.vesselness);
}

}  // namespace
}  // namespace tubed
