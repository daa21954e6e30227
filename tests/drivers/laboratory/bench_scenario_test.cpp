#include "drivers/laboratory/bench_scenario.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "drivers/laboratory/played_run.hpp"
#include "idl/geometry/camera.hpp"

namespace tubed {
namespace {

constexpr std::int64_t kSeed = 3;

/// Times of the exposures in a halt.
std::vector<double> exposures_in(const Scenario& scenario, const TimeSpan& halt) {
  std::vector<double> times_s;
  for (int k = 1; k <= scenario.duration_s() * scenario.frame_rate_hz; ++k) {
    const double t_s = k / scenario.frame_rate_hz;
    if (halt.contains(t_s)) times_s.push_back(t_s);
  }
  return times_s;
}

TEST(BenchScenario, ItsGeometryIsThatOfThePaper) {
  const Scenario bench = make_scenario("bench", kSeed);
  std::vector<double> offsets_mm;
  for (const CoilPlacement& coil : bench.room.instruments.front().coils) {
    offsets_mm.push_back(coil.offset_from_tip_mm);
  }
  EXPECT_EQ(offsets_mm, (std::vector<double>{8, 8 + 86, 8 + 86 + 80, 8 + 86 + 80 + 100}));
  ASSERT_EQ(bench.room.cameras.size(), 1U);
  const CameraCalibration& camera = bench.room.cameras.front();
  EXPECT_EQ(camera.width, 400);
  EXPECT_EQ(camera.height, 600);
  EXPECT_EQ(camera.fx, 2900);
  EXPECT_EQ(camera.fy, 2900);
  EXPECT_EQ(camera.cx, 200);
  EXPECT_EQ(camera.cy, 300);
  EXPECT_NEAR((camera.T_camera_world * Eigen::Vector3d(0, 0, -55) - Eigen::Vector3d(0, 0, 1200)).norm(), 0,
              1e-9);
  EXPECT_EQ(bench_registration(bench).residual_mm.size(), 13U);
  EXPECT_EQ(bench.halts.size(), 5U);
}

TEST(BenchScenario, TheRoomIsDescribedWithWhatTheMarkersGive) {
  const Scenario bench = make_scenario("bench", kSeed);
  const SimulatedRegistration markers = bench_registration(bench);
  EXPECT_EQ(bench.room.T_world_em.matrix(), markers.T_world_em.matrix());
  EXPECT_FALSE(bench.registration_error.isApprox(RigidTransform::Identity(), 1e-4));
  // With the true registration and without the field's bend the residuals are the localisation's alone.
  const RigidTransform T_world_em = bench.room.T_world_em * bench.registration_error;
  EXPECT_LT((T_world_em * markers.found_em_mm - markers.found_ct_mm).colwise().norm().maxCoeff(),
            4 + 4 * 1.24 * 1.8);
}

TEST(BenchScenario, EachHaltHasOneImageAtItsEndAndNothingElseHasAny) {
  const Scenario bench = make_scenario("bench", kSeed);
  std::size_t in_halts = 0;
  for (const TimeSpan& halt : bench.halts) {
    const std::vector<double> times_s = exposures_in(bench, halt);
    ASSERT_EQ(times_s.size(), 15U);
    for (std::size_t i = 0; i < times_s.size(); ++i) {
      EXPECT_EQ(bench.fluoroscopy_on(times_s[i]), i + 1 == times_s.size()) << i;
      in_halts += bench.fluoroscopy_on(times_s[i]) ? 1 : 0;
    }
  }
  std::size_t everywhere = 0;
  for (const double t_s : exposures_in(bench, {0, bench.duration_s() + 1})) {
    everywhere += bench.fluoroscopy_on(t_s) ? 1 : 0;
  }
  EXPECT_EQ(everywhere, in_halts);
}

TEST(BenchScenario, TheCatheterStandsStillInAHaltAndItsTipIsInTheImage) {
  const Scenario bench = make_scenario("bench", kSeed);
  const PlayedRun played(shared_run_of(bench), bench.steps_per_s);
  const Camera camera(bench.room.cameras.front());
  double before_mm = 0;
  for (const TimeSpan& halt : bench.halts) {
    const std::vector<double> times_s = exposures_in(bench, halt);
    for (const double s_mm : {0.0, 94.0, 274.0}) {
      const Eigen::Vector3d moved_mm =
          played.at(times_s.front(), s_mm).p_world_mm - played.at(times_s.back(), s_mm).p_world_mm;
      EXPECT_LT(moved_mm.norm(), 0.01) << s_mm;
    }
    const auto tip = camera.project(played.at(times_s.back(), 0).p_world_mm);
    ASSERT_TRUE(tip);
    EXPECT_TRUE(camera.contains(tip->p_image_px, 10)) << tip->p_image_px.transpose();
    EXPECT_GT(played.insertion_mm(times_s.back()), before_mm) << "further in than at the halt before";
    before_mm = played.insertion_mm(times_s.back());
  }
}

TEST(BenchScenario, AnotherSeedHaltsElsewhereAndIsRegisteredOtherwise) {
  const Scenario one = make_scenario("bench", 1);
  const Scenario other = make_scenario("bench", 2);
  EXPECT_NE(one.halts.front().from_s, other.halts.front().from_s);
  EXPECT_GT((one.registration_error.translation() - other.registration_error.translation()).norm(), 0.05);
}

}  // namespace
}  // namespace tubed
