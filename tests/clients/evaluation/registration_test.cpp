#include "clients/evaluation/registration.hpp"

#include <gtest/gtest.h>

namespace tubed {
namespace {

RegisteredImage image(std::uint32_t frame, Validity validity, std::vector<double> distance_px) {
  return {frame, "A", validity, {}, 0.9F, std::move(distance_px)};
}

TEST(Registration, ATubeFarOffAtATwentiethOfItsPointsIsCaptured) {
  std::vector<double> nearly(100, 0.2);
  std::fill_n(nearly.begin(), 4, 50.0);
  std::vector<double> captured(100, 0.2);
  std::fill_n(captured.begin(), 7, 50.0);

  EXPECT_EQ(summary_of({image(1, Validity::kValid, nearly)}).captured, 0U);
  EXPECT_EQ(summary_of({image(1, Validity::kValid, captured)}).captured, 1U);
}

TEST(Registration, OnlyACapturedImageThatIsNotValidCountsAsFlagged) {
  const std::vector<double> off(10, 9.0);
  const auto summary =
      summary_of({image(1, Validity::kValid, off), image(2, Validity::kQuestionable, off),
                  image(3, Validity::kQuestionable, {0.1}), image(4, Validity::kInvalid, off)});
  EXPECT_EQ(summary.images, 4U);
  EXPECT_EQ(summary.captured, 3U);
  EXPECT_EQ(summary.flagged, 2U);
}

TEST(Registration, PercentilesAreOverThePointsOfAllImages) {
  const auto summary =
      summary_of({image(1, Validity::kValid, {1, 2, 3}), image(2, Validity::kValid, {4, 5})});
  EXPECT_DOUBLE_EQ(summary.median_px, 3);
  EXPECT_DOUBLE_EQ(summary.p95_px, 4.8);
}

TEST(Registration, TheFarthestOffComesFirstAndTheRestIsLeftOut) {
  const std::string table = table_of({image(1, Validity::kValid, {0.1}), image(2, Validity::kValid, {7.0}),
                                      image(3, Validity::kValid, {2.0})},
                                     2);
  EXPECT_LT(table.find("    2 A"), table.find("    3 A"));
  EXPECT_EQ(table.find("    1 A"), std::string::npos);
}

}  // namespace
}  // namespace tubed
