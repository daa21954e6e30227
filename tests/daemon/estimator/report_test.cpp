#include "daemon/estimator/report.hpp"

#include <gtest/gtest.h>

#include <memory>

namespace tubed {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kPeriod{25};
constexpr milliseconds kUnderWay{20};
const MonotonicTime kStart = from_ns(1'000'000'000);

/// Measurements at 40 Hz, of which some are lost, and when they are asked for.
class Measured {
 public:
  /// Measurements number `from` to `to`; number 0 is at kStart.
  void take(int from, int to) {
    for (int i = from; i <= to; ++i) {
      EmFrame frame;
      frame.measured = kStart + i * kPeriod;
      frame.received = frame.measured + kUnderWay;
      history_->add(frame);
    }
  }
  [[nodiscard]] bool is_stale_at(MonotonicTime now, MonotonicTime instant) const {
    Observation observation;
    observation.em = history_.get();
    observation.now = now;
    observation.instant = instant;
    return is_stale(history_->newest_until(instant), observation, EstimatorSettings{});
  }
  [[nodiscard]] bool is_stale_at(MonotonicTime now) const { return is_stale_at(now, now); }

 private:
  std::unique_ptr<EmHistory> history_ = std::make_unique<EmHistory>();
};

TEST(StaleMeasurements, AreSaidSoonAfterTheSecondIsMissing) {
  Measured measured;
  measured.take(0, 100);
  const MonotonicTime newest = kStart + 100 * kPeriod;
  EXPECT_FALSE(measured.is_stale_at(newest + 3 * kPeriod)) << "one is missing";
  EXPECT_TRUE(measured.is_stale_at(newest + milliseconds(90))) << "two are";
}

TEST(StaleMeasurements, AreNotThoseBeforeALateImage) {
  Measured measured;
  measured.take(0, 100);
  const MonotonicTime now = kStart + 100 * kPeriod + kUnderWay;
  EXPECT_FALSE(measured.is_stale_at(now, now - milliseconds(200)));
}

TEST(StaleMeasurements, AreThoseBeforeAnImageOfAnInterruptionThatIsOver) {
  Measured measured;
  measured.take(0, 100);
  measured.take(140, 150);
  const MonotonicTime now = kStart + 150 * kPeriod + kUnderWay;
  EXPECT_FALSE(measured.is_stale_at(now));
  EXPECT_TRUE(measured.is_stale_at(now, kStart + 130 * kPeriod));
}

TEST(StaleMeasurements, AreNoneAtAll) { EXPECT_TRUE(Measured().is_stale_at(kStart)); }

/// Of a shape whose first coil lies that far from the tip, and that so many views show.
bool is_ambiguous(double first_coil_mm, std::uint32_t views) {
  const auto history = std::make_unique<EmHistory>();
  const auto estimate = std::make_unique<TubeEstimate>();
  Observation observation;
  observation.em = history.get();
  CoilObservations coils;
  coils.count = 2;
  coils.coils[0].state = coils.coils[1].state = CoilState::kUsed;
  coils.coils[0].s_mm = first_coil_mm;
  coils.coils[1].s_mm = 300;
  estimate->point_count = kMaxCentrelinePoints;
  estimate->view_count = views;
  judge(observation, coils, {.uses_images = true}, *estimate);
  return estimate->reasons.has(Reason::kAmbiguous);
}

TEST(LongLooseTip, IsAmbiguousInOneView) {
  EXPECT_FALSE(is_ambiguous(99, 1));
  EXPECT_TRUE(is_ambiguous(101, 1));
  EXPECT_FALSE(is_ambiguous(101, 2));
  EXPECT_FALSE(is_ambiguous(101, 0)) << "then no image has bent it";
}

/// Of images the newest of which was used, or left out because the view has moved, that long ago.
bool is_image_stale(milliseconds used_ago, milliseconds left_out_ago, bool geometry_changed) {
  const auto history = std::make_unique<EmHistory>();
  const auto estimate = std::make_unique<TubeEstimate>();
  Observation observation;
  observation.em = history.get();
  observation.now = observation.instant = kStart + std::chrono::seconds(10);
  observation.newest_image = observation.now - used_ago;
  observation.newest_left_out = observation.now - left_out_ago;
  observation.geometry_changed = geometry_changed;
  observation.image_timeout = milliseconds(150);
  judge(observation, CoilObservations{}, {.uses_images = true}, *estimate);
  return estimate->reasons.has(Reason::kImageStale);
}

TEST(StaleImages, AreToldAlsoWhileImagesWouldBeLeftOut) {
  EXPECT_FALSE(is_image_stale(milliseconds(20), milliseconds(9000), false));
  EXPECT_FALSE(is_image_stale(milliseconds(9000), milliseconds(20), true)) << "they come and are left out";
  EXPECT_TRUE(is_image_stale(milliseconds(9000), milliseconds(300), true)) << "the grabber is gone";
  EXPECT_TRUE(is_image_stale(milliseconds(300), milliseconds(9000), false));
}

}  // namespace
}  // namespace tubed
