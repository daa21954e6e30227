#include "daemon/estimator/tip_shape.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <memory>
#include <string>

#include "tests/daemon/estimator/hooked_tube.hpp"

namespace tubed {
namespace {

/// Images and coils of one instant after another.
struct TipBench {
  explicit TipBench(HookedTube tube_, double first_coil_mm = 8, RestShape told = RestShape::kUnknown)
      : tube(tube_), room(room_with_first_coil(first_coil_mm)) {
    InstrumentDescription& instrument = room.instruments.front();
    instrument.rest_shape = told;
    instrument.hook_radius_mm = 8;
    instrument.hook_length_mm = 14;
    shape = std::make_unique<TipShape>(EstimatorSettings{}, instrument, room);
  }

  /// The next image, `later_s` after the one before it.
  bool ask(double later_s = 0.6) { return ask_showing(tube, later_s); }

  /// Coils of the tube, and an image of another one.
  bool ask_showing(const HookedTube& shown, double later_s = 0.6) {
    now += std::chrono::nanoseconds(static_cast<std::int64_t>(later_s * 1e9));
    const EmFrame frame = measure_hooked(tube, room, now, 0.5, 0.005, ++seed);
    history->add(frame);
    coils = observe_coils(&frame, *history, room.instruments.front(), room.T_world_em, 150'000'000);
    image = shown.length_mm == 0 ? image_of_arc(room, now) : image_of_hooked(shown, room, now);
    Observation observation;
    observation.instant = observation.now = observation.newest_image = now;
    observation.is_image_instant = true;
    observation.em = history.get();
    observation.images[0] = &image;
    return shape->ask(observation, coils);
  }
  HookedTube tube;
  RoomDescription room;
  std::unique_ptr<TipShape> shape;
  std::unique_ptr<EmHistory> history = std::make_unique<EmHistory>();
  CoilObservations coils;
  ImageMeasurement image;
  MonotonicTime now = from_ns(10'000'000'000);
  unsigned seed = 0;
};

constexpr HookedTube kStraight{8, 0, 0};

TEST(TipShape, AHookThatNobodyToldOfIsFound) {
  int found = 0;
  for (const double roll_rad : {0.0, 0.8, 1.6, 3.0, 4.5}) {
    TipBench bench({8, 14, roll_rad}, 6);
    for (int i = 0; i < 4; ++i) bench.ask();
    if (bench.shape->rest() == nullptr) continue;  // PreshapedEstimator: then it is doubted, or near enough
    ++found;
    EXPECT_GT(bench.shape->rest()->binormal().normalized().dot(bench.tube.binormal()), std::cos(0.4))
        << roll_rad;
  }
  EXPECT_GE(found, 3);
}

TEST(TipShape, AStraightTipStaysStraight) {
  for (const double coil_mm : {5.0, 10.0, 15.0}) {
    TipBench bench(kStraight, coil_mm);
    for (int i = 0; i < 6; ++i) EXPECT_FALSE(bench.ask());
    EXPECT_EQ(bench.shape->rest(), nullptr);
    EXPECT_LT(bench.shape->gain(), 5);
    EXPECT_EQ(bench.shape->doubt(bench.coils), TipDoubt::kNone);
  }
}

TEST(TipShape, OneImageAloneDecidesNothing) {
  TipBench bench(kStraight, 8);
  for (int i = 0; i < 2; ++i) bench.ask();
  const double gain_before = bench.shape->gain();
  EXPECT_FALSE(bench.ask_showing({8, 14, 3}));  // as when another tube lies across the tip
  EXPECT_FALSE(bench.ask());
  EXPECT_EQ(bench.shape->rest(), nullptr);
  EXPECT_EQ(bench.shape->doubt(bench.coils), TipDoubt::kNone);
  EXPECT_LT(bench.shape->gain(), std::max(gain_before, 0.0) + 5);
}

TEST(TipShape, OneViewOfAHookWithoutACoilInItIsDoubted) {
  TipBench bench({8, 14, 1}, 15, RestShape::kHook);
  for (int i = 0; i < 4; ++i) bench.ask();
  ASSERT_NE(bench.shape->rest(), nullptr);
  EXPECT_EQ(bench.shape->doubt(bench.coils), TipDoubt::kOneView);
}

TEST(TipShape, AHookThatIsConfiguredAndNotThereIsTold) {
  TipBench bench(kStraight, 8, RestShape::kHook);
  ASSERT_NE(bench.shape->rest(), nullptr);
  for (int i = 0; i < 4; ++i) bench.ask();
  EXPECT_EQ(bench.shape->rest(), nullptr);
  EXPECT_EQ(bench.shape->doubt(bench.coils), TipDoubt::kNoSuchHook);
  std::array<char, 256> words{};
  write_tip_doubt(bench.shape->doubt(bench.coils), bench.room.instruments.front(), words);
  EXPECT_NE(std::string(words.data()).find("hook is configured"), std::string::npos) << words.data();
}

TEST(TipShape, ItIsAskedNowAndThen) {
  TipBench bench(kStraight);
  bench.ask();
  const double gain = bench.shape->gain();
  bench.ask(0.1);
  EXPECT_EQ(bench.shape->gain(), gain);
  bench.ask(0.5);
  EXPECT_NE(bench.shape->gain(), gain);
  bench.shape->reset();
  EXPECT_EQ(bench.shape->gain(), 0);
}

}  // namespace
}  // namespace tubed
