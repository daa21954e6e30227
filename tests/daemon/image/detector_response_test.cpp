#include "daemon/image/detector_response.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>
#include <vector>

namespace tubed {
namespace {

constexpr int kSide = 256;

/// Columns from dim to bright over a factor of 16, with `noise_of` as the standard deviation of a grey value.
template <typename Noise>
std::vector<std::uint8_t> ramp(double darkest, Noise noise_of) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  std::vector<std::uint8_t> bytes(std::size_t{kSide} * kSide * 2);
  for (int i = 0; i < kSide * kSide; ++i) {
    const double grey = darkest * std::exp2(4.0 * (i % kSide) / kSide);
    const auto word = static_cast<std::uint16_t>(
        std::clamp(std::round(grey + noise_of(grey) * normal(random)), 0.0, 65535.0));
    std::memcpy(bytes.data() + 2 * static_cast<std::size_t>(i), &word, sizeof word);
  }
  return bytes;
}

// log(1 + x / d), d = white / 128.
TEST(LogTable, AShareOfTheIntensityIsTheSameStepWhereverItIsTaken) {
  LogTable logs;
  logs.set(4095, 16);
  const auto log_of = [&](double grey) { return logs[static_cast<std::uint32_t>(16 * grey)]; };
  const double d = 4095 / 128.0;
  const double scale = 65535 / std::log(129.0);
  const double bright = log_of(4000) - log_of(4000 * 0.9);
  const double dim = log_of(1000) - log_of(1000 * 0.9);
  EXPECT_NEAR(bright, scale * std::log((4000 + d) / (3600 + d)), 2);
  EXPECT_NEAR(dim / bright, 1, 0.03);
}

TEST(LogTable, ItRisesWithoutAStepBackFromNothingToWhite) {
  for (const float white : {255.0F, 4095.0F, 16383.0F, 65535.0F}) {
    LogTable logs;
    logs.set(white, 1);
    EXPECT_EQ(logs[0], 0);
    EXPECT_EQ(logs[static_cast<std::uint32_t>(white)], 65535);
    EXPECT_EQ(logs[LogTable::kMaxWord], 65535) << "brighter than white is white";
    for (std::uint32_t word = 1; word <= LogTable::kMaxWord; ++word) {
      ASSERT_GE(logs[word], logs[word - 1]) << white << ", " << word;
    }
  }
}

TEST(LogTable, AtTheDarkEndItFlattensInsteadOfShowingNoiseAlone) {
  LogTable logs;
  logs.set(4095, 1);
  const float first_level = logs[1] - logs[0];
  EXPECT_NEAR(first_level / 65535, 1 / 32.0 / std::log(129.0), 1e-3) << "of the whole scale";
}

TEST(ResponseFinder, CountedQuantaAreTakenForALinearDetector) {
  ResponseFinder finder;
  finder.look_at(ramp(200, [](double grey) { return 3 * std::sqrt(grey); }), kSide, kSide, 4);
  EXPECT_TRUE(finder.is_known());
  EXPECT_TRUE(finder.is_linear());
  EXPECT_NEAR(finder.slope(), 0.5, 0.05);
}

TEST(ResponseFinder, ItIsLinearWithElectronicNoiseAsStrongAsThatOfTheQuantaInTheMiddle) {
  ResponseFinder finder;
  finder.look_at(ramp(200, [](double grey) { return std::sqrt(9 * grey + 9 * 800); }), kSide, kSide, 4);
  EXPECT_TRUE(finder.is_linear()) << finder.slope();
}

// Of v = log(I) the standard deviation is 1 / sqrt(I), that is exp(-v / 2).
TEST(ResponseFinder, NoiseThatFallsWithGreyIsThatOfALogarithm) {
  ResponseFinder finder;
  finder.look_at(ramp(200, [](double grey) { return 60 * std::exp(-grey / 1600); }), kSide, kSide, 4);
  EXPECT_TRUE(finder.is_known());
  EXPECT_FALSE(finder.is_linear()) << finder.slope();
}

TEST(ResponseFinder, EvenNoiseIsNotThatOfQuanta) {
  ResponseFinder finder;
  finder.look_at(ramp(200, [](double) { return 20.0; }), kSide, kSide, 4);
  EXPECT_TRUE(finder.is_known());
  EXPECT_FALSE(finder.is_linear()) << finder.slope();
}

// Light that spreads over the neighbours takes the quanta's noise from pixel to pixel, not from square to
// square.
TEST(ResponseFinder, QuantaAreSeenBehindAScintillatorsBlur) {
  std::vector<std::uint8_t> bytes = ramp(200, [](double grey) { return 8 * std::sqrt(grey); });
  std::vector<std::uint16_t> words(bytes.size() / 2);
  std::memcpy(words.data(), bytes.data(), bytes.size());
  std::mt19937 random(9);
  std::normal_distribution<double> electronics(0, 25);
  for (std::size_t i = 0; i < words.size(); ++i) {
    double sum = 0;
    for (int y = -2; y <= 2; ++y) {
      for (int x = -2; x <= 2; ++x) {
        const auto row = std::clamp(static_cast<int>(i) / kSide + y, 0, kSide - 1);
        const auto column = std::clamp(static_cast<int>(i) % kSide + x, 0, kSide - 1);
        sum += words[static_cast<std::size_t>(row * kSide + column)];
      }
    }
    const auto blurred = static_cast<std::uint16_t>(std::max(0.0, sum / 25 + electronics(random)));
    std::memcpy(bytes.data() + 2 * i, &blurred, sizeof blurred);
  }
  ResponseFinder finder;
  finder.look_at(bytes, kSide, kSide, 1);
  EXPECT_FALSE(finder.is_linear()) << finder.slope();
  ResponseFinder of_squares;
  of_squares.look_at(bytes, kSide, kSide, 4);
  EXPECT_TRUE(of_squares.is_linear()) << of_squares.slope();
}

TEST(ResponseFinder, AnImageOfOneGreyDecidesNothing) {
  ResponseFinder finder;
  std::vector<std::uint8_t> bytes(std::size_t{kSide} * kSide * 2, 9);
  finder.look_at(bytes, kSide, kSide, 4);
  EXPECT_FALSE(finder.is_known());
  EXPECT_FALSE(finder.is_linear());
}

}  // namespace
}  // namespace tubed
