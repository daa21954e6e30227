// Counts calls of operator new in this executable: the filter may not make any.
#include <gtest/gtest.h>

#include "daemon/image/vesselness_meter.hpp"
#include "daemon/image/view_watch.hpp"
#include "tests/daemon/image/frangi_bed.hpp"
#include "tests/support/counted_allocations.hpp"

namespace tubed {
namespace {

TEST(Frangi, NeverAllocatesOnceItIsMade) {
  FrangiSettings settings;
  settings.smoothing = FrangiSmoothing::kInteger16;
  FrangiFilter filter(kBedWidth, kBedHeight, settings);
  OwnedMaps maps;
  const auto bytes = tubes<std::uint8_t>();
  const auto words = tubes<std::uint16_t>();
  const auto floats = tubes<float>();
  const long before = allocations;
  ASSERT_GT(before, 0) << "allocations are not counted";
  filter.filter_tiles(bytes, kTiles, maps.all());
  filter.filter(bytes, maps.all());
  filter.filter(words, maps.vesselness);
  filter.filter(floats, maps.all());
  filter.filter_tiles(floats, kTiles, maps.all());
  EXPECT_EQ(allocations - before, 0);
}

TEST(VesselnessMeter, NeverAllocatesOnceItIsMade) {
  VesselnessMeter meter(kBedWidth, kBedHeight, FrangiSettings{});
  ImageOnDemand on_demand(kBedWidth, kBedHeight, FrangiSettings{});
  ImageMeasurement image;
  image.reserve(kBedWidth, kBedHeight);
  image.state = ImageState::kMeasured;
  image.grey = tubes<float>();
  image.brightest = 255;
  ImageArea area(kBedWidth, kBedHeight);
  const ImageArea whole = image.measured;
  const long before = allocations;
  ASSERT_GT(before, 0) << "allocations are not counted";
  for (int round = 0; round < 3; ++round) {
    area.clear();
    area.add_box({10.0 + round, 5}, {40, 60});
    meter.take(image, area);
    on_demand.begin();
    on_demand.filter_missing(image, area);
    on_demand.filter_missing(image, whole);
  }
  EXPECT_EQ(allocations - before, 0);
  EXPECT_EQ(on_demand.completed_images(), 3U);
}

TEST(ViewWatch, LooksWithoutAllocating) {
  ViewWatch watch(256, 200, 1.2);
  ImageFrame frame;
  frame.reserve(256, 200);
  frame.depth = PixelDepth::kGrey16;
  allocations = 0;
  for (int image = 0; image < 30; ++image) {
    // Texture that changes from image to image: keys, newcomers and moves.
    for (std::size_t i = 0; i < frame.pixels.size(); ++i) {
      frame.pixels[i] =
          static_cast<std::uint8_t>((i * 7919U + static_cast<std::size_t>(image / 4) * 104729U) >> 3U);
    }
    frame.exposure += std::chrono::milliseconds(image == 20 ? 7000 : 67);
    watch.observe(frame);
    if (image == 25) watch.begin(frame.exposure);
  }
  EXPECT_EQ(allocations, 0);
}

}  // namespace
}  // namespace tubed
