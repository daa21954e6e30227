#include "daemon/pipeline/tube_beside_views.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <string>

#include "tests/daemon/pipeline/optimizer_bench.hpp"

namespace tubed {
namespace {

/// What the stage says after so many more images, ten a second, of the first camera.
std::string why_after_images(OptimizerBench& bench, int images, ImageState state = ImageState::kMeasured) {
  for (int k = 0; k < images; ++k) {
    bench.clock.advance(std::chrono::milliseconds(100));
    bench.measure(0, bench.clock.now(), state);
    bench.stage->step(bench.clock);
  }
  return bench.why_after_a_tick();
}

TEST(TubeBesideViews, ThatTheTubeLiesOutsideEveryImageForFiveSecondsIsSaid) {
  OptimizerBench bench(2);
  EXPECT_EQ(why_after_images(bench, 60), "");
  for (FakeEstimator* fake : bench.fakes) fake->in_view_ratio = 0;
  EXPECT_EQ(why_after_images(bench, 40), "");
  const std::string beside =
      "the tube has lain outside every image for 5 s, by T_camera_world and T_world_em";
  EXPECT_EQ(why_after_images(bench, 20).substr(0, beside.size()), beside);
  bench.fakes[1]->in_view_ratio = 0.1F;
  EXPECT_EQ(why_after_images(bench, 1), "");
}

TEST(TubeBesideViews, WithoutImagesOrShapesNothingLiesOutside) {
  OptimizerBench bench;
  bench.fakes[0]->in_view_ratio = 0;
  EXPECT_EQ(why_after_images(bench, 90, ImageState::kOff), "");
  bench.fakes[0]->validity = Validity::kNotAvailable;
  EXPECT_EQ(why_after_images(bench, 90), "");
}

// A view that shows another part of the patient, now and then.
TEST(TubeBesideViews, AFewImagesBesideTheTubeAreNothingToSpeakOf) {
  OptimizerBench bench;
  bench.fakes[0]->in_view_ratio = 0;
  for (int k = 0; k < 6; ++k) {
    EXPECT_EQ(why_after_images(bench, 1), "");
    bench.clock.advance(std::chrono::seconds(1));
  }
}

// Of a procedure in which fluoroscopy was off for a while.
TEST(TubeBesideViews, ItIsSinceTheFirstImageWithoutTheTube) {
  OptimizerBench bench;
  EXPECT_EQ(why_after_images(bench, 1), "");
  bench.clock.advance(std::chrono::seconds(60));
  bench.fakes[0]->in_view_ratio = 0;
  EXPECT_EQ(why_after_images(bench, 40), "");
  EXPECT_NE(why_after_images(bench, 20), "");
}

}  // namespace
}  // namespace tubed
