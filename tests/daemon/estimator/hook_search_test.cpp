#include "daemon/estimator/tip/hook_search.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "daemon/estimator/tip/preshaped_estimator.hpp"
#include "tests/daemon/estimator/hooked_tube.hpp"

namespace tubed {
namespace {

constexpr HookedTube kTube{8, 14, 0.8};

/// One image and one measurement of the coils, asked for the hook that is there.
class SearchBench {
 public:
  explicit SearchBench(std::size_t coils = 5) : room_(room_with_first_coil(6)) {
    InstrumentDescription& instrument = room_.instruments.front();
    instrument.coils.resize(std::min(coils, instrument.coils.size()));
    settings_ = PreshapedEstimator::settings_for_hooks({}, instrument.length_mm);
    hook_.emplace(UniformCubicBSpline(settings_.coefficient_count, instrument.length_mm), kTube.curve());
    search_ = std::make_unique<HookSearch>(settings_, instrument, room_, hook_->length_mm());
    image_ = image_of_hooked(kTube, room_, now_);
    const EmFrame frame = measure_hooked(kTube, room_, now_, 0.5, 0.005, 1);
    history_->add(frame);
    coils_ = observe_coils(&frame, *history_, instrument, room_.T_world_em, 150'000'000);
  }

  [[nodiscard]] HookSearch& search() { return *search_; }
  void show_straight_tube() { image_ = image_of_arc(room_, now_); }
  [[nodiscard]] CoilObservations& coils() { return coils_; }
  [[nodiscard]] const InstrumentDescription& instrument() const { return room_.instruments.front(); }
  [[nodiscard]] double spacing_mm() const {
    return instrument().length_mm / (settings_.coefficient_count - 3);
  }

  /// As HookSearch::gain_of_coils(), of the best of all starts.
  double best_gain_of_coils() {
    double gain = -1e9;
    for (int start = 0; start < HookSearch::kStarts; ++start) {
      search_->solve_with(*hook_, start, observation());
      gain = std::max(gain, search_->gain_of_coils());
    }
    return gain;
  }

  bool solve_straight() { return search_->solve_straight(observation(), coils_); }
  /// chi^2 by which the best of all starts is the better explanation.
  double best_gain() {
    double gain = -1e9;
    for (int start = 0; start < HookSearch::kStarts; ++start) {
      gain = std::max(gain, search_->straight_cost() - search_->solve_with(*hook_, start, observation()));
    }
    return gain;
  }

 private:
  Observation observation() {
    Observation observation;
    observation.instant = observation.now = observation.newest_image = now_;
    observation.is_image_instant = true;
    observation.em = history_.get();
    observation.images[0] = &image_;
    return observation;
  }

  RoomDescription room_;
  EstimatorSettings settings_;
  std::optional<RestHook> hook_;
  std::unique_ptr<HookSearch> search_;
  std::unique_ptr<EmHistory> history_ = std::make_unique<EmHistory>();
  ImageMeasurement image_;
  CoilObservations coils_;
  MonotonicTime now_ = from_ns(10'000'000'000);
};

TEST(HookSearch, TheLastPartHasThreeCoilsAndTheCoefficientsOfTheWhole) {
  SearchBench bench;
  const double third_mm = bench.instrument().coils[2].offset_from_tip_mm;
  EXPECT_GT(bench.search().length_mm(), third_mm);
  EXPECT_LT(bench.search().length_mm(), third_mm + 3 * bench.spacing_mm());
  const double segments = bench.search().length_mm() / bench.spacing_mm();
  EXPECT_NEAR(segments, std::round(segments), 1e-9);
}

TEST(HookSearch, WithTwoCoilsTheLastPartGoesToTheSecond) {
  SearchBench bench(2);
  EXPECT_GT(bench.search().length_mm(), bench.instrument().coils[1].offset_from_tip_mm);
  ASSERT_TRUE(bench.solve_straight());
  EXPECT_GT(bench.best_gain(), 12);
}

TEST(HookSearch, WhatLiesBeforeTheLastPartSaysNothing) {
  SearchBench bench;
  ASSERT_TRUE(bench.solve_straight());
  const double cost = bench.search().straight_cost();
  const double gain = bench.best_gain();
  EXPECT_GT(gain, 12) << "TipShape's kAdopted";
  bench.coils().coils[4].p_world_mm.x() += 50;
  ASSERT_TRUE(bench.solve_straight());
  EXPECT_EQ(bench.search().straight_cost(), cost);
  EXPECT_EQ(bench.best_gain(), gain);
  bench.coils().coils[1].p_world_mm.x() += 50;
  bench.solve_straight();
  EXPECT_GT(bench.search().straight_cost(), cost + 12);
}

TEST(HookSearch, WhatCoilsSaveIsTheSameWhateverTheImageShows) {
  SearchBench bench;
  ASSERT_TRUE(bench.solve_straight());
  const double gain = bench.best_gain();
  const double gain_of_coils = bench.best_gain_of_coils();
  EXPECT_GT(gain_of_coils, 5);
  bench.show_straight_tube();
  ASSERT_TRUE(bench.solve_straight());
  EXPECT_GT(std::abs(bench.best_gain() - gain), 1);
  EXPECT_EQ(bench.best_gain_of_coils(), gain_of_coils);
}

TEST(HookSearch, OneCoilOfTheLastPartIsNotEnough) {
  SearchBench bench;
  bench.coils().coils[0].state = bench.coils().coils[2].state = CoilState::kMissing;
  EXPECT_FALSE(bench.solve_straight());
}

}  // namespace
}  // namespace tubed
