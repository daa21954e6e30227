// The offset of a clock from numbers with errors that last, as images have them.
#include "clients/calibration/clock_offset.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <iostream>
#include <memory>
#include <numbers>
#include <random>

namespace tubed {
namespace {

constexpr int kChannels = 3;

/// A tube that moves to and fro in three channels, seen 15 times a second for `duration_s`.
struct Motion {
  std::array<double, 3> rate_hz{};
  std::array<double, 3> phase{};
  double amplitude_px = 12;

  [[nodiscard]] double speed(double t_s, std::size_t channel) const {
    constexpr double kHalf_s = 0.01;
    return (at(t_s + kHalf_s, channel) - at(t_s - kHalf_s, channel)) / (2 * kHalf_s);
  }
  [[nodiscard]] double at(double t_s, std::size_t channel) const {
    double sum = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      sum +=
          std::sin(2 * std::numbers::pi * rate_hz[k] * t_s + phase[k] + 0.4 * static_cast<double>(channel));
    }
    return amplitude_px * sum / std::sqrt(3.0);
  }
};

struct Room {
  double offset_s = 0.02;
  double duration_s = 26;
  double amplitude_px = 12;
  double image_px = 1.5;       ///< of an image's error
  double image_lasts_s = 0.5;  ///< over which it does
  double em_px = 0.3;          ///< jitter of a prediction
  double field_px = 0.7;       ///< what depends on the place: a slope of 3 %, as a warped field has
};

/// Errors of images are a first-order Markov process, which all channels share in part.
std::vector<SeenNumber> numbers_in(const Room& room, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0, 1);
  std::uniform_real_distribution<double> uniform(0, 1);
  auto motion = std::make_shared<Motion>();
  motion->amplitude_px = room.amplitude_px;
  motion->rate_hz = {0.3 + 0.2 * uniform(random), 0.7 + 0.3 * uniform(random), 1.1 + 0.3 * uniform(random)};
  for (double& phase : motion->phase) phase = 2 * std::numbers::pi * uniform(random);
  constexpr double kPeriod_s = 1.0 / 15;
  const double stays = std::exp(-kPeriod_s / room.image_lasts_s);
  std::array<double, kChannels + 1> lasting{};
  for (double& error : lasting) error = normal(random);
  std::vector<SeenNumber> numbers;
  for (double t_s = 0; t_s < room.duration_s; t_s += kPeriod_s) {
    for (double& error : lasting) error = stays * error + std::sqrt(1 - stays * stays) * normal(random);
    for (std::size_t channel = 0; channel < kChannels; ++channel) {
      const double place_px = motion->at(t_s - room.offset_s, channel);
      const double seen_px = place_px + room.image_px * (0.7 * lasting[channel] + 0.7 * lasting[kChannels]);
      SeenNumber number;
      number.t_s = t_s;
      number.channel = channel;
      const double jitter_px = room.em_px * normal(random);
      // A speed from the measurements that the place is from has the noise of the place.
      const double own_px_s = 30 * jitter_px + 30 * room.em_px * normal(random);
      const double other_px_s = 10 * room.em_px * normal(random);
      number.against = [=, field_px = room.field_px](double at_s) {
        const double em_px = motion->at(at_s, channel);
        const double bent_px = field_px * std::sin(em_px / 25) + jitter_px;
        return SeenNumber::Against{seen_px - em_px - bent_px,
                                   {em_px, 0.3 * em_px},
                                   motion->speed(at_s, channel) + own_px_s,
                                   motion->speed(at_s, channel) + other_px_s};
      };
      numbers.push_back(std::move(number));
    }
  }
  return numbers;
}

TEST(ClockOffset, AnOffsetIsFoundToAFewMillisecondsUnderErrorsThatLastAndABentField) {
  const auto found = find_clock_offset(numbers_in({.offset_s = 0.037}, 3), {});

  ASSERT_TRUE(found);
  EXPECT_NEAR(found->offset_s, 0.037, 3 * found->sigma_s);
  EXPECT_LT(found->sigma_s, 0.005);
  EXPECT_GT(found->peak_in_sigmas, 5);
  EXPECT_FALSE(found->is_at_border);
}

TEST(ClockOffset, SigmaCoversErrorsThatLastOverManyImages) {
  constexpr int kDraws = 60;
  std::array<int, 3> within{};
  int white_within_one = 0;
  for (unsigned seed = 0; seed < kDraws; ++seed) {
    const double offset_s = 0.001 * static_cast<double>(seed) - 0.03;
    const auto found = find_clock_offset(numbers_in({.offset_s = offset_s}, 100 + seed), {0, 0.1});
    ASSERT_TRUE(found);
    const double off_s = std::abs(found->offset_s - offset_s);
    for (std::size_t k = 0; k < 3; ++k)
      within[k] += off_s < static_cast<double>(k + 1) * found->sigma_s ? 1 : 0;
    white_within_one += off_s < found->white_sigma_s ? 1 : 0;
  }
  std::cout << within[0] << ' ' << within[1] << ' ' << within[2] << ", independent " << white_within_one
            << '\n';
  EXPECT_GE(within[0], 34);  // 0.683 of 60 are 41, less two standard deviations of a binomial
  EXPECT_LE(within[0], 56);
  EXPECT_GE(within[1], 54);
  EXPECT_GE(within[2], 58);
  EXPECT_LT(white_within_one, within[0]) << "errors that last count for fewer than they are";
}

TEST(ClockOffset, ATubeThatHardlyMovesLeavesSigmaLarge) {
  const auto found = find_clock_offset(numbers_in({.amplitude_px = 0.3}, 4), {});

  ASSERT_TRUE(found);
  EXPECT_GT(found->sigma_s, 0.010);
}

TEST(ClockOffset, AnOffsetBeyondWhatIsLookedForIsAtTheBorder) {
  const auto found = find_clock_offset(numbers_in({.offset_s = 0.25}, 5), {0, 0.15});

  ASSERT_TRUE(found);
  EXPECT_TRUE(found->is_at_border);
}

TEST(ClockOffset, AFewImagesSayNothing) {
  EXPECT_FALSE(find_clock_offset(numbers_in({.duration_s = 3}, 6), {}));
}

}  // namespace
}  // namespace tubed
