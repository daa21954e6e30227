// How near the filter is to the exact one, by scale, smoothing and depth. Prints what it finds.
#include <gtest/gtest.h>

#include <cstdio>

#include "daemon/image/frangi.hpp"
#include "tests/daemon/image/exact_frangi.hpp"

namespace tubed {
namespace {

// Where l1 = -l2 a ridge ends and Frangi's formula jumps from exp(-1 / (2 beta^2)), 0.135 here, to 0: the
// last digit decides. Such pixels are left out of the greatest difference and counted in the RMS.
constexpr double kJump = 0.1354;

bool at_the_jump(double ours, double exact) {
  return (ours == 0 || exact == 0) && std::max(ours, exact) < kJump;
}

struct Agreement {
  double greatest = 0;
  double rms = 0;
};

Agreement agreement(const std::vector<float>& ours, const std::vector<double>& exact) {
  Agreement found;
  for (std::size_t i = 0; i < exact.size(); ++i) {
    const double difference = std::abs(static_cast<double>(ours[i]) - exact[i]);
    found.greatest = at_the_jump(ours[i], exact[i]) ? found.greatest : std::max(found.greatest, difference);
    found.rms += difference * difference;
  }
  found.rms = std::sqrt(found.rms / static_cast<double>(exact.size()));
  return found;
}

template <typename Pixel>
std::vector<Pixel> as(const ExactImage& image) {
  std::vector<Pixel> pixels;
  for (const double pixel : image.pixels) {
    pixels.push_back(static_cast<Pixel>(pixel));
  }
  return pixels;
}

template <typename Pixel>
Agreement agreement_of_scale(const ExactImage& image, double sigma, FrangiSmoothing smoothing,
                             const char* what) {
  FrangiSettings settings;
  settings.scales_px = {sigma};
  settings.smoothing = smoothing;
  FrangiFilter filter(image.width, image.height, settings);
  std::vector<float> ours(image.pixels.size());
  filter.filter(as<Pixel>(image), ours);
  const Agreement found = agreement(ours, exact_frangi(image, sigma, settings.beta, 0, 1));
  std::printf("%s, sigma %.1f px: vesselness within %.4f, RMS %.5f\n", what, sigma, found.greatest,
              found.rms);
  return found;
}

const std::vector<double> kSigmas{1.0, 1.5, 2.0, 3.0, 5.0};

TEST(FrangiExactness, FloatIsWithinFourHundredthsAtOnePixelAndTwoBeyond) {
  const ExactImage image = tubes_with_noise(131, 117, 0, 255, 0.02);
  for (const double sigma : kSigmas) {
    const Agreement found = agreement_of_scale<float>(image, sigma, FrangiSmoothing::kFloat, "float");
    EXPECT_LT(found.greatest, sigma < 1.4 ? 0.04 : 0.02) << sigma;
    EXPECT_LT(found.rms, 0.004) << sigma;
  }
}

TEST(FrangiExactness, SixteenBitsOfAnEightBitImageAreAsGood) {
  const ExactImage image = tubes_with_noise(131, 117, 0, 255, 0.02);
  for (const double sigma : kSigmas) {
    const Agreement found =
        agreement_of_scale<std::uint8_t>(image, sigma, FrangiSmoothing::kInteger16, "8-bit in 16");
    EXPECT_LT(found.greatest, sigma < 1.4 ? 0.04 : 0.02) << sigma;
    EXPECT_LT(found.rms, 0.004) << sigma;
  }
}

TEST(FrangiExactness, SixteenBitsOfATwelveBitImageAreAsGood) {
  const ExactImage image = tubes_with_noise(131, 117, 0, 4095, 0.02);
  for (const double sigma : kSigmas) {
    const Agreement found =
        agreement_of_scale<std::uint16_t>(image, sigma, FrangiSmoothing::kInteger16, "12-bit in 16");
    EXPECT_LT(found.greatest, sigma < 1.4 ? 0.04 : 0.02) << sigma;
    EXPECT_LT(found.rms, 0.004) << sigma;
  }
}

// A faint catheter on a bright field: 16 bits must resolve a tenth of the usual contrast.
TEST(FrangiExactness, SixteenBitsSeeAFaintTube) {
  ExactImage image = tubes_with_noise(131, 117, 200, 25, 0.02);
  for (const double sigma : kSigmas) {
    const Agreement found =
        agreement_of_scale<std::uint8_t>(image, sigma, FrangiSmoothing::kInteger16, "faint, 8-bit in 16");
    EXPECT_LT(found.rms, 0.01) << sigma;
  }
}

// Widths of one, several and ragged blocks of columns; heights of one and several blocks of rows.
TEST(FrangiExactness, AnySizeIsAsExactToTheBorder) {
  for (const auto& [width, height] :
       {std::pair{16, 16}, {64, 64}, {65, 67}, {513, 64}, {1040, 33}, {2047, 20}}) {
    const ExactImage image = tubes_with_noise(width, height, 0, 255, 0.02);
    FrangiSettings settings;
    settings.scales_px = {3.0};
    settings.structureness = 15;
    FrangiFilter filter(width, height, settings);
    std::vector<float> ours(image.pixels.size());
    filter.filter(as<std::uint8_t>(image), ours);
    const Agreement found = agreement(ours, exact_frangi(image, 3.0, settings.beta, 15, 1));
    EXPECT_LT(found.greatest, 0.02) << width << " x " << height;
  }
}

TEST(FrangiExactness, BrightRidgesAreAsExact) {
  const ExactImage image = tubes_with_noise(131, 117, 0, 255, 0.02);
  FrangiSettings settings;
  settings.scales_px = {2.0};
  settings.polarity = PolaritySetting::kBright;
  FrangiFilter filter(image.width, image.height, settings);
  std::vector<float> ours(image.pixels.size());
  filter.filter(as<float>(image), ours);
  EXPECT_LT(agreement(ours, exact_frangi(image, 2.0, settings.beta, 0, -1)).greatest, 0.02);
}

}  // namespace
}  // namespace tubed
