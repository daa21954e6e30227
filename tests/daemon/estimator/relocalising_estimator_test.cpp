#include "daemon/estimator/view/relocalising_estimator.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <memory>
#include <string>

#include "tests/daemon/estimator/simulated_tube.hpp"

namespace tubed {
namespace {

constexpr double kRadians = M_PI / 180;

/// An estimator that is shown an arc, pushed to and fro, by a view whose pose is right at first; then the
/// view moves, and nobody says where to.
struct MovedViewBench {
  MovedViewBench() { estimator = make_estimator(settings, room.instruments.front(), room); }

  /// Ten measurements and images a second.
  const TubeEstimate& look() {
    now += std::chrono::milliseconds(100);
    EmFrame frame = measure_coils(room, now, 2, ++seed);
    frame.tracker_frame = seed;
    const Eigen::Vector3d pushed_mm =
        carried_mm + 20 * std::sin(2 * M_PI * seed / 60.0) * Eigen::Vector3d(0.6, 0.4, 0.7).normalized();
    for (int i = 0; i < frame.coil_count; ++i) frame.coils[static_cast<std::size_t>(i)].p_em_mm += pushed_mm;
    history->add(frame);
    Observation observation;
    observation.instant = observation.now = now;
    observation.em = history.get();
    observation.is_image_instant = true;
    observation.image_timeout = std::chrono::milliseconds(300);
    RoomDescription seen_from = room;
    seen_from.cameras[0].T_camera_world = true_pose() * Eigen::Translation3d(pushed_mm);
    image = image_of_arc(seen_from, now, hidden);
    observation.geometry_changed = is_moved;
    observation.fluoroscopy_off = is_off;
    if (is_off) {
      observation.newest_image = now - std::chrono::milliseconds(100);
    } else if (is_moved) {
      observation.moved[0] = {&image, nullptr, moves, has_settled, is_suspect_here, motion};
      observation.newest_left_out = now;
    } else {
      observation.images[0] = &image;
      observation.newest_image = now;
    }
    if (room.cameras.size() > 1 && !is_off) {
      seen_from.cameras[1].T_camera_world = room.cameras[1].T_camera_world * Eigen::Translation3d(pushed_mm);
      second_image = image_of_arc(seen_from, now, {}, 1);
      observation.images[1] = &second_image;
      observation.newest_image = now;
    }
    estimator->estimate(observation, *estimate);
    return *estimate;
  }
  void look_times(int count) {
    for (int i = 0; i < count; ++i) look();
  }

  [[nodiscard]] RigidTransform true_pose() const {
    RigidTransform T = room.cameras[0].T_camera_world;
    T.pretranslate(Eigen::Vector3d(0, 0, -1200))
        .prerotate(Eigen::AngleAxisd(turn_deg * kRadians, Eigen::Vector3d::UnitY()))
        .pretranslate(Eigen::Vector3d(pan_mm.x(), pan_mm.y(), 1200));
    return T;
  }

  /// It moves within a second, and settles.
  void move(const Eigen::Vector2d& pan, double turn) {
    is_moved = true;
    ++moves;
    has_settled = false;
    const Eigen::Vector2d from_mm = pan_mm;
    const double from_deg = turn_deg;
    for (int i = 1; i <= 20; ++i) {
      pan_mm = from_mm + i / 20.0 * (pan - from_mm);
      turn_deg = from_deg + i / 20.0 * (turn - from_deg);
      look();
    }
    has_settled = true;
  }

  /// The table is panned, and the view found again.
  void pan_and_be_found() {
    look_times(30);
    move({9, -7}, 0);
    look_times(80);
    ASSERT_TRUE(estimate->has_image);
  }

  /// It moves while fluoroscopy is off.
  void move_unseen(const Eigen::Vector2d& pan, double turn) {
    is_off = true;
    look_times(10);
    is_off = false;
    is_moved = has_settled = true;
    ++moves;
    pan_mm = pan;
    turn_deg = turn;
  }

  /// How far the pose in use projects the arc's points beside where they are seen, root mean square, as mm of
  /// the patient; 1e9: no view is used.
  [[nodiscard]] double off_across_mm() const {
    if (estimate->view_count == 0) return 1e9;
    const Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> used(
        estimate->views[0].T_camera_world.data());
    double sum = 0;
    for (int s = 100; s < 260; s += 20) {
      const Eigen::Vector4d p_world = arc_point(s).homogeneous();
      const Eigen::Vector3d off = (used * p_world - true_pose().matrix() * p_world).head<3>();
      sum += off.head<2>().squaredNorm() / 8;
    }
    return std::sqrt(sum);
  }

  /// How far the pose in use is turned about the image's vertical axis against the true one.
  [[nodiscard]] double turn_off_deg() const {
    const Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> used(
        estimate->views[0].T_camera_world.data());
    const Eigen::AngleAxisd off(
        Eigen::Matrix3d(used.topLeftCorner<3, 3>() * true_pose().linear().transpose()));
    return off.angle() * off.axis().y() / kRadians;
  }
  [[nodiscard]] double sigma_of_turn_deg() const {
    return static_cast<double>(estimate->views[0].sigma_rotation_rad[1]) / kRadians;
  }

  [[nodiscard]] double sigma_mm(std::size_t point) const {
    const auto& c = estimate->points[point].covariance_mm2;
    return std::sqrt(c[0] + c[3]);  // across the view, which looks along z
  }

  /// What is said of the views; empty: nothing.
  [[nodiscard]] std::string moved_view() const {
    std::array<char, 200> words{};
    return estimator->describe_moved_view(words) ? std::string(words.data()) : std::string();
  }

  /// A second view, at a right angle to the first one; it stays.
  void add_side_view() {
    CameraCalibration side = room.cameras.front();
    side.name = "B";
    side.T_camera_world.linear() = Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitY()).matrix();
    room.cameras.push_back(side);
    estimator = make_estimator(settings, room.instruments.front(), room);
  }

  RoomDescription room = one_view_room();
  EstimatorSettings settings;
  std::unique_ptr<Estimator> estimator;
  std::unique_ptr<EmHistory> history = std::make_unique<EmHistory>();
  std::unique_ptr<TubeEstimate> estimate = std::make_unique<TubeEstimate>();
  ImageMeasurement image;
  ImageMeasurement second_image;
  Eigen::Vector3d carried_mm = Eigen::Vector3d::Zero();  ///< the catheter as a whole
  MonotonicTime now = from_ns(10'000'000'000);
  unsigned seed = 0;
  bool is_moved = false;
  bool is_off = false;
  bool is_suspect_here = false;
  bool has_settled = false;
  std::uint32_t moves = 0;
  BackgroundMotion motion;
  Stretch hidden;
  Eigen::Vector2d pan_mm{0, 0};
  double turn_deg = 0;
};

TEST(RelocalisingEstimator, WhileTheViewStaysItsImagesAreUsedAsTheyAre) {
  MovedViewBench bench;
  bench.look_times(30);
  EXPECT_TRUE(bench.estimate->has_image);
  EXPECT_FALSE(bench.estimate->views[0].has_own_geometry);
  EXPECT_FALSE(bench.estimate->reasons.has(Reason::kGeometryChanged));
}

TEST(RelocalisingEstimator, APanThatNobodyAnnouncedIsFoundAndItsImagesAreUsedAgain) {
  MovedViewBench bench;
  bench.look_times(30);
  bench.move({9, -7}, 0);
  EXPECT_FALSE(bench.estimate->has_image) << "before it has settled";
  bench.motion = {BackgroundMotion::Kind::kPanned, {10, -8}, 1, 0.9};
  bench.look_times(80);
  EXPECT_TRUE(bench.estimate->has_image);
  EXPECT_LT(bench.off_across_mm(), 1.5);
  EXPECT_TRUE(bench.estimate->views[0].has_own_geometry);
}

// A person has to give the pose, or to accept this one.
TEST(RelocalisingEstimator, ThatThePoseWasFoundMakesNoShapeValid) {
  MovedViewBench bench;
  ASSERT_NO_FATAL_FAILURE(bench.pan_and_be_found());
  EXPECT_TRUE(bench.estimate->reasons.has(Reason::kGeometryChanged));
  EXPECT_EQ(bench.estimate->validity, Validity::kQuestionable);
}

// What its images taught of the coils is as good as its pose.
TEST(RelocalisingEstimator, NorDoesFluoroscopyThatGoesOff) {
  MovedViewBench bench;
  ASSERT_NO_FATAL_FAILURE(bench.pan_and_be_found());
  bench.is_off = true;
  for (int i = 0; i < 20; ++i) {
    EXPECT_EQ(bench.look().validity, Validity::kQuestionable) << "look " << i;
    EXPECT_TRUE(bench.estimate->reasons.has(Reason::kGeometryChanged)) << "look " << i;
  }
}

TEST(RelocalisingEstimator, AnImageThatMayHaveMovedOnIsNotUsed) {
  MovedViewBench bench;
  ASSERT_NO_FATAL_FAILURE(bench.pan_and_be_found());
  bench.is_suspect_here = true;
  EXPECT_FALSE(bench.look().has_image);
  bench.is_suspect_here = false;
  EXPECT_TRUE(bench.look().has_image);
}

// A registration that is stated to be off by more makes the pose as doubtful, however many images agree.
TEST(RelocalisingEstimator, WhatIsStatedOfTheRegistrationIsOpenOfThePose) {
  std::array<double, 2> sigma_mm{};
  for (const bool is_good : {false, true}) {
    MovedViewBench bench;
    bench.room.registration_residual_mm = is_good ? 0.2 : 3;
    bench.estimator = make_estimator(bench.settings, bench.room.instruments.front(), bench.room);
    bench.look_times(30);
    bench.move({9, -7}, 0);
    bench.look_times(160);
    ASSERT_TRUE(bench.estimate->has_image);
    sigma_mm.at(is_good ? 1 : 0) = static_cast<double>(bench.estimate->views[0].sigma_translation_mm[0]);
  }
  EXPECT_GT(sigma_mm[0], 3 / std::sqrt(3.0)) << "an axis of it";
  EXPECT_LT(sigma_mm[1], sigma_mm[0] - 0.3);
}

TEST(RelocalisingEstimator, ATurnIsFollowedWhileTheCArmTurns) {
  MovedViewBench bench;
  bench.look_times(30);
  bench.move({0, 0}, 15);
  bench.motion.kind = BackgroundMotion::Kind::kTurned;
  bench.look_times(80);
  EXPECT_TRUE(bench.estimate->has_image);
  EXPECT_LT(bench.off_across_mm(), 1.5);
}

TEST(RelocalisingEstimator, ATurnThatNoImageShowedIsFound) {
  for (const double turn : {25.0, -35.0}) {
    MovedViewBench bench;
    bench.look_times(30);
    bench.move_unseen({6, 0}, turn);
    for (int i = 0; i < 300 && bench.look().view_count == 0; ++i) {
    }
    ASSERT_GT(bench.estimate->view_count, 0U) << turn;
    bench.look_times(200);
    EXPECT_LT(bench.off_across_mm(), 1.5) << turn;
    EXPECT_LT(std::abs(bench.turn_off_deg()), std::max(2.0, 3 * bench.sigma_of_turn_deg())) << turn;
    EXPECT_TRUE(bench.estimate->reasons.has(Reason::kGeometryChanged));
  }
}

/// The view is used again, and as it stands.
void expect_found(MovedViewBench& bench, int images) {
  for (int i = 0; i < images && bench.look().view_count == 0; ++i) {
  }
  ASSERT_GT(bench.estimate->view_count, 0U);
  bench.look_times(200);
  ASSERT_GT(bench.estimate->view_count, 0U);
  EXPECT_LT(bench.off_across_mm(), 1.5);
  EXPECT_LT(std::abs(bench.turn_off_deg()), std::max(2.0, 3 * bench.sigma_of_turn_deg()));
  EXPECT_TRUE(bench.estimate->reasons.has(Reason::kGeometryChanged));
}

// Its beginning was seen, the rest was not noticed.
TEST(RelocalisingEstimator, AMoveThatGoesOnWithoutBeingNoticedIsFound) {
  MovedViewBench bench;
  bench.look_times(30);
  bench.move({3, 0}, 0);
  bench.pan_mm = {16, -10};
  bench.turn_deg = 20;
  expect_found(bench, 400);
}

// The second turn comes before the first was found.
TEST(RelocalisingEstimator, AViewThatIsTurnedAgainWhileItIsLookedForIsFound) {
  MovedViewBench bench;
  bench.look_times(30);
  bench.move_unseen({0, 0}, 30);
  bench.look_times(4);
  bench.move_unseen({0, 0}, -20);
  expect_found(bench, 400);
}

// No move was noticed: that the tube is not there any more tells.
TEST(RelocalisingEstimator, APoseThatNoLongerHoldsIsGivenUpAndAnotherOneFound) {
  MovedViewBench bench;
  ASSERT_NO_FATAL_FAILURE(bench.pan_and_be_found());
  bench.pan_mm = {24, 0};
  bench.look_times(12);
  EXPECT_NE(bench.moved_view().find("is lost"), std::string::npos) << bench.moved_view();
  expect_found(bench, 400);
}

// The other view, which still has the tube in its picture, says nothing of this one.
TEST(RelocalisingEstimator, APoseWhosePictureTheTubeLeavesIsKept) {
  MovedViewBench bench;
  bench.add_side_view();
  ASSERT_NO_FATAL_FAILURE(bench.pan_and_be_found());
  for (int i = 0; i < 40; ++i) {
    bench.carried_mm.x() += 10;  // along the second view's rays
    bench.look();
  }
  ASSERT_FALSE(uses(*bench.estimate, 0, bench.now));
  ASSERT_TRUE(uses(*bench.estimate, 1, bench.now));
  bench.look_times(20);
  EXPECT_EQ(bench.moved_view().find("is lost"), std::string::npos) << bench.moved_view();
}

// Nothing that was found before a reset is used after it.
TEST(RelocalisingEstimator, AResetForgetsThePoseThatWasFound) {
  MovedViewBench bench;
  ASSERT_NO_FATAL_FAILURE(bench.pan_and_be_found());
  bench.estimator->reset();
  EXPECT_FALSE(bench.look().has_image);
  expect_found(bench, 400);
}

// The catheter goes on to other places, and what it shows there is worth as much as before the pose was used.
TEST(RelocalisingEstimator, APoseThatIsUsedGetsBetter) {
  MovedViewBench bench;
  bench.look_times(30);
  bench.move({0, 0}, 15);
  bench.motion.kind = BackgroundMotion::Kind::kTurned;
  while (!bench.estimate->has_image && bench.seed < 300) bench.look();
  ASSERT_TRUE(bench.estimate->has_image);
  const double first_sigma_deg = bench.sigma_of_turn_deg();
  bench.look_times(400);
  ASSERT_TRUE(bench.estimate->has_image);
  EXPECT_LT(bench.sigma_of_turn_deg(), 0.8 * first_sigma_deg);
  EXPECT_LT(std::abs(bench.turn_off_deg()), 3 * bench.sigma_of_turn_deg());
  EXPECT_LT(bench.off_across_mm(), 1.5);
}

// As sure as an image makes it, but no surer than the pose.
TEST(RelocalisingEstimator, WhatThePoseLeavesOpenIsPartOfTheCovariance) {
  MovedViewBench bench;
  bench.look_times(30);
  const double given_mm = bench.sigma_mm(50);
  bench.move({9, -7}, 0);
  bench.look_times(80);
  ASSERT_TRUE(bench.estimate->has_image);
  EXPECT_GT(bench.sigma_mm(50), 2 * given_mm);
  EXPECT_LT(bench.sigma_mm(50), 3);
}

TEST(RelocalisingEstimator, AViewThatMovesOnIsLostAndFoundAgain) {
  MovedViewBench bench;
  ASSERT_NO_FATAL_FAILURE(bench.pan_and_be_found());
  bench.move({20, 5}, 0);
  EXPECT_FALSE(bench.estimate->has_image);
  bench.look_times(80);
  EXPECT_TRUE(bench.estimate->has_image);
  EXPECT_LT(bench.off_across_mm(), 1.5);
}

TEST(RelocalisingEstimator, AViewThatIsBackHasThePoseThatWasGiven) {
  MovedViewBench bench;
  bench.look_times(30);
  bench.move({9, -7}, 0);
  bench.look_times(80);
  bench.is_moved = false;
  bench.pan_mm.setZero();
  bench.look_times(5);
  EXPECT_FALSE(bench.estimate->views[0].has_own_geometry);
  EXPECT_FALSE(bench.estimate->reasons.has(Reason::kGeometryChanged));
}

// Nothing to be seen: nothing is found.
TEST(RelocalisingEstimator, APictureWithoutTheTubeGivesNoPose) {
  MovedViewBench bench;
  bench.look_times(30);
  bench.hidden = {-1, 400};
  bench.move({9, -7}, 0);
  bench.look_times(80);
  EXPECT_FALSE(bench.estimate->has_image);
}

// Another instrument's estimator has a pose of its own: what one of them lent is taken back.
TEST(RelocalisingEstimator, TheImageIsLeftAsItWas) {
  MovedViewBench bench;
  ASSERT_NO_FATAL_FAILURE(bench.pan_and_be_found());
  EXPECT_FALSE(bench.image.geometry.has_value());
  EXPECT_FALSE(bench.image.brought_geometry);
}

}  // namespace
}  // namespace tubed
