#include "daemon/image/line_samples.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>

#include "daemon/image/sample_vesselness.hpp"

namespace tubed {
namespace {

constexpr int kWidth = 70;
constexpr int kHeight = 50;

ImageMeasurement noisy_image() {
  ImageMeasurement image;
  image.reserve(kWidth, kHeight);
  std::mt19937 generator(3);
  std::uniform_real_distribution<float> greys(0, 255);
  std::ranges::generate(image.grey, [&] { return greys(generator); });
  return image;
}

// What sample_line() is short for.
float expected(const ImageMeasurement& image, const Eigen::Vector2d& p_px, BeyondEdge beyond) {
  if (beyond == BeyondEdge::kNothing) return sample_map(image, image.grey, p_px);
  return sample_map(image, image.grey,
                    {std::clamp(p_px.x(), 0.0, kWidth - 1.001), std::clamp(p_px.y(), 0.0, kHeight - 1.001)});
}

class LineSamples : public testing::TestWithParam<BeyondEdge> {};

INSTANTIATE_TEST_SUITE_P(Beyond, LineSamples, testing::Values(BeyondEdge::kNothing, BeyondEdge::kEdge));

TEST_P(LineSamples, AreThoseOfTheirPlacesOneByOneInsideAndBeyondTheImage) {
  const ImageMeasurement image = noisy_image();
  std::mt19937 generator(5);
  std::uniform_real_distribution<double> across(-20, kWidth + 20);
  std::uniform_real_distribution<double> down(-20, kHeight + 20);
  std::uniform_real_distribution<double> turn(0, 2 * M_PI);
  std::array<float, 31> samples{};
  int inside = 0;
  for (int line = 0; line < 500; ++line) {
    const double direction = turn(generator);
    const LinePoints points{{across(generator), down(generator)}, {std::cos(direction), std::sin(direction)}};
    sample_line(image, image.grey, points, GetParam(), samples);
    int zeros = 0;
    for (std::size_t k = 0; k < samples.size(); ++k) {
      const Eigen::Vector2d p_px = points.first_px + static_cast<double>(k) * points.step_px;
      // A place on the very edge may be rounded to either side of it.
      const bool is_on_edge =
          std::abs(p_px.x() - (kWidth - 1)) < 1e-3 || std::abs(p_px.y() - (kHeight - 1)) < 1e-3;
      const float one_by_one = expected(image, p_px, GetParam());
      zeros += one_by_one == 0 ? 1 : 0;
      if (!is_on_edge) {
        EXPECT_NEAR(samples[k], one_by_one, 0.01) << p_px.transpose();
      }
    }
    inside += zeros == 0 ? 1 : 0;
  }
  EXPECT_GT(inside, 50);  // lines that lie inside are read in another way than those that leave
}

// The last place that may be read between pixels is short of the last pixel.
TEST_P(LineSamples, AlongTheEdgesReadNothingBeyondTheMap) {
  const ImageMeasurement image = noisy_image();
  std::array<float, 20> samples{};
  for (const double y_px : {0.0, kHeight - 1.0005, kHeight - 1.01}) {
    const LinePoints points{{kWidth - 1.01, y_px}, {-1, 0}};
    sample_line(image, image.grey, points, GetParam(), samples);
    for (std::size_t k = 0; k < samples.size(); ++k) {
      const Eigen::Vector2d p_px = points.first_px + static_cast<double>(k) * points.step_px;
      EXPECT_NEAR(samples[k], expected(image, p_px, GetParam()), 0.01) << p_px.transpose();
    }
  }
}

TEST_P(LineSamples, OfPlacesThatAreNoNumbersAreZero) {
  const ImageMeasurement image = noisy_image();
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  std::array<float, 5> samples{};
  samples.fill(1);
  sample_line(image, image.grey, {{kNone, 20}, {1, 0}}, GetParam(), samples);
  EXPECT_EQ(samples, (std::array<float, 5>{}));
  samples.fill(1);
  sample_line(image, image.grey, {{20, 20}, {kNone, kNone}}, GetParam(), samples);
  EXPECT_EQ(std::vector<float>(samples.begin() + 1, samples.end()), std::vector<float>(4, 0.0F));
}

}  // namespace
}  // namespace tubed
