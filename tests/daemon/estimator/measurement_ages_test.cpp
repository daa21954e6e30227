// The ages in an estimate are at its valid_time: a subscriber computes from them when the measurements were
// made.
#include <gtest/gtest.h>

#include <memory>

#include "daemon/estimator/estimator.hpp"
#include "tests/daemon/estimator/simulated_tube.hpp"

namespace tubed {
namespace {

using std::chrono::milliseconds;

const MonotonicTime kMeasured = from_ns(10'000'000'000);

class MeasurementAges : public testing::TestWithParam<EstimatorMode> {
 protected:
  MeasurementAges() {
    EstimatorSettings settings;
    settings.mode = GetParam();
    estimator_ = make_estimator(settings, room_.instruments.front(), room_);
    observation_.em = history_.get();
    observation_.image_timeout = milliseconds(120);
  }
  void measure(MonotonicTime time) { history_->add(measure_coils(room_, time, 1, ++seed_)); }
  const TubeEstimate& estimate(MonotonicTime instant, MonotonicTime now) {
    observation_.instant = instant;
    observation_.now = now;
    estimator_->estimate(observation_, *estimate_);
    return *estimate_;
  }
  const TubeEstimate& estimate_image(ImageMeasurement& image, MonotonicTime now) {
    observation_.is_image_instant = true;
    observation_.images[0] = &image;
    observation_.newest_image = image.exposure;
    return estimate(image.exposure, now);
  }

  RoomDescription room_ = one_view_room();
  std::unique_ptr<EmHistory> history_ = std::make_unique<EmHistory>();
  std::unique_ptr<Estimator> estimator_;
  std::unique_ptr<TubeEstimate> estimate_ = std::make_unique<TubeEstimate>();
  Observation observation_;
  unsigned seed_ = 0;
};

TEST_P(MeasurementAges, OfATickIsZeroHoweverLateItWasMade) {
  measure(kMeasured);
  const TubeEstimate& tick = estimate(kMeasured + milliseconds(12), kMeasured + milliseconds(12));
  EXPECT_EQ(tick.valid_time_ns, to_ns(kMeasured));
  EXPECT_EQ(tick.em_age_ns, 0);
  EXPECT_EQ(tick.image_age_ns, kNoAge);
}

TEST_P(MeasurementAges, GiveTheTimeOfTheMeasurementsOfAnImageInstant) {
  measure(kMeasured);
  ImageMeasurement image = image_of_arc(room_, kMeasured + milliseconds(7));
  const TubeEstimate& estimate = estimate_image(image, kMeasured + milliseconds(40));
  EXPECT_EQ(estimate.valid_time_ns - estimate.em_age_ns, to_ns(kMeasured));
  EXPECT_EQ(estimate.em_age_ns, 7'000'000);
  if (GetParam() != EstimatorMode::kEm) {
    EXPECT_EQ(estimate.image_age_ns, 0);
  }
}

TEST_P(MeasurementAges, StayWithTheShapeWhenTheTrackerFallsSilent) {
  measure(kMeasured);
  estimate(kMeasured, kMeasured);
  const TubeEstimate& late = estimate(kMeasured + milliseconds(900), kMeasured + milliseconds(900));
  EXPECT_TRUE(late.reasons.has(Reason::kEmStale));
  EXPECT_EQ(late.valid_time_ns, to_ns(kMeasured));
  EXPECT_EQ(late.em_age_ns, 0);
}

TEST_P(MeasurementAges, AreNoneWhileThereIsNoShape) {
  const TubeEstimate& nothing = estimate(kMeasured, kMeasured);
  EXPECT_EQ(nothing.em_age_ns, kNoAge);
  EXPECT_EQ(nothing.image_age_ns, kNoAge);
}

std::vector<EstimatorMode> every_mode() {
  std::vector<EstimatorMode> modes;
  for (const EstimatorModeRow& row : kEstimatorModes) {
    modes.push_back(row.mode);
  }
  return modes;
}

INSTANTIATE_TEST_SUITE_P(EveryMode, MeasurementAges, testing::ValuesIn(every_mode()),
                         [](const auto& mode) { return std::string(name_of(mode.param)); });

}  // namespace
}  // namespace tubed
