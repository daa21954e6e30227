#include "daemon/estimator/coils/coil_error_scale.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "tests/daemon/estimator/simulated_tube.hpp"

namespace tubed {
namespace {

constexpr double kImagePeriod_s = 1.0 / 15;

/// The arc itself as the shape that images confirmed, and what the scale makes of coils that are measured
/// against it.
class Confirmed {
 public:
  explicit Confirmed(RoomDescription room = one_view_room())
      : room_(std::move(room)), map_(EstimatorSettings{}, 380), camera_(room_.cameras.front()) {
    const auto history = std::make_unique<EmHistory>();
    const RoomDescription seen = one_view_room();
    const EmFrame frame = measure_coils(seen, from_ns(1), 0, 1);
    const CoilObservations coils =
        observe_coils(&frame, *history, seen.instruments.front(), seen.T_world_em, 150'000'000);
    C_ = Eigen::Matrix3Xd::Zero(3, map_.columns().count());
    bool converged = false;
    map_.solve_linear(coils, C_);
    map_.refine(coils, {}, nullptr, 20, C_, converged);
  }

  /// `count` images at which coils err by `amplitude_mm` in a random direction, drawn anew or the first one
  /// kept, all moved by `outlier_mm`.
  CoilErrorScale after(int count, double amplitude_mm, bool drawn_anew, double outlier_mm = 0) {
    CoilErrorScale scale{EstimatorSettings{}};
    CoilNoise noise{EstimatorSettings{}};
    auto history = std::make_unique<EmHistory>();
    for (int i = 1; i <= count; ++i) {
      const MonotonicTime now = from_ns(1'000'000'000) + i * std::chrono::milliseconds(25);
      EmFrame frame = measure_coils(room_, now, amplitude_mm, drawn_anew ? static_cast<unsigned>(i) : 4U);
      for (CoilSample& sample : frame.coils) {
        // What repeats itself to the bit is no measurement.
        sample.p_em_mm += Eigen::Vector3d(outlier_mm, 1e-4 * (i % 3), 0);
      }
      history->add(frame);
      noise.observe(*history->newest_until(now), *history, room_.instruments.front());
      const CoilObservations coils = observe_coils(history->newest_until(now), *history,
                                                   room_.instruments.front(), room_.T_world_em, 150'000'000);
      const LineConstraint line;
      const ViewConstraints view{&camera_, &line, 1};
      scale.observe(coils, noise, {&view, 1}, map_.spline(), C_, kImagePeriod_s);
    }
    return scale;
  }

 private:
  RoomDescription room_;
  TubeMap map_;
  Camera camera_;
  Eigen::Matrix3Xd C_;
};

const double kSet_mm = EstimatorSettings{}.sigma_position_mm;

TEST(CoilErrorScale, IsThatOfTheSettingsBeforeAnyImage) {
  EXPECT_DOUBLE_EQ(CoilErrorScale{EstimatorSettings{}}.position_mm(), kSet_mm);
}

TEST(CoilErrorScale, OfATrackerBetterThanTheSettingsIsFound) {
  // Direction of fixed length: one third of its square on every axis.
  EXPECT_NEAR(Confirmed().after(300, 2, true).position_mm(), 2 / std::sqrt(3.0), 0.15);
}

TEST(CoilErrorScale, OfATrackerAsTheSettingsSayStays) {
  EXPECT_NEAR(Confirmed().after(300, 4, true).position_mm(), kSet_mm, 0.15);
}

TEST(CoilErrorScale, ErrorsThatStayCountOnce) {
  // Coils without any error: three samples of the prior and a part of one of each coil in view, in whichever
  // image.
  Confirmed room;
  const double once = room.after(3, 0, false).position_mm();
  EXPECT_NEAR(room.after(200, 0, false).position_mm(), once, 0.1 * once);
  EXPECT_GT(once, 0.5 * kSet_mm);
}

// They see one smooth field: five coils that are right across the view leave depth nearly as it was.
TEST(CoilErrorScale, CoilsThatErrByTheSameFieldAreNotAsManySamples) {
  EXPECT_GT(Confirmed().after(200, 0, false).position_mm(), 0.75 * kSet_mm);
}

// What moves all coils across the view, as a wrong registration does, may be as far off in depth.
TEST(CoilErrorScale, CoilsFurtherOffThanTheSettingsSayRaiseIt) {
  const double mm = Confirmed().after(100, 0, false, 6).position_mm();
  EXPECT_GT(mm, 1.2 * kSet_mm);
  EXPECT_LT(mm, 2 * kSet_mm);
}

TEST(CoilErrorScale, IsNeverMoreThanTwiceTheSettingsHoweverFarOffACoilIs) {
  EXPECT_DOUBLE_EQ(Confirmed().after(100, 8, true, 60).position_mm(), 2 * kSet_mm);
}

TEST(CoilErrorScale, CoilsOutsideTheImageSayNothing) {
  RoomDescription room = one_view_room();
  room.cameras.front().T_camera_world.translation().x() += 1000;
  EXPECT_DOUBLE_EQ(Confirmed(room).after(100, 1, true).position_mm(), kSet_mm);
}

}  // namespace
}  // namespace tubed
