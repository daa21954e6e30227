#include "daemon/estimator/tip/preshaped_estimator.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <string>

#include "daemon/estimator/report.hpp"
#include "tests/daemon/estimator/hooked_tube.hpp"

namespace tubed {
namespace {

/// An estimator that is fed from a still tube: a measurement every 25 ms, an image with every fourth.
struct PreshapedBench {
  PreshapedBench(HookedTube tube_, double first_coil_mm, RestShape told,
                 EstimatorMode mode = EstimatorMode::kFilter, bool two_views = false)
      : tube(tube_), room(room_with_first_coil(first_coil_mm)) {
    InstrumentDescription& instrument = room.instruments.front();
    instrument.rest_shape = told;
    instrument.hook_radius_mm = told == RestShape::kHook ? 8 : 0;
    instrument.hook_length_mm = told == RestShape::kHook ? 14 : 0;
    for (const RestArc& arc : tube.arcs) {
      instrument.rest_arcs_mm.insert(instrument.rest_arcs_mm.end(), {arc.length_mm, arc.radius_mm});
    }
    if (two_views) {
      CameraCalibration second = room.cameras.front();
      second.name = "B";
      const Eigen::AngleAxisd turn(std::numbers::pi / 3, Eigen::Vector3d::UnitY());
      second.T_camera_world = room.cameras.front().T_camera_world * turn;
      room.cameras.push_back(second);
    }
    settings.mode = mode;
    estimator = make_estimator(settings, instrument, room);
  }

  void measure_times(int count) {
    for (int i = 0; i < count; ++i) {
      now += std::chrono::milliseconds(25);
      history->add(measure_hooked(tube, room, now, 0.5, 0.005, ++seed));
      Observation observation;
      observation.instant = observation.now = now;
      observation.em = history.get();
      observation.is_image_instant = seed % 4 == 0;
      if (observation.is_image_instant && with_images) {
        newest_image = now;
        for (std::size_t view = 0; view < room.cameras.size(); ++view) {
          images[view] = image_of_hooked(tube, room, now, view);
          observation.images[view] = &images[view];
        }
      }
      observation.newest_image = newest_image;
      observation.image_timeout = std::chrono::milliseconds(250);
      estimator->update(observation, *estimate);
      if (looks_further) estimator->look_further(observation);
    }
  }

  [[nodiscard]] double tip_error_mm() const {
    return (Eigen::Map<const Eigen::Vector3d>(estimate->points[0].p_world_mm.data()) - tube.point(0)).norm();
  }
  [[nodiscard]] std::string words() const {
    std::array<char, 256> text{};
    return estimator->describe_disagreement(text) ? text.data() : "";
  }

  HookedTube tube;
  RoomDescription room;
  EstimatorSettings settings;
  std::unique_ptr<Estimator> estimator;
  std::unique_ptr<EmHistory> history = std::make_unique<EmHistory>();
  std::unique_ptr<TubeEstimate> estimate = std::make_unique<TubeEstimate>();
  std::array<ImageMeasurement, 2> images;
  MonotonicTime newest_image{};
  MonotonicTime now = from_ns(10'000'000'000);
  unsigned seed = 0;
  bool with_images = true;
  bool looks_further = true;
};

TEST(PreshapedEstimator, WithTheModelAndACoilInTheHookTheTipIsFound) {
  for (const EstimatorMode mode : {EstimatorMode::kFilter, EstimatorMode::kJoint}) {
    for (const double roll_rad : {0.3, 2.0, 4.0}) {
      PreshapedBench bench({8, 14, roll_rad}, 6, RestShape::kHook, mode);
      bench.measure_times(120);
      EXPECT_EQ(bench.estimate->validity, Validity::kValid) << roll_rad << ' ' << bench.words();
      EXPECT_LT(bench.tip_error_mm(), 2.5) << roll_rad << " mode " << name_of(mode);
      EXPECT_GT(bench.estimate->coefficient_count, 40U);
    }
  }
}

TEST(PreshapedEstimator, AHookThatNobodyToldOfIsFound) {
  PreshapedBench straight({8, 14, 3}, 6, RestShape::kStraight);
  PreshapedBench unknown({8, 14, 3}, 6, RestShape::kUnknown);
  straight.measure_times(200);
  unknown.measure_times(200);
  EXPECT_GT(unknown.estimate->coefficient_count, 40U);
  EXPECT_LT(unknown.tip_error_mm(), 1.5);
  EXPECT_GT(straight.tip_error_mm(), 1.5 * unknown.tip_error_mm());
}

TEST(PreshapedEstimator, HooksAreAskedForAfterTheShape) {
  PreshapedBench bench({8, 14, 3}, 6, RestShape::kUnknown);
  bench.looks_further = false;
  bench.measure_times(200);
  EXPECT_LT(bench.estimate->coefficient_count, 40U);
  bench.looks_further = true;
  bench.measure_times(200);
  EXPECT_GT(bench.estimate->coefficient_count, 40U);
}

/// Says of every instant how coils and images agree, and counts them.
class Saying final : public RestShapedEstimator {
 public:
  Saying(Discord explanation, int& instants) : explanation_(explanation), instants_(instants) {}
  void update(const Observation& /*observation*/, TubeEstimate& estimate) noexcept override {
    ++instants_;
    estimate.agreement.disagree = explanation_ != Discord::kNone;
    estimate.agreement.explanation = explanation_;
  }
  void reset() noexcept override {}
  void set_rest(RestHook* /*hook*/) noexcept override {}

 private:
  Discord explanation_;
  int& instants_;
};

/// Of a tight hook with a coil inside it, that nobody told of: instants with a straight tip and with a hook.
std::array<int, 2> instants_while(Discord explanation) {
  PreshapedBench bench({6, 14, 0}, 4, RestShape::kUnknown);
  std::array<int, 2> instants{};
  std::size_t made = 0;
  bench.estimator = std::make_unique<PreshapedEstimator>(
      bench.settings, bench.room.instruments.front(), bench.room, [&](const EstimatorSettings& /*settings*/) {
        return std::make_unique<Saying>(explanation, instants.at(made++));
      });
  bench.measure_times(40);
  return instants;
}

// Then they contradict each other at the tip, too, whatever its shape.
TEST(PreshapedEstimator, WhileTheRoomIsWrongNobodyAsksForHooks) {
  for (const Discord of_the_room : {Discord::kRegistration, Discord::kMagnification}) {
    EXPECT_EQ(instants_while(of_the_room)[1], 0);
  }
  for (const Discord other : {Discord::kNone, Discord::kArcLengths, Discord::kCoil}) {
    EXPECT_GT(instants_while(other)[1], 20);
  }
}

TEST(PreshapedEstimator, ATipBeyondTheCoilsIsDoubtedFromTheFirstImageOn) {
  PreshapedBench bench({8, 0, 0}, 15, RestShape::kUnknown);
  bench.with_images = false;  // fluoroscopy is off at first
  bench.measure_times(8);
  bench.with_images = true;
  bench.measure_times(4);
  ASSERT_TRUE(bench.estimate->has_image);
  EXPECT_TRUE(bench.estimate->reasons.has(Reason::kAmbiguous));
}

TEST(PreshapedEstimator, AHookThatNobodyToldOfIsDoubtedOrNearEnough) {
  for (const double roll_rad : {0.0, 0.8, 1.6, 3.0, 4.5}) {
    PreshapedBench bench({8, 14, roll_rad}, 6, RestShape::kUnknown);
    bench.measure_times(120);
    const bool is_believed = bench.estimate->validity == Validity::kValid;
    EXPECT_TRUE(!is_believed || bench.tip_error_mm() < 3.5) << roll_rad << ' ' << bench.tip_error_mm();
  }
}

// The camera looks along z.
TEST(PreshapedEstimator, OfAStraightTipThatImagesShowNothingChangesButItsDepth) {
  PreshapedBench straight({8, 0, 0}, 10, RestShape::kStraight);
  PreshapedBench unknown({8, 0, 0}, 10, RestShape::kUnknown);
  straight.measure_times(160);
  unknown.measure_times(160);
  for (std::size_t i = 0; i < straight.estimate->point_count; ++i) {
    const CentrelinePoint& told = straight.estimate->points[i];
    const CentrelinePoint& not_told = unknown.estimate->points[i];
    ASSERT_EQ(told.p_world_mm, not_told.p_world_mm);
    ASSERT_TRUE(std::equal(told.covariance_mm2.begin(), told.covariance_mm2.begin() + 5,
                           not_told.covariance_mm2.begin()));
    const bool is_before_the_coil = place_of_point_mm(i, *straight.estimate) < 10;
    ASSERT_EQ(told.covariance_mm2[5] < not_told.covariance_mm2[5], is_before_the_coil) << "point " << i;
  }
  EXPECT_EQ(unknown.estimate->validity, Validity::kValid);
}

TEST(PreshapedEstimator, ATipThatNoImageShowsMayBendToAllSides) {
  PreshapedBench straight({8, 0, 0}, 10, RestShape::kStraight);
  PreshapedBench unknown({8, 0, 0}, 10, RestShape::kUnknown);
  for (PreshapedBench* bench : {&straight, &unknown}) {
    bench->with_images = false;
    bench->measure_times(8);
  }
  for (const std::size_t axis : {0U, 3U, 5U}) {
    const double told_mm2 = straight.estimate->points[0].covariance_mm2[axis];
    // A hook of 8 mm with probability 0.2 over 10 mm.
    EXPECT_NEAR(unknown.estimate->points[0].covariance_mm2[axis], told_mm2 + 2.795 * 2.795, 0.02);
  }
}

TEST(PreshapedEstimator, WithoutACoilInTheHookOneViewIsDoubtedAndTwoAreNot) {
  PreshapedBench one({8, 14, 1}, 15, RestShape::kHook);
  one.measure_times(120);
  EXPECT_EQ(one.estimate->validity, Validity::kQuestionable);
  EXPECT_TRUE(one.estimate->reasons.has(Reason::kAmbiguous));
  EXPECT_FALSE(one.estimate->reasons.has(Reason::kTipNotSeen));
  EXPECT_NE(one.words().find("mount a coil inside the hook"), std::string::npos) << one.words();

  PreshapedBench two({8, 14, 1}, 15, RestShape::kHook, EstimatorMode::kFilter, true);
  two.measure_times(120);
  EXPECT_EQ(two.estimate->validity, Validity::kValid) << two.words();
  EXPECT_FALSE(two.estimate->reasons.has(Reason::kAmbiguous));
  EXPECT_LT(two.tip_error_mm(), 1.5);
}

TEST(PreshapedEstimator, BeforeAnImageNobodyKnowsTheRollOfAHook) {
  PreshapedBench bench({8, 14, 1}, 6, RestShape::kHook);
  bench.with_images = false;
  bench.measure_times(60);
  EXPECT_EQ(bench.estimate->validity, Validity::kQuestionable);
  EXPECT_NE(bench.words().find("no image has shown yet"), std::string::npos) << bench.words();
  bench.with_images = true;
  bench.measure_times(60);
  EXPECT_EQ(bench.estimate->validity, Validity::kValid) << bench.words();
}

TEST(PreshapedEstimator, TheWrongInstrumentIsTold) {
  PreshapedBench bench({8, 0, 0}, 6, RestShape::kHook);
  bench.measure_times(160);
  EXPECT_EQ(bench.estimate->validity, Validity::kQuestionable);
  EXPECT_TRUE(bench.estimate->reasons.has(Reason::kTipNotSeen));
  EXPECT_NE(bench.words().find("a hook is configured"), std::string::npos) << bench.words();
  EXPECT_LT(bench.tip_error_mm(), 2);
}

TEST(PreshapedEstimator, AHookWhereAStraightTipIsConfiguredIsTold) {
  PreshapedBench bench({8, 14, 1}, 6, RestShape::kStraight);
  bench.measure_times(160);
  EXPECT_EQ(bench.estimate->validity, Validity::kQuestionable);
  EXPECT_TRUE(bench.estimate->reasons.has(Reason::kTipNotSeen));
  EXPECT_EQ(bench.estimate->points[0].held_by & kHeldByCoil, 0);
}

TEST(PreshapedEstimator, WhoKnowsOfStraightTipsAloneDoesNotHaveAHookBelieved) {
  for (const EstimatorMode mode : {EstimatorMode::kEm, EstimatorMode::kPaper}) {
    PreshapedBench bench({8, 14, 1}, 6, RestShape::kHook, mode);
    bench.measure_times(40);
    EXPECT_NE(bench.estimate->validity, Validity::kValid) << name_of(mode);
    EXPECT_TRUE(bench.estimate->reasons.has(Reason::kTipNotSeen)) << name_of(mode);
    EXPECT_EQ(bench.estimate->points[0].held_by & kHeldByCoil, 0) << name_of(mode);
    EXPECT_NE(bench.words().find("is taken for straight"), std::string::npos) << bench.words();
  }
  PreshapedBench straight({8, 0, 0}, 6, RestShape::kStraight, EstimatorMode::kEm);
  straight.measure_times(40);
  EXPECT_EQ(straight.estimate->validity, Validity::kValid);
}

// A quarter as bent as told: a wire is in it, or it is another one. The shape is right.
TEST(PreshapedEstimator, AHookThatIsFarStraighterThanItIsMadeIsTold) {
  PreshapedBench bench({32, 14, 1}, 6, RestShape::kHook);
  bench.measure_times(160);
  EXPECT_EQ(bench.estimate->validity, Validity::kQuestionable);
  EXPECT_TRUE(bench.estimate->reasons.has(Reason::kTipNotSeen));
  EXPECT_NE(bench.words().find("far straighter than rest_shape says"), std::string::npos) << bench.words();
  EXPECT_LT(bench.tip_error_mm(), 2);
}

// Behind a straight end of 10 mm the tube is turned by 100 degrees: for a straight tip the coil there is
// wrong.
TEST(PreshapedEstimator, ACoilThatArcsHaveTurnedAwayIsNoOutlier) {
  for (const double roll_rad : {0.0, 1.6, 3.1, 4.7}) {
    PreshapedBench bench({0, 24, roll_rad, {{10, 0}, {14, 8}}}, 10, RestShape::kArcs);
    bench.measure_times(120);
    EXPECT_EQ(bench.estimate->validity, Validity::kValid) << bench.words();
    EXPECT_FALSE(bench.estimate->reasons.has(Reason::kCoilOutlier)) << roll_rad;
    EXPECT_LT(bench.tip_error_mm(), 4.5) << roll_rad;
  }
}

TEST(PreshapedEstimator, AResetForgetsTheHook) {
  PreshapedBench bench({8, 14, 3}, 6, RestShape::kUnknown);
  bench.measure_times(200);
  ASSERT_GT(bench.estimate->coefficient_count, 40U);
  bench.estimator->reset();
  bench.measure_times(1);
  EXPECT_EQ(bench.estimate->coefficient_count,
            static_cast<std::uint32_t>(EstimatorSettings{}.coefficient_count));
}

TEST(PreshapedEstimator, CoefficientsAreDenseEnoughForAHookAndNoMoreThanThereCanBe) {
  const auto count = [](double length_mm) {
    return PreshapedEstimator::settings_for_hooks({}, length_mm).coefficient_count;
  };
  EXPECT_EQ(count(100), EstimatorSettings{}.coefficient_count);  // 4.3 mm apart already
  EXPECT_LE(380.0 / (count(380) - 3), PreshapedEstimator::kHookSpacing_mm);
  EXPECT_EQ(count(1000), kMaxCoefficients);
}

}  // namespace
}  // namespace tubed
