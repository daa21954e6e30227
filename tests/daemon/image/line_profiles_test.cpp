#include "daemon/image/line_profiles.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <random>

#include "daemon/image/correspondence_lines.hpp"
#include "daemon/image/vesselness_meter.hpp"

namespace tubed {
namespace {

constexpr int kSize = 200;
constexpr int kLines = 50;
constexpr int kReach_px = 12;
constexpr double kHalfWidth_px = 1.9;

/// A picture of rows: 150 grey less what lies at each row, with noise.
class Picture {
 public:
  explicit Picture(double noise) {
    image.reserve(kSize, kSize);
    std::mt19937 random(5);
    std::normal_distribution<double> normal(0, 1);
    for (float& grey : image.grey) grey = static_cast<float>(150 + noise * normal(random));
  }

  /// A tube of the expected width at that row, as dark as that in its middle.
  void add_tube(double row, double contrast) {
    add([=](double y) { return contrast * std::exp(-0.5 * std::pow((y - row) / 1.6, 2)); });
  }

  /// Darker by `contrast` from that row to the other one, with soft edges.
  void add_band(double from, double to, double contrast) {
    add([=](double y) { return contrast * (std::tanh((y - from) / 1.5) - std::tanh((y - to) / 1.5)) / 2; });
  }

  ImageMeasurement image;

 private:
  template <typename Darkness>
  void add(Darkness darkness) {
    for (int y = 0; y < kSize; ++y) {
      for (int x = 0; x < kSize; ++x) {
        image.grey[static_cast<std::size_t>(y * kSize + x)] -= static_cast<float>(darkness(y));
      }
    }
  }
};

/// Upright lines along y = 100, 3 px apart.
std::array<CorrespondenceLine, LineSearch::kMaxLines> upright_lines() {
  std::array<CorrespondenceLine, LineSearch::kMaxLines> lines{};
  for (std::size_t i = 0; i < kLines; ++i) {
    lines[i].base_px = {20.0 + 3 * static_cast<double>(i), 100.0};
    lines[i].normal = {0, 1};
    lines[i].half_width_px = kHalfWidth_px;
    lines[i].in_view = true;
  }
  return lines;
}

struct Looked {
  explicit Looked(const ImageMeasurement& image,
                  const std::array<CorrespondenceLine, LineSearch::kMaxLines>& lines = upright_lines()) {
    profiles->measure(image, std::span(lines).first(kLines), kReach_px);
  }
  /// Mean over all lines at that offset.
  [[nodiscard]] double odds_at(int offset_px) const {
    double sum = 0;
    for (std::size_t i = 0; i < kLines; ++i) {
      sum += static_cast<double>(profiles->log_odds(i, static_cast<std::size_t>(offset_px + kReach_px)));
    }
    return sum / kLines;
  }
  std::unique_ptr<LineProfiles> profiles = std::make_unique<LineProfiles>();
};

TEST(LineProfiles, ATubeStandsOutWhereItIsAndNowhereElse) {
  Picture picture(2);
  picture.add_tube(104, 30);
  const Looked looked(picture.image);
  EXPECT_GT(looked.odds_at(4), 2);
  for (const int k : {-12, -8, -4, 0, 8, 12}) {
    EXPECT_LT(looked.odds_at(k), -1) << k;
  }
}

TEST(LineProfiles, ABrightTubeDoesWhereTubesAreBright) {
  Picture picture(2);
  picture.add_tube(104, -30);
  picture.image.polarity = RidgePolarity::kBright;
  EXPECT_GT(Looked(picture.image).odds_at(4), 2);
  picture.image.polarity = RidgePolarity::kDark;
  EXPECT_LT(Looked(picture.image).odds_at(4), -1);
}

TEST(LineProfiles, ABroadBandAndItsEdgesAreNoTube) {
  Picture picture(2);
  picture.add_tube(96, 30);
  picture.add_band(103, 120, 60);
  const Looked looked(picture.image);
  EXPECT_GT(looked.odds_at(-4), 2);
  for (int k = 2; k <= 12; ++k) {
    EXPECT_LT(looked.odds_at(k), looked.odds_at(-4) / 2) << k;
  }
  for (int k = 7; k <= 12; ++k) {
    EXPECT_LT(looked.odds_at(k), 0) << k;
  }
}

TEST(LineProfiles, TheNoisierTheLessIsSaid) {
  double before = 10;
  for (const double noise : {1.0, 4.0, 8.0, 16.0}) {
    Picture picture(noise);
    picture.add_tube(104, 30);
    const double odds = Looked(picture.image).odds_at(4);
    EXPECT_LT(odds, before) << noise;
    EXPECT_GT(odds, 0) << noise;
    before = odds;
  }
  EXPECT_LT(before, 0.7);
}

TEST(LineProfiles, NothingIsKnownOfLinesOutOfViewOrOfNoWidthOrInAnEvenImage) {
  Picture picture(2);
  picture.add_tube(104, 30);
  auto lines = upright_lines();
  lines[3].in_view = false;
  lines[4].half_width_px = 0;
  const Looked looked(picture.image, lines);
  EXPECT_TRUE(looked.profiles->knows(2));
  EXPECT_FALSE(looked.profiles->knows(3));
  EXPECT_FALSE(looked.profiles->knows(4));
  EXPECT_EQ(looked.profiles->log_odds(3, kReach_px + 4), 0);
  EXPECT_FALSE(Looked(Picture(0).image).profiles->knows(2));
}

TEST(LineProfiles, OfATubeOfAnyWidthNothingElseIsRead) {
  Picture picture(2);
  picture.add_band(80, 120, 30);
  auto lines = upright_lines();
  for (const double half_width_px : {0.1, 4.0, 9.9, 10.0, 11.0, 20.0, 1e12, std::nan("")}) {
    for (CorrespondenceLine& line : lines) line.half_width_px = half_width_px;
    const Looked looked(picture.image, lines);
    EXPECT_EQ(looked.profiles->knows(2), half_width_px < 10) << half_width_px;
    EXPECT_TRUE(std::isfinite(looked.odds_at(0))) << half_width_px;
  }
}

TEST(LineProfiles, AtTheImagesBorderTheyAreNumbers) {
  Picture picture(2);
  picture.add_tube(3, 30);
  auto lines = upright_lines();
  for (CorrespondenceLine& line : lines) line.base_px.y() = 3;
  const Looked looked(picture.image, lines);
  for (int k = -kReach_px; k <= kReach_px; ++k) {
    EXPECT_TRUE(std::isfinite(looked.odds_at(k))) << k;
  }
  EXPECT_GT(looked.odds_at(0), 0);
}

/// How many of the lines are more than 3 px from the tube at row 97.
int led_away(ImageMeasurement& image, LineSearch::Manner manner) {
  FrangiSettings settings;
  VesselnessMeter meter(kSize, kSize, settings);
  ImageArea all(kSize, kSize);
  all.add_whole();
  image.brightest = *std::max_element(image.grey.begin(), image.grey.end());
  for (float& grey : image.grey) grey = std::round(std::max(grey, 0.0F));
  meter.take(image, all);
  auto lines = upright_lines();
  const auto search = std::make_unique<LineSearch>(manner);
  search->search(image, lines, kLines, kReach_px, 0.7);
  return static_cast<int>(std::count_if(lines.begin(), lines.begin() + kLines,
                                        [](const auto& line) { return std::abs(line.offset_px + 3) > 3; }));
}

TEST(LineProfiles, AFaintTubeIsFoundBesideTheEdgeOfADarkBand) {
  Picture picture(3);
  picture.add_tube(97, 20);
  picture.add_band(104, 116, 45);
  ImageMeasurement again = picture.image;
  EXPECT_GT(led_away(again, LineSearch::Manner::kAsPublished), kLines / 2) << "nothing is difficult here";
  EXPECT_LT(led_away(picture.image, LineSearch::Manner::kThorough), kLines / 10);
}

}  // namespace
}  // namespace tubed
