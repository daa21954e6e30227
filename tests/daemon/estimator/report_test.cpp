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

/// With coils at 15 and 60 mm on a tube of 127 mm, a point each millimetre.
struct Held {
  Held() {
    coils.count = 2;
    coils.coils[0].state = coils.coils[1].state = CoilState::kUsed;
    coils.coils[0].s_mm = 15;
    coils.coils[1].s_mm = 60;
    estimate->length_mm = kMaxCentrelinePoints - 1;
    estimate->point_count = kMaxCentrelinePoints;
  }
  std::unique_ptr<EmHistory> history = std::make_unique<EmHistory>();
  std::unique_ptr<TubeEstimate> estimate = std::make_unique<TubeEstimate>();
  CoilObservations coils;
};

TEST(HeldByCoils, ThirtyMillimetresToEitherSide) {
  Held held;
  write_held_by_coils(held.coils, *held.estimate);
  for (std::size_t s_mm = 0; s_mm < kMaxCentrelinePoints; ++s_mm) {
    EXPECT_EQ(held.estimate->points[s_mm].held_by, s_mm <= 90 ? kHeldByCoil : 0U) << s_mm;
  }
}

TEST(HeldByCoils, NothingHoldsTheLastShapeWhereMeasurementsAreStale) {
  Held held;
  held.estimate->reasons.add(Reason::kEmStale);
  write_held_by_coils(held.coils, *held.estimate);
  EXPECT_EQ(held.estimate->points[15].held_by, 0U);
}

TEST(HeldByCoils, ATipThatMayBeElsewhereIsHeldByNone) {
  Held held;
  Observation observation;
  observation.em = held.history.get();
  write_held_by_coils(held.coils, *held.estimate);
  held.estimate->points[3].held_by |= kHeldByImage;
  judge(observation, held.coils, {.ambiguous = true}, *held.estimate);
  EXPECT_TRUE(held.estimate->reasons.has(Reason::kAmbiguous));
  EXPECT_EQ(held.estimate->validity, Validity::kQuestionable);
  EXPECT_EQ(held.estimate->points[14].held_by, 0U);
  EXPECT_EQ(held.estimate->points[3].held_by, kHeldByImage);
  EXPECT_EQ(held.estimate->points[15].held_by, kHeldByCoil);
}

/// Images ten times a second, each with its verdict.
struct SeenImages {
  ImageVerdict see(ImageVerdict verdict, int times) {
    ImageVerdict standing = ImageVerdict::kNone;
    for (int i = 0; i < times; ++i) {
      now += milliseconds(100);
      Observation observation;
      observation.instant = observation.now = now;
      observation.is_image_instant = true;
      standing = lost_tube.standing(observation, verdict);
    }
    return standing;
  }
  LostTube lost_tube;
  MonotonicTime now = kStart;
};

TEST(LostTube, OneImageThatShowsItAfterASecondWithoutIsBelieved) {
  SeenImages images;
  images.see(ImageVerdict::kShowsTube, 50);
  EXPECT_EQ(images.see(ImageVerdict::kLost, 10), ImageVerdict::kLost);
  EXPECT_EQ(images.see(ImageVerdict::kShowsTube, 1), ImageVerdict::kShowsTube);
}

TEST(LostTube, WhereMostImagesDoNotShowItOneThatDoesIsNotBelieved) {
  SeenImages images;
  images.see(ImageVerdict::kShowsTube, 50);
  images.see(ImageVerdict::kLost, 60);
  EXPECT_EQ(images.see(ImageVerdict::kShowsTube, 5), ImageVerdict::kLost);
  EXPECT_EQ(images.see(ImageVerdict::kLost, 1), ImageVerdict::kLost);
  // exp(-t / 3 s) of what was lost has to sink below 0.7: after 1.1 s at most.
  EXPECT_EQ(images.see(ImageVerdict::kShowsTube, 11), ImageVerdict::kShowsTube);
  images.see(ImageVerdict::kLost, 60);
  images.lost_tube.forget();
  EXPECT_EQ(images.see(ImageVerdict::kShowsTube, 1), ImageVerdict::kShowsTube);
}

TEST(LostTube, ShapesBetweenImagesAndImagesThatSayNothingKeepTheVerdict) {
  SeenImages images;
  images.see(ImageVerdict::kLost, 1);
  Observation tick;
  tick.instant = tick.now = images.now + milliseconds(30);
  EXPECT_EQ(images.lost_tube.standing(tick, ImageVerdict::kNone), ImageVerdict::kLost);
  EXPECT_EQ(images.see(ImageVerdict::kNone, 30), ImageVerdict::kLost);
}

TEST(LostTube, WhereMostImagesDidNotShowItNothingIsMadeGoodByFluoroscopyThatGoesOff) {
  SeenImages images;
  images.see(ImageVerdict::kShowsTube, 50);
  images.see(ImageVerdict::kLost, 10);
  Observation off;
  off.instant = off.now = images.now + milliseconds(500);
  off.fluoroscopy_off = true;
  EXPECT_EQ(images.lost_tube.standing(off, ImageVerdict::kNone), ImageVerdict::kNone) << "for a second";
  images.see(ImageVerdict::kLost, 50);
  off.instant = off.now = images.now + std::chrono::minutes(5);
  EXPECT_EQ(images.lost_tube.standing(off, ImageVerdict::kNone), ImageVerdict::kLost);
  const auto reasons_of = [&](ImageVerdict verdict) {
    const auto history = std::make_unique<EmHistory>();
    const auto estimate = std::make_unique<TubeEstimate>();
    off.em = history.get();
    judge(off, CoilObservations{}, {.uses_images = true, .images = verdict}, *estimate);
    return estimate->reasons;
  };
  EXPECT_FALSE(reasons_of(ImageVerdict::kNone).has(Reason::kImageLostTube));
  EXPECT_TRUE(reasons_of(ImageVerdict::kLost).has(Reason::kImageLostTube));
  EXPECT_TRUE(reasons_of(ImageVerdict::kLost).has(Reason::kImageOff));
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
