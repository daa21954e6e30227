// Counts calls of operator new in this executable: the filter may not make any.
#include <gtest/gtest.h>

#include "daemon/image/vesselness_meter.hpp"
#include "tests/daemon/image/frangi_bed.hpp"
#include "tests/support/counted_allocations.hpp"

namespace tubed {
namespace {

TEST(Frangi, NeverAllocatesOnceItIsMade) {
  FrangiSettings settings;
  settings.smoothing = FrangiSmoothing::kInteger16;
  FrangiFilter filter(kWidth, kHeight, settings);
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
  VesselnessMeter meter(kWidth, kHeight, FrangiSettings{});
  ImageOnDemand on_demand(kWidth, kHeight, FrangiSettings{});
  ImageMeasurement image;
  image.reserve(kWidth, kHeight);
  image.state = ImageState::kMeasured;
  image.grey = tubes<float>();
  image.brightest = 255;
  ImageArea area(kWidth, kHeight);
  const ImageArea whole = image.measured;
  const long before = allocations;
  ASSERT_GT(before, 0) << "allocations are not counted";
  for (int round = 0; round < 3; ++round) {
    area.clear();
    area.add_box({10.0 + round, 5}, {40, 60});
    meter.take(image, area);
    on_demand.take(image);
    on_demand.require(area);
    on_demand.require(whole);
  }
  EXPECT_EQ(allocations - before, 0);
  EXPECT_EQ(on_demand.completed_images(), 3U);
}

}  // namespace
}  // namespace tubed
