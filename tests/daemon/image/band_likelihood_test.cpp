#include "daemon/image/band_likelihood.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace tubed {
namespace {

constexpr double kHalfWidth_px = 2;
constexpr double kEpsilon_px = 1.5;

/// A dark tube of half width 2 px along a gentle arc, in noise.
struct Scene {
  Scene() {
    std::mt19937 random(7);
    std::normal_distribution<float> noise(0, 6);
    image.reserve(120, 90);
    for (int y = 0; y < image.height; ++y) {
      for (int x = 0; x < image.width; ++x) {
        const auto index = static_cast<std::size_t>(y * image.width + x);
        const double across = std::abs(y - arc(x));
        image.grey[index] = (across < kHalfWidth_px ? 80.0F : 120.0F) + noise(random);
        image.vesselness[index] = static_cast<float>(0.7 * std::exp(-across * across / 4));
      }
    }
    path = path_shifted_by(0);
    band.choose_band(image, path, 15, model);
    EXPECT_TRUE(model.learn(image, band.pixels(), 1));
    band.weigh(image, model);
  }
  static double arc(double x) { return 40 + 0.004 * (x - 60) * (x - 60); }
  static std::vector<PathVertex> path_shifted_by(double down_px) {
    std::vector<PathVertex> path;
    for (double x = -10; x <= 100; x += 3) path.push_back({{x, arc(x) + down_px}, kHalfWidth_px});
    return path;
  }
  ImageMeasurement image;
  AppearanceModel model;
  BandLikelihood band;
  std::vector<PathVertex> path;
};

TEST(SmoothHeaviside, IsZeroHalfAndOneWhereEquation17SaysSo) {
  EXPECT_EQ(smooth_heaviside(-2.1, 2), 0);
  EXPECT_EQ(smooth_heaviside(2.1, 2), 1);
  EXPECT_DOUBLE_EQ(smooth_heaviside(0, 2), 0.5);
  // x = epsilon / 2: (1 + 1/2 + sin(pi / 2) / pi) / 2
  EXPECT_NEAR(smooth_heaviside(1, 2), 0.75 + 0.5 / M_PI, 1e-12);
}

TEST(SmoothHeaviside, SlopeIsItsDerivative) {
  for (const double x : {-3.0, -1.9, -0.7, 0.0, 0.4, 1.99, 5.0}) {
    const double difference = (smooth_heaviside(x + 1e-6, 2) - smooth_heaviside(x - 1e-6, 2)) / 2e-6;
    EXPECT_NEAR(smooth_heaviside_slope(x, 2), difference, 1e-8) << x;
  }
}

TEST(BandLikelihood, PixelsThatNobodyMeasuredAreLeftOut) {
  Scene scene;
  const std::size_t all = scene.band.pixels().size();
  scene.image.measured.clear();
  scene.image.measured.add_box({0, 0}, {47, 89});
  scene.band.choose_band(scene.image, scene.path, 15, scene.model);
  EXPECT_GT(scene.band.pixels().size(), all / 4);
  for (const PixelDistance& pixel : scene.band.pixels()) {
    EXPECT_LT(pixel.index % 120, 48U);
  }
}

TEST(BandLikelihood, SignedDistanceIsPositiveInsideAndZeroOnTheContour) {
  ImageMeasurement image;
  image.reserve(60, 40);
  const std::vector<PathVertex> path{{{10, 20}, 3}, {{30, 20}, 3}};
  BandLikelihood band;
  band.choose_band(image, path, 5, AppearanceModel{});
  for (const PixelDistance& pixel : band.pixels()) {
    const double x = static_cast<double>(pixel.index % 60);
    const double y = static_cast<double>(pixel.index / 60);
    const double beyond = std::max({10 - x, x - 30, 0.0});
    EXPECT_NEAR(pixel.signed_distance_px, 3 - std::hypot(beyond, y - 20), 1e-5) << x << ' ' << y;
    EXPECT_GE(pixel.signed_distance_px, -5);
  }
  EXPECT_GT(band.pixels().size(), 20U * 16);
}

TEST(BandLikelihood, BehindAnEndThatGoesOnNoPixelIsAsked) {
  ImageMeasurement image;
  image.reserve(60, 40);
  const std::vector<PathVertex> path{{{10, 20}, 3}, {{20, 20}, 3}, {{30, 20}, 3}};
  BandLikelihood band;
  band.choose_band(image, path, 5, AppearanceModel{}, PathEnd::kCapped);
  const std::size_t capped = band.pixels().size();
  band.choose_band(image, path, 5, AppearanceModel{}, PathEnd::kGoesOn);
  EXPECT_LT(band.pixels().size(), capped);
  for (const PixelDistance& pixel : band.pixels()) EXPECT_LT(pixel.index % 60, 30U);
}

TEST(BandLikelihood, EquationSixteenByHandOnFourPixels) {
  ImageMeasurement image;
  image.reserve(2, 2);
  // With nothing learned P_f = P_b = 1: every pixel's Eq. (16) is 1 / |Omega|, whatever the path.
  const std::vector<PathVertex> path{{{0, 0}, 1}, {{1, 0}, 1}};
  BandLikelihood band;
  band.choose_band(image, path, 3, AppearanceModel{});
  ASSERT_EQ(band.pixels().size(), 4U);
  EXPECT_NEAR(band.log_likelihood(path, 1, nullptr), 4 * std::log(1.0 / 4), 1e-12);
}

TEST(BandLikelihood, IsGreatestWhereTheTubeIs) {
  Scene scene;
  const double here = scene.band.log_likelihood(scene.path, kEpsilon_px, nullptr);
  for (const double down_px : {-6.0, -3.0, -1.0, 1.0, 3.0, 6.0}) {
    EXPECT_GT(here, scene.band.log_likelihood(Scene::path_shifted_by(down_px), kEpsilon_px, nullptr))
        << down_px;
  }
}

TEST(BandLikelihood, GradientIsThatOfFiniteDifferences) {
  Scene scene;
  std::vector<PathVertex> path = Scene::path_shifted_by(1.3);
  BandDerivatives derivatives;
  scene.band.log_likelihood(path, kEpsilon_px, &derivatives);
  constexpr double kStep_px = 1e-5;
  for (std::size_t i = 0; i < path.size(); ++i) {
    for (int axis = 0; axis < 2; ++axis) {
      const double at = path[i].p_px[axis];
      path[i].p_px[axis] = at + kStep_px;
      const double above = scene.band.log_likelihood(path, kEpsilon_px, nullptr);
      path[i].p_px[axis] = at - kStep_px;
      const double below = scene.band.log_likelihood(path, kEpsilon_px, nullptr);
      path[i].p_px[axis] = at;
      const double gradient = derivatives.gradient(axis, static_cast<Eigen::Index>(i));
      EXPECT_NEAR(gradient, (above - below) / (2 * kStep_px), 1e-3 + 1e-4 * std::abs(gradient)) << i << axis;
    }
  }
}

/// Log of the numerator of Eq. (16) of each band pixel, written from Eq. (16) and (17) with the distance to
/// every segment.
std::vector<double> log_numerators(const Scene& scene, const std::vector<PathVertex>& path) {
  std::vector<double> logarithms;
  for (const PixelDistance& pixel : scene.band.pixels()) {
    const Eigen::Vector2d x(static_cast<double>(pixel.index % 120), static_cast<double>(pixel.index / 120));
    double distance = 1e9;
    for (std::size_t i = 0; i + 1 < path.size(); ++i) {
      const Eigen::Vector2d along = path[i + 1].p_px - path[i].p_px;
      const double t = std::clamp((x - path[i].p_px).dot(along) / along.squaredNorm(), 0.0, 1.0);
      distance = std::min(distance, (x - path[i].p_px - t * along).norm());
    }
    const double h = smooth_heaviside(kHalfWidth_px - distance, kEpsilon_px);
    const float grey = scene.image.grey[pixel.index];
    const float vesselness = scene.image.vesselness[pixel.index];
    logarithms.push_back(std::log(static_cast<double>(scene.model.foreground(grey, vesselness)) * h +
                                  static_cast<double>(scene.model.background(grey, vesselness)) * (1 - h)));
  }
  return logarithms;
}

TEST(BandLikelihood, InformationIsTheSumOfSquaredFiniteDifferencesOfThePixels) {
  Scene scene;
  std::vector<PathVertex> path = Scene::path_shifted_by(1.3);
  BandDerivatives derivatives;
  scene.band.log_likelihood(path, kEpsilon_px, &derivatives);
  constexpr double kStep_px = 1e-5;
  constexpr std::size_t kVertex = 15;
  std::vector<std::vector<double>> scores;  // by x and y of this vertex, then of the next
  for (const std::size_t vertex : {kVertex, kVertex + 1}) {
    for (int axis = 0; axis < 2; ++axis) {
      const double at = path[vertex].p_px[axis];
      path[vertex].p_px[axis] = at + kStep_px;
      std::vector<double> score = log_numerators(scene, path);
      path[vertex].p_px[axis] = at - kStep_px;
      const std::vector<double> below = log_numerators(scene, path);
      path[vertex].p_px[axis] = at;
      for (std::size_t m = 0; m < score.size(); ++m) score[m] = (score[m] - below[m]) / (2 * kStep_px);
      scores.push_back(score);
    }
  }
  for (int row = 0; row < 2; ++row) {
    for (int column = 0; column < 2; ++column) {
      double own = 0;
      double next = 0;
      for (std::size_t m = 0; m < scores[0].size(); ++m) {
        own += scores[static_cast<std::size_t>(row)][m] * scores[static_cast<std::size_t>(column)][m];
        next += scores[static_cast<std::size_t>(row)][m] * scores[static_cast<std::size_t>(2 + column)][m];
      }
      const double scale = 1e-4 * derivatives.information[kVertex].trace();
      EXPECT_NEAR(derivatives.information[kVertex](row, column), own, scale);
      EXPECT_NEAR(derivatives.information_next[kVertex](row, column), next, scale);
    }
  }
}

TEST(BandLikelihood, OffsetsPointBackToTheTubeWithinAPixel) {
  Scene scene;
  const std::vector<PathVertex> path = Scene::path_shifted_by(1);
  BandDerivatives derivatives;
  scene.band.log_likelihood(path, kEpsilon_px, &derivatives);
  const Eigen::Matrix2Xd down = Eigen::Vector2d::UnitY().replicate(1, static_cast<Eigen::Index>(path.size()));
  std::vector<BandOffset> offsets(path.size());
  offsets_along(derivatives, down, offsets);
  int back = 0;
  for (std::size_t i = 5; i + 1 < path.size(); ++i) {
    EXPECT_GT(offsets[i].variance_px2, 0);
    EXPECT_LT(offsets[i].variance_px2, 4);
    back += offsets[i].offset_px < 0 && offsets[i].offset_px > -3 ? 1 : 0;
  }
  EXPECT_GE(back, static_cast<int>(path.size() - 6) * 9 / 10) << "of " << path.size() - 6;
  EXPECT_TRUE(std::isinf(offsets[0].variance_px2)) << "a vertex outside the image says nothing";
}

TEST(BandLikelihood, PathsOutsideTheImageOrWithoutPlaceLeaveAnEmptyBand) {
  Scene scene;
  const std::vector<PathVertex> outside{{{-500, 0}, 2}, {{-400, 0}, 2}};
  scene.band.choose_band(scene.image, outside, 10, scene.model);
  EXPECT_TRUE(scene.band.pixels().empty());
  EXPECT_EQ(scene.band.log_likelihood(outside, 1, nullptr), 0);
  const std::vector<PathVertex> nowhere{{{NAN, 0}, 2}, {{10, 10}, 2}};
  scene.band.choose_band(scene.image, nowhere, 10, scene.model);
  EXPECT_TRUE(scene.band.pixels().empty());
}

}  // namespace
}  // namespace tubed
