#include "daemon/image/image_likelihood.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <random>
#include <vector>

#include "daemon/image/frangi.hpp"

namespace tubed {
namespace {

constexpr int kWidth = 260;
constexpr int kHeight = 200;
constexpr int kLines = 100;
constexpr double kSpacing_px = 2;
constexpr int kReach_px = 14;
constexpr double kTubeRow_px = 103;  // the lines are laid along 100: the coils are 3 px off
constexpr double kHalfWidth_px = 1.9;

/// An X-ray picture by Beer and Lambert: thicknesses add up, then the detector blurs a little and counts.
class Radiograph {
 public:
  Radiograph() : thickness_(static_cast<std::size_t>(kWidth) * kHeight, 0.0) {}

  /// `thickness(x, y)` is the exponent that a thing takes of the rays.
  void add(const std::function<double(double, double)>& thickness) {
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) at(x, y) += thickness(x, y);
    }
  }

  /// A round wire along points p with |distance(p)| its distance from the axis.
  void add_wire(const std::function<double(double, double)>& distance, double radius_px, double absorption) {
    add([=](double x, double y) {
      double sum = 0;  // over the pixel, by four places an axis
      for (const double dx : {-0.375, -0.125, 0.125, 0.375}) {
        for (const double dy : {-0.375, -0.125, 0.125, 0.375}) {
          const double off = distance(x + dx, y + dy) / radius_px;
          sum += off * off < 1 ? std::sqrt(1 - off * off) : 0;
        }
      }
      return absorption * sum / 16;
    });
  }

  /// No rays where `closed(x, y)`.
  void close_blade(const std::function<bool(double, double)>& closed) {
    add([=](double x, double y) { return closed(x, y) ? 3.0 : 0.0; });
  }

  [[nodiscard]] ImageMeasurement measured(unsigned seed) const {
    ImageMeasurement image;
    image.reserve(kWidth, kHeight);
    std::mt19937 random(seed);
    std::normal_distribution<double> quanta(0, 1);
    for (std::size_t i = 0; i < thickness_.size(); ++i) {
      const double expected = 180 * std::exp(-thickness_[i]);
      image.grey[i] = static_cast<float>(std::round(expected + 0.25 * std::sqrt(expected) * quanta(random)));
    }
    image.state = ImageState::kMeasured;
    FrangiFilter(kWidth, kHeight, FrangiSettings{}).filter(image.grey, image.vesselness);
    return image;
  }

 private:
  double& at(int x, int y) { return thickness_[static_cast<std::size_t>(y * kWidth + x)]; }

  std::vector<double> thickness_;
};

/// The tube along its row, seen by lines along another one.
class ImageLikelihoodOf : public testing::TestWithParam<ImageLikelihoodForm> {
 protected:
  ImageLikelihoodOf() {
    for (std::size_t i = 0; i < kLines; ++i) {
      lines_[i].base_px = {30 + kSpacing_px * static_cast<double>(i), 100};
      lines_[i].normal = {0, 1};
      lines_[i].half_width_px = kHalfWidth_px;
      lines_[i].in_view = true;
    }
  }

  static void add_tube(Radiograph& picture) { add_tube(picture, 0, kWidth); }
  static void add_tube(Radiograph& picture, double from_px, double to_px) {
    picture.add_wire([=](double x, double y) { return x >= from_px && x < to_px ? y - kTubeRow_px : 1e3; },
                     kHalfWidth_px, 0.35);
  }

  LineSearch::Outcome find(const ImageMeasurement& image) {
    return likelihood_->find(image, lines_, kLines, kReach_px, LineSearch::Among::kTubes);
  }

  /// A tube alone is looked at first, and trusted: what tube and background look like is known from then on.
  void know_the_tube() {
    Radiograph picture;
    add_tube(picture);
    const ImageMeasurement image = picture.measured(1);
    find(image);
    likelihood_->trust(image);
  }

  /// Captured: away from the tube, and sure of it.
  [[nodiscard]] int silently_captured() const {
    return static_cast<int>(std::count_if(lines_.begin(), lines_.begin() + kLines, [](const auto& line) {
      const double off_px = std::abs(line.base_px.y() + line.offset_px - kTubeRow_px);
      return line.in_view && line.agrees && off_px > 3 && off_px > 3 * std::sqrt(line.variance_px2);
    }));
  }

  [[nodiscard]] double median_off_px() const {
    std::vector<double> off;
    for (const auto& line : std::span(lines_).first(kLines)) {
      if (line.in_view) off.push_back(std::abs(line.base_px.y() + line.offset_px - kTubeRow_px));
    }
    std::nth_element(off.begin(), off.begin() + static_cast<std::ptrdiff_t>(off.size() / 2), off.end());
    return off[off.size() / 2];
  }

  /// Eq. (16) gets stuck up to a pixel beside the tube.
  [[nodiscard]] static double tolerance_px() { return GetParam() == ImageLikelihoodForm::kBand ? 1.0 : 0.5; }

  CorrespondenceLines lines_;
  std::unique_ptr<ImageLikelihood> likelihood_ = make_image_likelihood(GetParam());
};

TEST_P(ImageLikelihoodOf, ATubeAloneIsFound) {
  Radiograph picture;
  add_tube(picture);
  const auto outcome = find(picture.measured(2));
  EXPECT_EQ(outcome.in_view, kLines);
  EXPECT_GT(outcome.inlier_ratio, 0.9);
  EXPECT_LT(median_off_px(), tolerance_px());
  EXPECT_EQ(silently_captured(), 0);
}

TEST_P(ImageLikelihoodOf, ACrossingWireLeadsNoLineAway) {
  know_the_tube();
  Radiograph picture;
  add_tube(picture);
  picture.add_wire([](double x, double y) { return (x - 130 - (y - 103)) / std::sqrt(2.0); }, 1.5, 0.5);
  find(picture.measured(3));
  EXPECT_LT(median_off_px(), tolerance_px());
  EXPECT_EQ(silently_captured(), 0);
}

TEST_P(ImageLikelihoodOf, AThinParallelWireDoesNotTakeOverInSilence) {
  know_the_tube();
  Radiograph picture;
  add_tube(picture);
  picture.add_wire([](double, double y) { return y - 111; }, 0.8, 0.25);
  find(picture.measured(4));
  EXPECT_LT(median_off_px(), tolerance_px());
  EXPECT_EQ(silently_captured(), 0);
}

TEST_P(ImageLikelihoodOf, AStretchThatIsHiddenSaysThatItDoesNotKnow) {
  know_the_tube();
  Radiograph picture;
  add_tube(picture, 0, 110);
  add_tube(picture, 150, kWidth);
  find(picture.measured(5));
  EXPECT_EQ(silently_captured(), 0);
  const CorrespondenceLine& hidden = lines_[50];  // at 130 px
  const CorrespondenceLine& seen = lines_[10];
  EXPECT_TRUE(!hidden.agrees || hidden.variance_px2 > 4 * seen.variance_px2)
      << hidden.variance_px2 << " beside " << seen.variance_px2;
}

TEST_P(ImageLikelihoodOf, ContrastAgentOverTheTubeLeadsNoLineToItsEdge) {
  know_the_tube();
  Radiograph picture;
  add_tube(picture);
  picture.add([](double x, double y) {  // a vessel 24 px wide whose agent thins out to both sides
    const double across = (y - 106) / 12;
    return across * across < 1 ? 0.6 * std::sqrt(1 - across * across) * std::exp(-std::pow((x - 130) / 40, 2))
                               : 0.0;
  });
  find(picture.measured(6));
  EXPECT_EQ(silently_captured(), 0);
}

TEST_P(ImageLikelihoodOf, ACollimatorBladeLeadsNoLineToItsEdge) {
  know_the_tube();
  Radiograph picture;
  add_tube(picture);
  picture.close_blade([](double x, double y) { return y > 150 - 0.35 * x; });  // crosses the tube at 134 px
  find(picture.measured(7));
  EXPECT_EQ(silently_captured(), 0);
}

TEST_P(ImageLikelihoodOf, LinesBeyondTheBorderTakeNoPartAndThoseAtItStayWithTheTube) {
  know_the_tube();
  Radiograph picture;
  add_tube(picture);
  for (std::size_t i = 0; i < kLines; ++i) {
    lines_[i].base_px.x() = 100 + kSpacing_px * static_cast<double>(i);
    lines_[i].in_view = lines_[i].base_px.x() <= kWidth - 4;
  }
  const auto outcome = find(picture.measured(8));
  EXPECT_EQ(outcome.in_view, 79);
  EXPECT_EQ(silently_captured(), 0);
  EXPECT_LT(median_off_px(), tolerance_px());
  for (std::size_t i = 79; i < kLines; ++i) EXPECT_FALSE(lines_[i].agrees) << i;
}

TEST_P(ImageLikelihoodOf, AnImageWithoutATubeIsNotTakenForOne) {
  know_the_tube();
  const auto outcome = find(Radiograph().measured(9));
  double least = 1e9;
  for (const auto& line : std::span(lines_).first(kLines)) {
    if (line.agrees) least = std::min(least, line.variance_px2);
  }
  EXPECT_TRUE(outcome.inlier_ratio < 0.62 || least > 1)
      << outcome.inlier_ratio << " agree, variance " << least;
}

INSTANTIATE_TEST_SUITE_P(EveryForm, ImageLikelihoodOf,
                         testing::Values(ImageLikelihoodForm::kVesselness, ImageLikelihoodForm::kPosterior,
                                         ImageLikelihoodForm::kBand),
                         [](const auto& which) { return std::string(name_of(which.param)); });

TEST(ImageLikelihood, EveryFormIsFoundByItsName) {
  for (const auto form :
       {ImageLikelihoodForm::kVesselness, ImageLikelihoodForm::kPosterior, ImageLikelihoodForm::kBand}) {
    EXPECT_EQ(image_likelihood_named(name_of(form)), form);
  }
  EXPECT_FALSE(image_likelihood_named("guess"));
}

}  // namespace
}  // namespace tubed
