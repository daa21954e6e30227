#include "daemon/estimator/coil_image_agreement.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <functional>
#include <memory>
#include <random>
#include <string>

#include "daemon/estimator/agreement_words.hpp"
#include "idl/geometry/degree.hpp"
#include "tests/daemon/estimator/simulated_tube.hpp"

namespace tubed {
namespace {

constexpr double kNoise_mm = 0.5;
constexpr double kMiddle_mm = 190;  // of the tube
constexpr std::chrono::milliseconds kPeriod{100};

/// From behind the second view of the tests of two.
RoomDescription two_views() {
  RoomDescription room = one_view_room();
  CameraCalibration side = room.cameras.front();
  side.name = "B";
  side.T_camera_world.linear() = Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitY()).matrix();
  room.cameras.push_back(side);
  return room;
}

/// Where a coil is measured instead of where it is.
using Mistake = std::function<Eigen::Vector3d(const Eigen::Vector3d& p_mm, int coil, double t_s)>;

Eigen::Vector3d as_it_is(const Eigen::Vector3d& p_mm, int /*coil*/, double /*t_s*/) { return p_mm; }

/// The arc, which images confirm, and coils that are measured on it, by mistake somewhere else.
class Bench {
 public:
  explicit Bench(RoomDescription room = one_view_room(), unsigned seed = 1)
      : room_(std::move(room)),
        map_(EstimatorSettings{}, 380),
        random_(seed),
        agreement_({}, room_.instruments.front(), static_cast<int>(room_.cameras.size())) {
    for (const CameraCalibration& camera : room_.cameras) {
      cameras_.emplace_back(camera);
    }
    C_ = Eigen::Matrix3Xd::Zero(3, map_.column_count());
    const CoilObservations coils = observed(as_it_is, 0);
    bool converged = false;
    map_.solve_linear(coils, C_);
    map_.refine(coils, {}, nullptr, 20, C_, converged);
  }

  /// How far the tube as a whole is from where it was at the beginning, at a time.
  std::function<Eigen::Vector3d(double t_s)> motion_mm = [](double) { return Eigen::Vector3d::Zero(); };
  double noise_mm = kNoise_mm;
  double image_scale = 1;  ///< of the first image, about its middle; the shape keeps its length
  double end_mm = 0;       ///< by which the tube ends further out in the image
  bool shows_end = true;
  CoilState third = CoilState::kUsed;  ///< of the third coil

  const CoilImageAgreement& watch(double seconds, const Mistake& mistake) {
    for (int i = 0; i < static_cast<int>(seconds * 10); ++i) {
      now_ += kPeriod;
      const double t_s = static_cast<double>(to_ns(now_)) * 1e-9;
      Eigen::Matrix3Xd C = image_scale == 1 ? C_ : scaled();
      C.leftCols(map_.spline().coefficient_count()).colwise() += motion_mm(t_s);
      agreement_.observe(observed(mistake, t_s), {now_, map_.spline(), C, lines(C)}, kNoise_mm, 0.5);
    }
    return agreement_;
  }

  [[nodiscard]] Eigen::Vector3d sigma_mm(double s_mm) const {
    return agreement_.doubt(arc_point(s_mm), -arc_tangent_to_tip(s_mm), now_)
        .diagonal()
        .cwiseMax(0)
        .cwiseSqrt();
  }
  const CoilImageAgreement& forget() {
    agreement_.reset();
    return agreement_;
  }
  [[nodiscard]] MonotonicTime now() const { return now_; }
  [[nodiscard]] std::string words() const {
    std::array<char, 256> text{};
    write_disagreement(agreement_.verdict(), room_.instruments.front(), room_.cameras, text);
    return text.data();
  }

 private:
  CoilObservations observed(const Mistake& mistake, double t_s) {
    std::normal_distribution<double> normal(0, noise_mm);
    CoilObservations coils;
    for (const CoilPlacement& coil : room_.instruments.front().coils) {
      const int i = coils.count++;
      CoilObservation& seen = coils.coils[static_cast<std::size_t>(i)];
      const Eigen::Vector3d p_mm = arc_point(coil.offset_from_tip_mm) + motion_mm(t_s);
      seen.state = i == 2 ? third : CoilState::kUsed;
      seen.s_mm = coil.offset_from_tip_mm;
      seen.p_world_mm =
          mistake(p_mm, i, t_s) + Eigen::Vector3d(normal(random_), normal(random_), normal(random_));
      seen.tangent_world = arc_tangent_to_tip(coil.offset_from_tip_mm);
    }
    return coils;
  }

  Eigen::Matrix3Xd scaled() {
    CoilObservations coils = observed(as_it_is, 0);
    for (int i = 0; i < coils.count; ++i) {
      CoilObservation& coil = coils.coils[static_cast<std::size_t>(i)];
      const double s_mm = kMiddle_mm + (coil.s_mm - kMiddle_mm) / image_scale;
      coil.p_world_mm = arc_point(s_mm);
      coil.p_world_mm.head<2>() *= image_scale;
      coil.tangent_world = arc_tangent_to_tip(s_mm);
    }
    Eigen::Matrix3Xd C = C_;
    bool converged = false;
    map_.solve_linear(coils, C);
    map_.refine(coils, {}, nullptr, 20, C, converged);
    return C;
  }

  std::span<const ViewConstraints> lines(const Eigen::Matrix3Xd& C) {
    views_.clear();
    lines_.resize(cameras_.size());
    for (std::size_t v = 0; v < cameras_.size(); ++v) {
      lines_[v].clear();
      for (double s_mm = 0; s_mm <= 380; s_mm += 2) {
        lines_[v].push_back({s_mm});
      }
      const CubicBasis tip = map_.spline().basis(0);
      const auto p = cameras_[v].project(combine(C, tip.first, tip.value));
      const Eigen::Vector2d outward_px = p->J_image_world * -combine(C, tip.first, tip.first_derivative);
      if (shows_end) lines_[v].push_back({0, p->p_image_px + end_mm * outward_px, outward_px.normalized()});
      views_.push_back({&cameras_[v], lines_[v].data(), static_cast<int>(lines_[v].size())});
    }
    return views_;
  }

  RoomDescription room_;
  TubeMap map_;
  std::mt19937 random_;
  std::vector<Camera> cameras_;
  Eigen::Matrix3Xd C_;
  std::vector<std::vector<LineConstraint>> lines_;
  std::vector<ViewConstraints> views_;
  MonotonicTime now_ = from_ns(1'000'000'000);
  CoilImageAgreement agreement_;
};

Mistake registered_wrong(const Eigen::Vector3d& shift_mm, double turn_rad) {
  return [=](const Eigen::Vector3d& p_mm, int, double) -> Eigen::Vector3d {
    return shift_mm + Eigen::AngleAxisd(turn_rad, Eigen::Vector3d::UnitZ()) * p_mm;
  };
}

TEST(CoilImageAgreement, NothingIsSaidOfARoomThatIsAsStated) {
  int said = 0;
  for (unsigned seed = 1; seed <= 30; ++seed) {
    Bench bench(one_view_room(), seed);
    std::mt19937 random(seed + 100);
    std::normal_distribution<double> normal;
    const Eigen::Vector3d shift_mm(normal(random), normal(random), normal(random));
    said += bench.watch(10, registered_wrong(shift_mm, 0.5 * kDegree * normal(random))).disagree() ? 1 : 0;
  }
  EXPECT_LE(said, 1);  // of 30; each of the others has odds of one in a hundred
}

TEST(CoilImageAgreement, AWrongRegistrationIsNamedWithinTwoSeconds) {
  Bench bench;
  const CoilImageAgreement& agreement = bench.watch(4, registered_wrong({5, 3, 0}, -2 * kDegree));
  EXPECT_TRUE(agreement.disagree());
  EXPECT_EQ(agreement.verdict().explanation, Discord::kRegistration);
  EXPECT_LT(agreement.verdict().as_stated, 0.01);
  EXPECT_NEAR(agreement.verdict().turn_rad.z(), -2 * kDegree, 0.7 * kDegree);
  EXPECT_NE(bench.words().find("cath-1: coils and images disagree: all coils are off together, by about"),
            std::string::npos)
      << bench.words();
}

// One view sees nothing of its own depth: where it is wrong across, it may be as wrong there.
TEST(CoilImageAgreement, WhatIsWrongAcrossIsDoubtedInDepth) {
  Bench bench;
  EXPECT_LT(bench.sigma_mm(200).z(), 0.1);
  bench.watch(5, registered_wrong({5, 3, 0}, 0));
  EXPECT_GT(bench.sigma_mm(200).z(), 4);
  // The image holds it across itself (x, y but for a little perspective), wherever the coils are.
  EXPECT_LT(bench.sigma_mm(200).head<2>().maxCoeff(), 1.2);
}

TEST(CoilImageAgreement, WhatNoImageHasHeldForASecondIsDoubtedAcross) {
  Bench bench;
  const CoilImageAgreement& agreement = bench.watch(5, registered_wrong({5, 3, 0}, 0));
  const Eigen::Matrix3d later = agreement.doubt(arc_point(200), -arc_tangent_to_tip(200),
                                                bench.now() + std::chrono::milliseconds(1100));
  EXPECT_GT(std::sqrt(later.diagonal().head<2>().sum()), 5);
}

TEST(CoilImageAgreement, TwoViewsSeeTheDepth) {
  Bench bench(two_views());
  const CoilImageAgreement& agreement = bench.watch(5, registered_wrong({0, 0, 6}, 0));
  EXPECT_EQ(agreement.verdict().explanation, Discord::kRegistration);
  EXPECT_NEAR(agreement.verdict().shift_mm.z(), 6, 0.5);
  EXPECT_LT(bench.sigma_mm(200).maxCoeff(), 1);  // and hold the shape
}

TEST(CoilImageAgreement, ArcLengthsThatAreTooLargeAreNamed) {
  Bench bench;
  bench.end_mm = -6;
  const CoilImageAgreement& agreement = bench.watch(3, as_it_is);
  EXPECT_TRUE(agreement.disagree());
  EXPECT_EQ(agreement.verdict().explanation, Discord::kArcLengths);
  EXPECT_NEAR(agreement.verdict().end_mm, -6, 0.7);
  EXPECT_NEAR(agreement.verdict().arc_length_mm, 6, 1.5);
  EXPECT_NE(bench.words().find("about 6 mm further back in the image"), std::string::npos) << bench.words();
}

TEST(CoilImageAgreement, AnEndThatLiesElsewhereIsDoubtedAlongTheTube) {
  Bench bench;
  bench.end_mm = 3;
  bench.watch(5, as_it_is);
  const Eigen::Vector3d along = arc_tangent_to_tip(200);
  EXPECT_NEAR(bench.sigma_mm(200).dot(along.cwiseAbs()), 3, 1.5);
}

TEST(CoilImageAgreement, LateImagesAreNamedWhereTheTubeMoves) {
  Bench bench;
  bench.motion_mm = [](double t_s) {
    return Eigen::Vector3d(12 * std::sin(1.5 * t_s), 12 * std::cos(1.1 * t_s), 0);
  };
  constexpr double kLate_s = 0.15;
  // The image of a stamp is older than the coils of that stamp.
  const Mistake mistake = [&bench](const Eigen::Vector3d& p_mm, int, double t_s) -> Eigen::Vector3d {
    return p_mm + bench.motion_mm(t_s + kLate_s) - bench.motion_mm(t_s);
  };
  const CoilImageAgreement& agreement = bench.watch(8, mistake);
  EXPECT_EQ(agreement.verdict().explanation, Discord::kClock);
  EXPECT_NEAR(agreement.verdict().clock_s, kLate_s, 0.04);
  EXPECT_NE(bench.words().find("too late"), std::string::npos) << bench.words();
}

TEST(CoilImageAgreement, AWrongFocalLengthIsNamed) {
  Bench bench;
  bench.image_scale = 1 / 1.08;  // a focal length that is stated 8 % too large makes all of it smaller
  bench.shows_end = false;       // it is shorter than its arc length, which no shape of an estimator is
  const CoilImageAgreement& agreement = bench.watch(5, as_it_is);
  EXPECT_EQ(agreement.verdict().explanation, Discord::kMagnification);
  EXPECT_NEAR(agreement.verdict().magnification, 0.08, 0.02);
  EXPECT_NE(bench.words().find("camera A looks about"), std::string::npos) << bench.words();
}

TEST(CoilImageAgreement, OneCoilIsNamed) {
  Bench bench;
  const CoilImageAgreement& agreement = bench.watch(5, [](const Eigen::Vector3d& p_mm, int coil, double) {
    return coil == 2 ? Eigen::Vector3d(p_mm + Eigen::Vector3d(6, 6, 0)) : p_mm;
  });
  EXPECT_EQ(agreement.verdict().explanation, Discord::kCoil);
  EXPECT_EQ(agreement.verdict().index, 2);
  EXPECT_NE(bench.words().find("coil 3 (sensor 3) is off by about"), std::string::npos) << bench.words();
}

// The first and the last coil, too: nothing lies beyond them that holds the tube.
TEST(CoilImageAgreement, TheCoilWhoseArcLengthIsWrongIsNamed) {
  const std::vector<CoilPlacement> coils = one_view_room().instruments.front().coils;
  for (int wrong = 0; wrong < 5; ++wrong) {
    for (const double too_large_mm : {5.0, -5.0}) {
      Bench bench;
      const CoilImageAgreement& agreement =
          bench.watch(3, [&](const Eigen::Vector3d& p_mm, int coil, double) -> Eigen::Vector3d {
            const double s_mm = coils[static_cast<std::size_t>(coil)].offset_from_tip_mm;
            return coil == wrong ? arc_point(s_mm - too_large_mm) : p_mm;
          });
      SCOPED_TRACE(bench.words());
      EXPECT_TRUE(agreement.disagree());
      EXPECT_EQ(agreement.verdict().explanation, Discord::kCoilArcLength);
      EXPECT_EQ(agreement.verdict().index, wrong);
      EXPECT_NEAR(agreement.verdict().arc_length_mm, too_large_mm, 1);
      EXPECT_NE(bench.words().find(too_large_mm > 0 ? "5 mm nearer to the tip" : "5 mm further from the tip"),
                std::string::npos);
    }
  }
}

// As the tube slides, so does each coil; a field does not follow it.
TEST(CoilImageAgreement, ATubeThatSlidesHasNoWrongArcLengths) {
  const std::vector<CoilPlacement> coils = one_view_room().instruments.front().coils;
  Bench bench;
  const CoilImageAgreement& agreement = bench.watch(3, [&](const Eigen::Vector3d&, int coil, double) {
    return arc_point(coils[static_cast<std::size_t>(coil)].offset_from_tip_mm - 6);
  });
  EXPECT_FALSE(agreement.disagree() && agreement.verdict().explanation == Discord::kCoilArcLength)
      << bench.words();
}

TEST(CoilImageAgreement, ACoilThatWasOffAlongTheTubeForAWhileIsForgiven) {
  const double s_mm = one_view_room().instruments.front().coils[2].offset_from_tip_mm;
  const Mistake along = [s_mm](const Eigen::Vector3d& p_mm, int coil, double) -> Eigen::Vector3d {
    return coil == 2 ? arc_point(s_mm - 9) : p_mm;
  };
  Bench bench;
  bench.watch(0.3, as_it_is);
  EXPECT_TRUE(bench.watch(1.4, along).disagree());
  bench.third = CoilState::kOutlier;
  bench.watch(0.2, as_it_is);
  bench.third = CoilState::kUsed;
  EXPECT_FALSE(bench.watch(0.5, as_it_is).disagree());
}

TEST(CoilImageAgreement, CoilsThatAreOffEachInItsOwnWayAreAField) {
  Bench bench;
  const CoilImageAgreement& agreement = bench.watch(5, [](const Eigen::Vector3d& p_mm, int coil, double) {
    const std::array<Eigen::Vector3d, 5> off_mm{Eigen::Vector3d(5, 4, 0), Eigen::Vector3d(-4, 5, 0),
                                                Eigen::Vector3d(4, -5, 0), Eigen::Vector3d(-5, -4, 0),
                                                Eigen::Vector3d(5, 5, 0)};
    return Eigen::Vector3d(p_mm + off_mm[static_cast<std::size_t>(coil)]);
  });
  EXPECT_EQ(agreement.verdict().explanation, Discord::kField);
  EXPECT_NE(bench.words().find("metal"), std::string::npos) << bench.words();
}

TEST(CoilImageAgreement, WhatIsMendedIsForgotten) {
  Bench bench;
  EXPECT_TRUE(bench.watch(5, registered_wrong({6, 4, 0}, 0)).disagree());
  EXPECT_FALSE(bench.watch(6 * CoilImageAgreement::kMemory_s, as_it_is).disagree());
}

TEST(CoilImageAgreement, ALongMistakeIsForgottenAsSoonAsAShortOne) {
  Bench bench;
  EXPECT_TRUE(bench.watch(10 * CoilImageAgreement::kMemory_s, registered_wrong({6, 4, 0}, 0)).disagree());
  EXPECT_FALSE(bench.watch(6 * CoilImageAgreement::kMemory_s, as_it_is).disagree());
}

TEST(CoilImageAgreement, TheWordIsTakenBackOnlyWhenItIsCertain) {
  Bench bench;
  EXPECT_TRUE(bench.watch(5, registered_wrong({6, 4, 0}, 0)).disagree());
  const CoilImageAgreement* agreement = nullptr;
  double least_certain = 1;
  for (int i = 0; i < 400 && (agreement == nullptr || agreement->disagree()); ++i) {
    agreement = &bench.watch(0.1, as_it_is);
    if (agreement->verdict().as_stated > 0.5) {
      least_certain = std::min(least_certain, agreement->verdict().as_stated);
    }
  }
  EXPECT_FALSE(agreement->disagree());
  EXPECT_GE(agreement->verdict().as_stated, 0.8);
  EXPECT_LT(least_certain, 0.8) << "it went from wrong to certain at once: nothing was tested";
}

TEST(CoilImageAgreement, ACoilThatTheEstimatorLeavesOutIsEvidenceStill) {
  Bench bench;
  bench.third = CoilState::kOutlier;
  const CoilImageAgreement& agreement = bench.watch(5, [](const Eigen::Vector3d& p_mm, int coil, double) {
    return coil == 2 ? Eigen::Vector3d(p_mm + Eigen::Vector3d(6, 6, 0)) : p_mm;
  });
  EXPECT_EQ(agreement.verdict().explanation, Discord::kCoil);
  EXPECT_EQ(agreement.verdict().index, 2);
}

Eigen::Vector3d third_is_off(const Eigen::Vector3d& p_mm, int coil, double /*t_s*/) {
  return coil == 2 ? Eigen::Vector3d(p_mm + Eigen::Vector3d(9, 9, 0)) : p_mm;
}

// As in a burst of wrong measurements that the tracker says are right.
TEST(CoilImageAgreement, ACoilThatComesBackIntoTheGateIsForgiven) {
  Bench bench;
  bench.watch(0.3, as_it_is);
  bench.third = CoilState::kOutlier;
  EXPECT_TRUE(bench.watch(2, third_is_off).disagree());
  bench.third = CoilState::kUsed;
  EXPECT_FALSE(bench.watch(1, as_it_is).disagree());
}

// The gate believes the wrong coil, and leaves it out when it is right again.
TEST(CoilImageAgreement, WhatACoilSaidJustBeforeTheGateLeftItOutIsForgivenToo) {
  Bench bench;
  bench.watch(0.3, as_it_is);
  EXPECT_TRUE(bench.watch(1.4, third_is_off).disagree());
  bench.third = CoilState::kOutlier;
  bench.watch(0.2, as_it_is);
  bench.third = CoilState::kUsed;
  EXPECT_FALSE(bench.watch(0.5, as_it_is).disagree());
}

TEST(CoilImageAgreement, ACoilThatStaysInTheGateIsNotForgiven) {
  Bench bench;
  bench.watch(0.3, as_it_is);
  EXPECT_TRUE(bench.watch(2, third_is_off).disagree());
  EXPECT_TRUE(bench.watch(1, as_it_is).disagree());
}

TEST(CoilImageAgreement, WhatACoilSaidLongBeforeTheGateLeftItOutStays) {
  Bench bench;
  EXPECT_TRUE(bench.watch(6, third_is_off).disagree());
  bench.third = CoilState::kOutlier;
  bench.watch(0.3, as_it_is);
  bench.third = CoilState::kUsed;
  EXPECT_TRUE(bench.watch(1, as_it_is).disagree());
}

TEST(CoilImageAgreement, AfterAResetNothingIsKnown) {
  Bench bench;
  EXPECT_TRUE(bench.watch(5, registered_wrong({6, 4, 0}, 0)).disagree());
  const CoilImageAgreement& agreement = bench.forget();
  EXPECT_FALSE(agreement.disagree());
  EXPECT_EQ(agreement.verdict().explanation, Discord::kNone);
  EXPECT_EQ(bench.sigma_mm(100), Eigen::Vector3d::Zero());
}

TEST(CoilImageAgreement, WordsAreCutToTheirRoom) {
  CoilImageAgreement::Verdict verdict;
  verdict.explanation = Discord::kField;
  std::array<char, 20> text{};
  text.fill('x');
  write_disagreement(verdict, one_view_room().instruments.front(), {}, text);
  EXPECT_EQ(std::string(text.data()), "cath-1: coils and i");
}

}  // namespace
}  // namespace tubed
