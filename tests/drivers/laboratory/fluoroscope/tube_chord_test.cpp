#include "drivers/laboratory/fluoroscope/tube_chord.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

namespace tubed {
namespace {

constexpr double kRadius_mm = 1.165;

/// A piece from a to b with flat ends.
TubePiece flat_piece(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const Eigen::Vector3d tangent = (b - a).normalized();
  return {a, b, tangent, tangent, tangent};
}

TEST(TubeChord, AcrossTheTubeItIsTheChordOfACircle) {
  const TubePiece piece = flat_piece({-50, 0, 1000}, {50, 0, 1000});
  for (const double off_mm : {0.0, 0.4, 1.0, 1.16}) {
    const Eigen::Vector3d direction =
        Eigen::Vector3d(0, off_mm, std::sqrt(1e6 - off_mm * off_mm)).normalized();
    EXPECT_NEAR(chord_mm(piece, kRadius_mm, direction),
                2 * std::sqrt(kRadius_mm * kRadius_mm - off_mm * off_mm), 1e-6);
  }
  EXPECT_EQ(chord_mm(piece, kRadius_mm, Eigen::Vector3d(0, 1.17, 1000).normalized()), 0);
}

TEST(TubeChord, ATubeThatIsSeenObliquelyIsLongerByTheSineOfTheAngle) {
  for (const double angle : {0.3, 0.8, 1.4}) {
    const Eigen::Vector3d along(std::sin(angle), 0, std::cos(angle));
    const Eigen::Vector3d middle(0, 0, 1200);
    const TubePiece piece = flat_piece(middle - 60 * along, middle + 60 * along);
    EXPECT_NEAR(chord_mm(piece, kRadius_mm, Eigen::Vector3d::UnitZ()), 2 * kRadius_mm / std::sin(angle),
                1e-6);
  }
}

TEST(TubeChord, ATubeThatIsSeenFromItsEndIsAsLongAsItIs) {
  const TubePiece piece = flat_piece({0.3, 0.2, 900}, {0.3, 0.2, 925});
  EXPECT_NEAR(chord_mm(piece, kRadius_mm, Eigen::Vector3d::UnitZ()), 25, 1e-6);
  EXPECT_EQ(chord_mm(piece, 0.1, Eigen::Vector3d::UnitZ()), 0);
}

TEST(TubeChord, PiecesThatMeetAtAMitreLeaveNoGapAndCountNothingTwice) {
  // Two pieces that bend by 0.3 rad: a ray through the joint sees one whole tube, on either side of the bend.
  const Eigen::Vector3d joint(0, 0, 1000);
  const Eigen::Vector3d first(1, 0, 0);
  const Eigen::Vector3d second(std::cos(0.3), std::sin(0.3), 0);
  const Eigen::Vector3d mitre = (first + second).normalized();
  const TubePiece before{joint - 20 * first, joint, first, first, mitre};
  const TubePiece after{joint, joint + 20 * second, second, mitre, second};

  const Eigen::Vector3d in_mitre = mitre.cross(Eigen::Vector3d::UnitZ());
  for (const double off_mm : {-1.0, -0.3, 0.0, 0.5, 1.1}) {
    const Eigen::Vector3d direction = (joint + off_mm * in_mitre + 1e-7 * mitre).normalized();
    const double sum = chord_mm(before, kRadius_mm, direction) + chord_mm(after, kRadius_mm, direction);
    // In the mitre plane a point at off_mm lies off_mm cos(0.15) from either axis.
    const double from_axis = off_mm * std::cos(0.15);
    EXPECT_NEAR(sum, 2 * std::sqrt(kRadius_mm * kRadius_mm - from_axis * from_axis), 1e-4) << off_mm;
  }
}

}  // namespace
}  // namespace tubed
