#include "daemon/image/correspondence_lines.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <random>

namespace tubed {
namespace {

constexpr int kSize = 200;
constexpr int kLines = 60;

/// Vesselness with a ridge at y = `row_of(x)`, plus even noise of height `noise`.
template <typename RowOf>
ImageMeasurement vesselness_with_ridge(RowOf row_of, double noise) {
  ImageMeasurement image;
  image.reserve(kSize, kSize);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> even(0, noise);
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      const double distance = y - row_of(x);
      image.vesselness[static_cast<std::size_t>(y * kSize + x)] =
          static_cast<float>(0.8 * std::exp(-0.5 * distance * distance / 2.0) + even(random));
    }
  }
  return image;
}

struct Search {
  std::array<CorrespondenceLine, LineSearch::kMaxLines> lines{};
  std::unique_ptr<LineSearch> search = std::make_unique<LineSearch>();

  /// Upright lines along y = 100, 3 px apart.
  Search() {
    for (int i = 0; i < kLines; ++i) {
      lines[static_cast<std::size_t>(i)].base_px = {10.0 + 3 * i, 100.0};
      lines[static_cast<std::size_t>(i)].normal = {0, 1};
      lines[static_cast<std::size_t>(i)].in_view = true;
    }
  }
  LineSearch::Outcome run(const ImageMeasurement& image,
                          LineSearch::Among among = LineSearch::Among::kTubes) {
    return search->search(image, lines, kLines, 14, 0.7, among);
  }
};

TEST(LineSearch, FindsARidgeFourPixelsOffOnEveryLine) {
  Search search;
  const auto outcome = search.run(vesselness_with_ridge([](int) { return 104.0; }, 0.1));
  EXPECT_EQ(outcome.in_view, kLines);
  EXPECT_GT(outcome.inlier_ratio, 0.95);
  for (int i = 0; i < kLines; ++i) {
    EXPECT_NEAR(search.lines[static_cast<std::size_t>(i)].offset_px, 4, 0.4) << i;
  }
}

TEST(LineSearch, FollowsARidgeThatBends) {
  Search search;
  const auto row = [](double x) { return 100 + 6 * std::sin(x / 40); };
  search.run(vesselness_with_ridge(row, 0.1));
  for (int i = 2; i + 2 < kLines; ++i) {
    const CorrespondenceLine& line = search.lines[static_cast<std::size_t>(i)];
    EXPECT_NEAR(line.offset_px, row(line.base_px.x()) - 100, 0.6) << i;
  }
}

TEST(LineSearch, AGapIsCarriedByItsNeighboursAndSaysSo) {
  Search search;
  ImageMeasurement image = vesselness_with_ridge([](int) { return 103.0; }, 0.1);
  for (int y = 0; y < kSize; ++y) {
    for (int x = 85; x < 115; ++x) {
      image.vesselness[static_cast<std::size_t>(y * kSize + x)] = 0;
    }
  }
  search.run(image);
  const CorrespondenceLine& hidden = search.lines[30];
  const CorrespondenceLine& seen = search.lines[5];
  EXPECT_NEAR(hidden.offset_px, 3, 1.5);
  EXPECT_GT(hidden.variance_px2, 3 * seen.variance_px2);
  EXPECT_FALSE(hidden.agrees);
  EXPECT_TRUE(seen.agrees);
}

TEST(LineSearch, PureNoiseIsNotTakenForATube) {
  Search search;
  const auto outcome = search.run(vesselness_with_ridge([](int) { return -1000.0; }, 0.5));
  double mean_variance = 0;
  for (int i = 0; i < kLines; ++i) {
    mean_variance += search.lines[static_cast<std::size_t>(i)].variance_px2 / kLines;
  }
  EXPECT_GT(mean_variance, 1.0) << "it does not know, and says so; inlier ratio " << outcome.inlier_ratio;
}

ImageMeasurement two_ridges(double y, double faint_y, float share) {
  ImageMeasurement image = vesselness_with_ridge([y](int) { return y; }, 0.1);
  const ImageMeasurement faint = vesselness_with_ridge([faint_y](int) { return faint_y; }, 0.1);
  for (std::size_t i = 0; i < image.vesselness.size(); ++i) {
    image.vesselness[i] = std::max(image.vesselness[i], share * faint.vesselness[i]);
  }
  return image;
}

/// A tube's ridge at y = 103 up to x = 100; beyond, ridges of noise that are nearly as high and none of a
/// tube.
ImageMeasurement half_in_noise() {
  ImageMeasurement image = vesselness_with_ridge([](int x) { return x < 100 ? 103.0 : -1000.0; }, 0.02);
  std::mt19937 random(8);
  std::uniform_int_distribution<int> anywhere(2, kSize - 3);
  std::exponential_distribution<float> height(3);
  for (int blob = 0; blob < 4000; ++blob) {
    const int x = anywhere(random);
    const int y = anywhere(random);
    const float most = x < 100 ? 0 : std::min(0.8F, height(random));
    for (int v = -2; v <= 2; ++v) {
      for (int u = -2; u <= 2; ++u) {
        float& here = image.vesselness[static_cast<std::size_t>((y + v) * kSize + x + u)];
        here = std::max(here, most * std::exp(-0.5F * static_cast<float>(u * u + v * v)));
      }
    }
  }
  return image;
}

TEST(LineSearch, RidgesAmongRidgesOfNoiseSayLessWhereTheyAreTakenForThat) {
  const ImageMeasurement image = half_in_noise();
  Search tubes;
  tubes.run(image);
  Search noise;
  noise.run(image, LineSearch::Among::kNoise);
  for (std::size_t i = 0; i < 25; ++i) {
    EXPECT_NEAR(noise.lines[i].offset_px, 3, 0.5) << i;
    EXPECT_NEAR(noise.lines[i].variance_px2, tubes.lines[i].variance_px2, 0.2) << i;
  }
  double sure_px2 = 0;
  double weighed_px2 = 0;
  for (std::size_t i = 35; i < kLines; ++i) {
    sure_px2 += tubes.lines[i].variance_px2;
    weighed_px2 += noise.lines[i].variance_px2;
  }
  EXPECT_GT(weighed_px2, 1.8 * sure_px2);
}

// Beside the tube's ridge another one: that is a tube, however long.
TEST(LineSearch, OneRidgeBesideTheTubesIsNoNoise) {
  const ImageMeasurement image = two_ridges(97, 106, 0.8F);
  Search tubes;
  tubes.run(image);
  Search noise;
  noise.run(image, LineSearch::Among::kNoise);
  for (std::size_t i = 0; i < kLines; ++i) {
    EXPECT_NEAR(noise.lines[i].offset_px, tubes.lines[i].offset_px, 0.3) << i;
    EXPECT_NEAR(noise.lines[i].variance_px2, tubes.lines[i].variance_px2, 0.3) << i;
  }
}

TEST(LineSearch, LinesOutOfViewTakeNoPart) {
  Search search;
  for (int i = 20; i < kLines; ++i) {
    search.lines[static_cast<std::size_t>(i)].in_view = false;
  }
  const auto outcome = search.run(vesselness_with_ridge([](int) { return 102.0; }, 0.1));
  EXPECT_EQ(outcome.in_view, 20);
  EXPECT_GT(search.lines[50].variance_px2, search.lines[5].variance_px2);
}

/// An arch seen from its side: lines 0 to 39 along one shaft at y = 100, 55 to 94 back along another that is
/// expected at y = 100 + `apart_px`.
struct Arch : Search {
  static constexpr int kCount = 95;
  static constexpr int kBack = 55;

  explicit Arch(double apart_px) {
    for (int i = 0; i < kCount; ++i) {
      CorrespondenceLine& line = lines[static_cast<std::size_t>(i)];
      line.in_view = i < 40 || i >= kBack;
      line.base_px = {10.0 + 3 * (i < 40 ? i : kCount - 1 - i), i < 40 ? 100.0 : 100 + apart_px};
      line.normal = {0, i < 40 ? 1.0 : -1.0};
      line.half_width_px = 2;
    }
  }
  LineSearch::Outcome run(const ImageMeasurement& image) {
    return search->search(image, lines, kCount, 14, 0.7);
  }
  /// What line `i` found, as the image's y.
  [[nodiscard]] double found_y(int i) const {
    const CorrespondenceLine& line = lines[static_cast<std::size_t>(i)];
    return line.base_px.y() + line.offset_px * line.normal.y();
  }
  [[nodiscard]] double variance_px2(int i) const { return lines[static_cast<std::size_t>(i)].variance_px2; }
};

TEST(LineSearch, AFaintShaftIsNotLostToTheDarkerOneBesideIt) {
  Arch arch(8);
  arch.run(two_ridges(100.5, 111, 0.55F));
  for (int i = 3; i < 37; ++i) {
    EXPECT_NEAR(arch.found_y(i), 100.5, 0.5) << i;
    EXPECT_NEAR(arch.found_y(Arch::kBack + i), 111, 0.5) << i;
    EXPECT_TRUE(arch.lines[static_cast<std::size_t>(Arch::kBack + i)].agrees) << i;
  }
}

// Nearer to the wrong one's base is no reason: shafts do not change places.
TEST(LineSearch, ShaftsThatMovedTogetherByMoreThanTheirDistanceKeepTheirPlaces) {
  for (const double share : {1.0, 0.7}) {
    for (const double moved_px : {-6.0, -4.0, -3.0, 3.0, 4.0, 6.0}) {
      Arch arch(6);
      arch.run(two_ridges(100 + moved_px, 106 + moved_px, static_cast<float>(share)));
      for (int i = 4; i < 36; ++i) {
        EXPECT_NEAR(arch.found_y(i), 100 + moved_px, 1) << i << " moved " << moved_px;
        EXPECT_NEAR(arch.found_y(Arch::kBack + i), 106 + moved_px, 1) << i << " moved " << moved_px;
      }
    }
  }
}

// Nothing tells that from shafts that lie on one another: the image is no worse for it.
TEST(LineSearch, AShaftWithoutARidgeOfItsOwnIsNotSureOfTheOther) {
  Arch arch(6);
  const auto outcome = arch.run(vesselness_with_ridge([](int) { return 100.5; }, 0.1));
  EXPECT_GT(outcome.inlier_ratio, 0.95);
  for (int i = 3; i < 37; ++i) {
    EXPECT_NEAR(arch.found_y(i), 100.5, 0.5) << i;
    EXPECT_LT(arch.variance_px2(i), 2) << i;
    EXPECT_NEAR(arch.found_y(Arch::kBack + i), 100.5, 0.5) << i;
    EXPECT_GT(arch.variance_px2(Arch::kBack + i), 20) << i;
  }
}

TEST(LineSearch, WhereBothSeeAnotherRidgeTheOneThatIsExpectedThereStays) {
  Arch arch(7);
  ImageMeasurement image = two_ridges(101, 111, 0.6F);
  const ImageMeasurement below = two_ridges(101, 91, 0.6F);
  for (std::size_t i = 0; i < image.vesselness.size(); ++i) {
    image.vesselness[i] = std::max(image.vesselness[i], below.vesselness[i]);
  }
  arch.run(image);
  for (int i = 4; i < 36; ++i) {
    EXPECT_NEAR(arch.found_y(i), 101, 0.5) << i;
    EXPECT_LT(arch.variance_px2(i), 2) << i;
    EXPECT_NEAR(arch.found_y(Arch::kBack + i), 111, 0.5) << i;
  }
}

TEST(LineSearch, ShaftsThatWereExpectedOnOneAnotherShareTheirRidge) {
  Arch arch(1);
  arch.run(two_ridges(104, 112, 0.55F));
  for (int i = 3; i < 37; ++i) {
    for (const int line : {i, Arch::kBack + i}) {
      EXPECT_NEAR(arch.found_y(line), 104, 0.5) << line;
      EXPECT_LT(arch.variance_px2(line), 2) << line;
    }
  }
}

// A shaft that runs toward the source has its lines close together.
TEST(LineSearch, AForeshortenedShaftIsNotLostEither) {
  Arch arch(8);
  for (int i = Arch::kBack; i < Arch::kCount; ++i) {
    arch.lines[static_cast<std::size_t>(i)].base_px.x() = 30 + 0.6 * (Arch::kCount - 1 - i);
  }
  arch.run(two_ridges(100.5, 111, 0.55F));
  for (int i = Arch::kBack + 4; i < Arch::kCount - 4; ++i) {
    EXPECT_NEAR(arch.found_y(i), 111, 0.7) << i;
  }
}

TEST(LineSearch, StandsVesselnessThatIsNoNumber) {
  Arch arch(8);
  ImageMeasurement image = two_ridges(100.5, 111, 0.55F);
  for (std::size_t i = 0; i < image.vesselness.size(); i += 7) {
    image.vesselness[i] = std::numeric_limits<float>::quiet_NaN();
  }
  const auto outcome = arch.run(image);
  EXPECT_EQ(outcome.in_view, 80);
  EXPECT_LT(outcome.inlier_ratio, 0.5);
}

/// A tube at y = 97 and another, darker one at y = 103; the lines lie between them.
struct TwoTubes : Search {
  ImageMeasurement image = two_ridges(103, 97, 0.8F);

  /// Every line's tube at this y, give or take `sigma_px`.
  void predict(double y, double sigma_px) {
    for (int i = 0; i < kLines; ++i) {
      lines[static_cast<std::size_t>(i)].expected_px = y - 100;
      lines[static_cast<std::size_t>(i)].expected_variance_px2 = sigma_px * sigma_px;
    }
  }
  [[nodiscard]] const CorrespondenceLine& line(int i) const { return lines[static_cast<std::size_t>(i)]; }
};

TEST(LineSearch, OfTwoTubesThePredictedOneIsTheOwn) {
  TwoTubes nobody_knows;
  nobody_knows.run(nobody_knows.image);
  EXPECT_GT(nobody_knows.line(30).offset_px, 2) << "the darker one, while nobody says otherwise";
  for (const double y : {97.0, 103.0}) {
    TwoTubes tubes;
    tubes.predict(y, 1.5);
    EXPECT_GT(tubes.run(tubes.image).inlier_ratio, 0.95);
    for (int i = 2; i + 2 < kLines; ++i) {
      EXPECT_NEAR(tubes.line(i).offset_px, y - 100, 0.5) << i;
    }
  }
}

TEST(LineSearch, WhereInTheOwnRidgeTheTubeWasPredictedMakesNoDifference) {
  TwoTubes low;
  low.predict(95.5, 0.5);
  low.run(low.image);
  TwoTubes high;
  high.predict(97.5, 0.5);
  high.run(high.image);
  for (int i = 2; i + 2 < kLines; ++i) {
    EXPECT_NEAR(low.line(i).offset_px, high.line(i).offset_px, 0.05) << i;
    EXPECT_NEAR(low.line(i).variance_px2, high.line(i).variance_px2, 0.05) << i;
  }
}

TEST(LineSearch, APredictionThatKnowsLittleDecidesNothing) {
  TwoTubes nobody_knows;
  nobody_knows.run(nobody_knows.image);
  TwoTubes tubes;
  tubes.predict(97, 30);
  tubes.run(tubes.image);
  for (int i = 0; i < kLines; ++i) {
    EXPECT_EQ(tubes.line(i).offset_px, nobody_knows.line(i).offset_px) << i;
  }
}

// It is fused with what the lines say afterwards: were it in there it would count twice.
TEST(LineSearch, ThePredictionIsNotInWhatIsFound) {
  for (const double expected_px : {3.0, 4.5, -5.0}) {
    const ImageMeasurement image =
        vesselness_with_ridge([](int x) { return x < 120 ? 103.0 : -1000.0; }, 0.1);
    Search unpredicted;
    unpredicted.run(image);
    Search search;
    for (CorrespondenceLine& line : search.lines) {
      line.expected_px = expected_px;
      line.expected_variance_px2 = 0.01;
    }
    search.run(image);
    for (int i = 0; i < kLines; ++i) {
      const CorrespondenceLine& line = search.lines[static_cast<std::size_t>(i)];
      EXPECT_EQ(line.offset_px, unpredicted.lines[static_cast<std::size_t>(i)].offset_px) << i;
      EXPECT_EQ(line.variance_px2, unpredicted.lines[static_cast<std::size_t>(i)].variance_px2) << i;
    }
  }
}

TEST(RidgeClaims, StandsWhateverItIsGiven) {
  const auto claims = std::make_unique<RidgeClaims>();
  RidgeClaims::PerLine yes;
  yes.fill(true);
  std::array<CorrespondenceLine, kMaxCorrespondenceLines> lines{};
  EXPECT_FALSE(claims->find({}, yes));
  EXPECT_FALSE(claims->find(lines, yes));  // none in view
  lines[0].in_view = true;
  EXPECT_FALSE(claims->find(lines, yes));
  for (const double odd : {0.0, 1e13, 1e200, std::numeric_limits<double>::infinity(),
                           std::numeric_limits<double>::quiet_NaN()}) {
    for (std::size_t i = 0; i < lines.size(); ++i) {
      lines[i].in_view = i % 7 != 3;
      lines[i].base_px = {i % 5 == 0 ? odd : static_cast<double>(i), i % 11 == 0  ? -odd
                                                                     : i % 2 == 0 ? 0.0
                                                                                  : 5.0};
      lines[i].normal = {0, 1};
      lines[i].offset_px = i % 13 == 0 ? odd : 0.0;
    }
    claims->find(lines, yes);
    claims->settle(lines, yes);
    for (const RidgeClaims::Claim& claim : claims->claims()) {
      ASSERT_GE(claim.rival, -1);
      ASSERT_LT(claim.rival, kMaxCorrespondenceLines);
    }
  }
}

}  // namespace
}  // namespace tubed
