#include "bench/accuracy/ct_segmentation.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <stdexcept>

namespace tubed {
namespace {

constexpr double kVoxel_mm = CtSettings{}.voxel_mm;
constexpr double kArch_mm = 40;  ///< radius

/// Down from the arch of 180 deg, the tip at the other end; every mm of arc length, 2 mm out of the plane.
Eigen::Matrix3Xd arch() {
  constexpr Eigen::Index kLength = 290;
  const double half_turn_mm = std::numbers::pi * kArch_mm;
  Eigen::Matrix3Xd points_mm(3, kLength + 1);
  for (Eigen::Index s = 0; s <= kLength; ++s) {
    const double way_mm = static_cast<double>(s) - 60;  // the tip is 60 mm down the short leg
    const double angle = std::clamp(way_mm / kArch_mm, 0.0, std::numbers::pi);
    const double down_mm = way_mm < 0 ? -way_mm : std::max(0.0, way_mm - half_turn_mm);
    points_mm.col(s) << -kArch_mm * std::cos(angle), 2 * std::sin(angle),
        kArch_mm * std::sin(angle) - down_mm;
  }
  return points_mm;
}

struct Distances {
  double rms_mm = 0;
  double max_mm = 0;
};

/// Of one curve's points from the other curve.
Distances distances(const Eigen::Matrix3Xd& from_mm, const Eigen::Matrix3Xd& to_mm) {
  Distances result;
  for (const auto& p_mm : from_mm.colwise()) {
    const double off_mm = (p_mm - closest_point_on(to_mm, p_mm)).norm();
    result.rms_mm += off_mm * off_mm;
    result.max_mm = std::max(result.max_mm, off_mm);
  }
  result.rms_mm = std::sqrt(result.rms_mm / static_cast<double>(from_mm.cols()));
  return result;
}

TEST(CtSegmentation, FindsTheCentrelineToAFractionOfAVoxel) {
  const Eigen::Matrix3Xd truth_mm = arch();
  for (const std::int64_t seed : {1, 2, 3}) {
    const SampledCentreline found = segment_catheter(simulated_ct(truth_mm, {}, seed), truth_mm.col(0));
    const Eigen::Matrix3Xd judged_mm = up_to(found, 274).p_world_mm;
    // A voxel alone would place a point to voxel / sqrt(12) an axis, 0.2 mm across; a slab has a hundred of
    // them.
    EXPECT_LT(distances(judged_mm, truth_mm).rms_mm, kVoxel_mm / 10) << seed;
    EXPECT_LT(distances(judged_mm, truth_mm).max_mm, kVoxel_mm / 2) << seed;
    EXPECT_LT(distances(truth_mm.leftCols(275), found.p_world_mm).max_mm, kVoxel_mm / 2) << seed;
  }
}

TEST(CtSegmentation, BeginsAtTheEndThatAPersonPointsAtAndMeasuresArcLengthFromThere) {
  const Eigen::Matrix3Xd truth_mm = arch();
  const CtScan scan = simulated_ct(truth_mm, {}, 1);
  const SampledCentreline found = segment_catheter(scan, truth_mm.col(0) + Eigen::Vector3d(3, 2, -4));
  EXPECT_LT((found.p_world_mm.col(0) - truth_mm.col(0)).norm(), kVoxel_mm / 2);
  EXPECT_LT((found.p_world_mm.col(200) - truth_mm.col(200)).norm(), kVoxel_mm);
  EXPECT_EQ(found.s_mm[200], 200);
  const SampledCentreline backward = segment_catheter(scan, truth_mm.col(290));
  EXPECT_LT((backward.p_world_mm.col(0) - truth_mm.col(290)).norm(), 3);
}

TEST(CtSegmentation, OfNothingButWaterIsRefused) {
  CtScan empty(0.5, 0, Eigen::Vector3d::Zero());
  EXPECT_THROW(segment_catheter(empty, Eigen::Vector3d::Zero()), std::runtime_error);
  const Eigen::Matrix3Xd stub_mm = arch().leftCols(8);
  EXPECT_THROW(segment_catheter(simulated_ct(stub_mm, {}, 1), stub_mm.col(0)), std::runtime_error);
}

TEST(CtScan, ATubesProfileIsHalfAtItsSurfaceWhereBlurIsSmall) {
  // On the axis of a disc: 1 - exp(-r^2 / (2 sigma^2)).
  EXPECT_NEAR(blurred_disc(0, 1.165, 0.5), 1 - std::exp(-1.165 * 1.165 / 0.5), 1e-4);
  EXPECT_NEAR(blurred_disc(0, 20, 0.1), 1, 1e-3);
  EXPECT_NEAR(blurred_disc(20, 20, 0.1), 0.5, 0.002);  // as of an edge
  EXPECT_NEAR(blurred_disc(5, 1.165, 0.3), 0, 1e-9);
}

TEST(CtScan, TheTubesVolumeIsKeptByPartialVolume) {
  // Sum of shares times a voxel's volume: pi r^2 of each mm of a straight tube. The round end leaves out r /
  // 3 of one radius; the far end's blur is cut half: only the middle of the tube counts.
  Eigen::Matrix3Xd straight_mm = Eigen::Matrix3Xd::Zero(3, 41);
  straight_mm.row(0) = Eigen::RowVectorXd::LinSpaced(41, 0, 40);
  CtSettings settings;
  settings.noise = 0;
  settings.greatest = settings.shaft;
  const CtScan scan = simulated_ct(straight_mm, settings, 1);
  double shares = 0;
  scan.each([&](const VoxelIndex& voxel, float value) {
    const double x_mm = scan.centre_mm(voxel).x();
    if (x_mm >= 10 && x_mm < 30) shares += value / settings.shaft;
  });
  const double area_mm2 = std::numbers::pi * std::pow(settings.diameter_mm / 2, 2);
  EXPECT_NEAR(shares * std::pow(settings.voxel_mm, 3) / 20, area_mm2, 0.02 * area_mm2);
}

TEST(CtScan, ValuesAreCutAtWhatTwelveBitsHoldAndNoiseIsAsAsked) {
  const CtScan scan = simulated_ct(arch(), {}, 1);
  double greatest = 0;
  double squares = 0;
  std::size_t count = 0;
  scan.each([&](const VoxelIndex&, float value) {
    greatest = std::max<double>(greatest, value);
    if (std::abs(value) > 200) return;  // five sigma: what is left is background
    squares += static_cast<double>(value) * value;
    ++count;
  });
  EXPECT_EQ(greatest, 3071);
  // The tube's blurred rim is among them and makes it a little more.
  EXPECT_NEAR(std::sqrt(squares / static_cast<double>(count)), 40, 3);
}

}  // namespace
}  // namespace tubed
