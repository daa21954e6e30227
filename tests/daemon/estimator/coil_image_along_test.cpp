// How coils lie along the tube against each other, for CoilImageAgreement.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "daemon/estimator/agreement/coil_image_agreement.hpp"
#include "tests/daemon/estimator/agreement_bench.hpp"

namespace tubed {
namespace {

// The first and the last coil, too: nothing lies beyond them that holds the tube.
TEST(CoilImageAgreement, TheCoilWhoseArcLengthIsWrongIsNamed) {
  const std::vector<CoilPlacement> coils = one_view_room().instruments.front().coils;
  for (int wrong = 0; wrong < 5; ++wrong) {
    for (const double too_large_mm : {5.0, -5.0}) {
      AgreementBench bench;
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
  AgreementBench bench;
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
  const auto [meanwhile, after] = disagree_in_and_after_a_burst(along);
  EXPECT_TRUE(meanwhile);
  EXPECT_FALSE(after);
}

}  // namespace
}  // namespace tubed
