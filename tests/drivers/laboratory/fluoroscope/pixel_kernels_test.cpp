#include "drivers/laboratory/fluoroscope/pixel_kernels.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <vector>

#include "drivers/laboratory/fluoroscope/counted_noise.hpp"

namespace tubed {
namespace {

struct Moments {
  double mean = 0, variance = 0, skewness = 0;
};

Moments moments_of(const std::vector<float>& values) {
  Moments moments;
  const auto count = static_cast<double>(values.size());
  for (const float value : values) moments.mean += value / count;
  double third = 0;
  for (const float value : values) {
    const double off = value - moments.mean;
    moments.variance += off * off / count;
    third += off * off * off / count;
  }
  moments.skewness = third / std::pow(moments.variance, 1.5);
  return moments;
}

TEST(PixelKernels, TransmissionsAreExponentialsAndLogsTakeThemBack) {
  std::vector<float> attenuation;
  for (double a = -20; a < 60; a += 0.0137) attenuation.push_back(static_cast<float>(a));
  std::vector<float> values(attenuation.size());

  transmissions(attenuation, values);
  for (std::size_t i = 0; i < values.size(); ++i) {
    ASSERT_NEAR(values[i] / std::exp(-static_cast<double>(attenuation[i])), 1, 4e-6) << attenuation[i];
  }
  negative_logs(values);
  for (std::size_t i = 0; i < values.size(); ++i) {
    ASSERT_NEAR(values[i], attenuation[i], 1e-5) << attenuation[i];
  }
}

TEST(PixelKernels, APointIsSpreadWithItsSumItsPlaceAndTheVarianceAskedFor) {
  constexpr int kWidth = 41;
  constexpr int kHeight = 31;
  for (const double sigma_px : {0.5, 0.75, 2.0}) {
    std::vector<float> image(kWidth * kHeight);
    image[15 * kWidth + 20] = 100;
    PointSpread spread(kWidth, kHeight, sigma_px);
    spread.apply(image);
    double sum = 0, x = 0, y = 0, xx = 0, yy = 0;
    for (int row = 0; row < kHeight; ++row) {
      for (int column = 0; column < kWidth; ++column) {
        const double value = image[static_cast<std::size_t>(row * kWidth + column)];
        sum += value;
        x += value * (column - 20);
        y += value * (row - 15);
        xx += value * (column - 20) * (column - 20);
        yy += value * (row - 15) * (row - 15);
      }
    }
    EXPECT_NEAR(sum, 100, 1e-3);
    EXPECT_NEAR(x, 0, 1e-3);
    EXPECT_NEAR(y, 0, 1e-3);
    // The pixels' own width adds 1/12; sampling takes 0.008 from the narrowest.
    EXPECT_NEAR(xx / sum, sigma_px * sigma_px + 1.0 / 12, 0.009) << sigma_px;
    EXPECT_NEAR(yy / sum, sigma_px * sigma_px + 1.0 / 12, 0.009) << sigma_px;
  }
}

TEST(PixelKernels, AnEvenPictureStaysEvenUpToItsBorder) {
  std::vector<float> image(20 * 10, 3.5F);
  PointSpread(20, 10, 1.5).apply(image);
  for (const float value : image) EXPECT_NEAR(value, 3.5F, 1e-5F);
}

TEST(PixelKernels, DeviatesAreNormal) {
  const NormalTable table;
  std::vector<float> deviates(400'001);
  table.draw(noise_key(1, 2, 3), deviates);
  const Moments moments = moments_of(deviates);
  std::size_t beyond_two = 0;
  double neighbours = 0;
  for (std::size_t i = 0; i + 1 < deviates.size(); ++i) {
    beyond_two += std::abs(deviates[i]) > 2 ? 1 : 0;
    neighbours += deviates[i] * deviates[i + 1];
  }
  const auto count = static_cast<double>(deviates.size());

  EXPECT_NEAR(moments.mean, 0, 4 / std::sqrt(count));
  EXPECT_NEAR(moments.variance, 1, 4 * std::sqrt(2 / count));
  EXPECT_NEAR(moments.skewness, 0, 4 * std::sqrt(6 / count));
  EXPECT_NEAR(static_cast<double>(beyond_two) / count, std::erfc(std::sqrt(2.0)), 0.0015);
  EXPECT_NEAR(neighbours / count, 0, 4 / std::sqrt(count));
}

TEST(PixelKernels, CountedQuantaHaveThePoissonDistributionsMeanVarianceAndSkewness) {
  const NormalTable table;
  for (const float mean : {5.0F, 20.0F, 400.0F}) {
    std::vector<float> deviates(400'000);
    table.draw(noise_key(7, 8, static_cast<std::uint64_t>(mean)), deviates);
    std::vector<float> quanta(deviates.size(), mean);
    count_quanta(deviates, quanta);
    const Moments moments = moments_of(quanta);
    EXPECT_NEAR(moments.mean, mean, 0.004 * mean + 0.01);
    EXPECT_NEAR(moments.variance, mean, 0.01 * mean + 0.06);
    EXPECT_NEAR(moments.skewness, 1 / std::sqrt(mean), 0.02 + 0.03 / std::sqrt(mean));
  }
}

TEST(PixelKernels, GreyValuesRunFromDarkToBrightAndStayInRange) {
  const std::vector<float> attenuation{9, 5, 4, 3, -2};
  std::vector<std::uint8_t> grey(5);
  to_grey8(attenuation, 5, 3, grey);
  EXPECT_EQ(grey, (std::vector<std::uint8_t>{0, 0, 128, 255, 255}));

  std::vector<std::uint8_t> bytes(10);
  to_grey16(attenuation, 5, 3, 65535, bytes);
  std::uint16_t middle = 0;
  std::memcpy(&middle, bytes.data() + 4, 2);
  EXPECT_EQ(middle, 32768);
}

}  // namespace
}  // namespace tubed
