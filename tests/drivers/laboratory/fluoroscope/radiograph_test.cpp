#include "drivers/laboratory/fluoroscope/radiograph.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <numeric>
#include <stdexcept>

#include "drivers/laboratory/fluoroscope/rod_shadow.hpp"
#include "tests/drivers/laboratory/fluoroscope/small_patient.hpp"

namespace tubed {
namespace {

constexpr int kWidth = 120;
constexpr int kHeight = 100;
constexpr std::int64_t kSeed = 11;

RadiographScene scene_with(const RadiographRod& rod) {
  RadiographScene scene;
  scene.catheters.push_back(rod);
  return scene;
}

/// -log of what the catheter lets through, a pixel, by the 16 bit pictures with and without it.
class CatheterShadow {
 public:
  CatheterShadow(const RadiographRod& rod, const CameraCalibration& view)
      : with_(grey(scene_with(rod), view)), without_(grey({}, view)) {}

  [[nodiscard]] double at(int x, int y) const {
    const auto pixel = static_cast<std::size_t>(y * kWidth + x);
    return without_[pixel] - with_[pixel];
  }

 private:
  static std::vector<double> grey(const RadiographScene& scene, const CameraCalibration& view) {
    RadiographSettings settings = without_noise();
    settings.display.contrast = 0.05;
    Radiograph radiograph(view, water_patient(), settings, kSeed);
    const std::vector<std::uint8_t> bytes = picture_of(radiograph, scene);
    std::vector<double> values;
    for (std::size_t i = 0; i < bytes.size(); i += 2) {
      std::uint16_t value = 0;
      std::memcpy(&value, bytes.data() + i, 2);
      values.push_back(value);
    }
    return values;
  }

  std::vector<double> with_;
  std::vector<double> without_;
};

/// Where the projected centreline crosses row y: x in px, and how steeply it runs there (dx / dy).
struct Crossing {
  double x_px = 0;
  double slope = 0;
};

Crossing crossing_of(const RadiographRod& rod, const Camera& camera, double y) {
  for (Eigen::Index i = 0; i + 1 < rod.centreline_room_mm.cols(); ++i) {
    const Eigen::Vector2d a = camera.project(rod.centreline_room_mm.col(i))->p_image_px;
    const Eigen::Vector2d b = camera.project(rod.centreline_room_mm.col(i + 1))->p_image_px;
    if ((a.y() - y) * (b.y() - y) <= 0 && a.y() != b.y()) {
      const double slope = (b.x() - a.x()) / (b.y() - a.y());
      return {a.x() + (y - a.y()) * slope, slope};
    }
  }
  return {-1, 0};
}

TEST(Radiograph, TheCatheterLiesOnItsProjectedCentrelineWithinATwentiethOfAPixel) {
  for (const double shift_mm : {0.0, 0.17, 0.34}) {
    const CameraCalibration view = small_view("A", 20);
    const RadiographRod rod = bent_catheter(shift_mm);
    const CatheterShadow shadow(rod, view);
    const Camera camera(view);
    double mean = 0;
    int rows = 0;
    for (int y = 8; y < kHeight - 8; ++y) {
      const double expected = crossing_of(rod, camera, y).x_px;
      ASSERT_GT(expected, 10) << y;
      double weight = 0, moment = 0;
      for (int x = static_cast<int>(expected) - 8; x <= static_cast<int>(expected) + 9; ++x) {
        weight += shadow.at(x, y);
        moment += shadow.at(x, y) * x;
      }
      EXPECT_NEAR(moment / weight, expected, 0.05) << "row " << y;
      mean += moment / weight - expected;
      ++rows;
    }
    EXPECT_NEAR(mean / rows, 0, 0.01);
  }
}

/// Variance, px^2, of the profile in row 50 of an upright solid catheter at `x_mm`.
double profile_variance(double x_mm) {
  RadiographRod rod;
  rod.centreline_room_mm.resize(3, 2);
  rod.centreline_room_mm << x_mm, x_mm, 0, 0, -40, 40;
  rod.attenuation_per_mm = 0.02;
  rod.lumen_radius_mm = 0;
  const CatheterShadow shadow(rod, small_view());
  double sum = 0, moment = 0, spread = 0;
  for (int x = 50; x < 72; ++x) {
    sum += shadow.at(x, 50);
    moment += shadow.at(x, 50) * x;
    spread += shadow.at(x, 50) * x * x;
  }
  return spread / sum - moment / sum * moment / sum;
}

TEST(Radiograph, TheCatheterIsAsWideAsItsDiameterProjects) {
  // Five places within one pixel (0.6 mm), so that where the pixels lie does not matter.
  double variance = 0;
  for (int place = 0; place < 5; ++place) {
    variance += profile_variance(0.12 * place) / 5;
  }
  // The chords of a circle have the variance r^2/4, blur and pixels add theirs: three rays stand for a
  // pixel's width, (1 - 1/9) / 12, and each blur's own pixel adds 1/12.
  const double radius_px = 1.165 * 2000 / 1200;
  const DetectorSettings detector;
  const double blur = detector.source_blur_px * detector.source_blur_px +
                      detector.detector_blur_px * detector.detector_blur_px + 2.0 / 12;
  const double expected = radius_px * radius_px / 4 + blur + (1 - 1.0 / 9) / 12;
  EXPECT_NEAR(variance, expected, 0.002 * expected);
}

TEST(Radiograph, ElectrodesAreDarkWhereTheirArcLengthSays) {
  RadiographRod rod = bent_catheter();
  RadiographElectrode electrode;
  electrode.s_mm = 50;
  electrode.length_mm = 2;
  rod.electrodes.push_back(electrode);
  const CameraCalibration view = small_view();
  const CatheterShadow shadow(rod, view);
  const auto on_catheter = [&](Eigen::Index i) {
    const Eigen::Vector2d p = Camera(view).project(rod.centreline_room_mm.col(i))->p_image_px;
    return shadow.at(static_cast<int>(std::lround(p.x())), static_cast<int>(std::lround(p.y())));
  };

  EXPECT_GT(on_catheter(50), 3 * on_catheter(60));
  EXPECT_GT(on_catheter(50), 3 * on_catheter(44));
}

TEST(Radiograph, TheSameSeedGivesTheSamePixelsAndAnythingElseOthers) {
  const AttenuationVolume patient = water_patient();
  const RadiographSettings settings;
  Radiograph first(small_view(), patient, settings, kSeed);
  Radiograph again(small_view(), patient, settings, kSeed);
  Radiograph other_seed(small_view(), patient, settings, kSeed + 1);
  Radiograph other_view(small_view("B"), patient, settings, kSeed);
  RadiographScene later;
  later.exposure = 1;

  const std::vector<std::uint8_t> picture = picture_of(first, {});
  EXPECT_EQ(picture, picture_of(again, {}));
  EXPECT_NE(picture, picture_of(other_seed, {}));
  EXPECT_NE(picture, picture_of(other_view, {}));
  EXPECT_NE(picture, picture_of(first, later));
}

TEST(Radiograph, WithoutLagAPictureDoesNotDependOnTheOnesBefore) {
  RadiographSettings settings;
  settings.detector.lag = 0;
  Radiograph busy(small_view(), water_patient(), settings, kSeed);
  Radiograph fresh(small_view(), water_patient(), settings, kSeed);
  RadiographScene scene = scene_with(bent_catheter(3));
  scene.exposure = 9;

  for (std::int64_t exposure = 0; exposure < 3; ++exposure) {
    RadiographScene before = scene_with(bent_catheter(static_cast<double>(exposure)));
    before.clutter.collimator = exposure == 1;
    picture_of(busy, before);
  }
  EXPECT_EQ(picture_of(busy, scene), picture_of(fresh, scene));
}

TEST(Radiograph, LagLeavesItsPartOfThePictureBeforeInTheNext) {
  RadiographSettings settings = without_noise();
  settings.detector.lag = 0.25;
  settings.display.contrast = 0.05;
  Radiograph lagging(small_view(), water_patient(), settings, kSeed);
  const auto darkest_loss = [&](const RadiographScene& scene) {
    const std::vector<std::uint8_t> bytes = picture_of(lagging, scene);
    std::uint16_t value = 0;
    const Eigen::Vector2d p =
        Camera(small_view()).project(bent_catheter().centreline_room_mm.col(60))->p_image_px;
    std::memcpy(&value, bytes.data() + 2 * (std::lround(p.y()) * kWidth + std::lround(p.x())), 2);
    return static_cast<double>(value);
  };
  const double with = darkest_loss(scene_with(bent_catheter()));
  const double ghost = darkest_loss({});
  double gone = 0;
  for (int read_out = 0; read_out < 20; ++read_out) gone = darkest_loss({});

  EXPECT_NEAR((gone - ghost) / (gone - with), 0.25, 0.02);
}

TEST(Radiograph, FourTimesTheDoseHalvesTheNoise) {
  const auto noise = [](double quanta) {
    RadiographSettings settings;
    settings.detector.quanta_per_pixel = quanta;
    settings.detector.electronic_noise = 0;
    settings.detector.lag = 0;
    settings.display.bits = 16;
    settings.display.contrast = 0.05;
    Radiograph radiograph(small_view(), water_patient(), settings, kSeed);
    const std::vector<std::uint8_t> bytes = picture_of(radiograph, {});
    double sum = 0, squares = 0;
    for (std::size_t i = 0; i < bytes.size(); i += 2) {
      std::uint16_t value = 0;
      std::memcpy(&value, bytes.data() + i, 2);
      sum += value;
      squares += static_cast<double>(value) * value;
    }
    const double count = static_cast<double>(bytes.size()) / 2;
    return std::sqrt(squares / count - sum / count * sum / count);
  };
  EXPECT_NEAR(noise(300) / noise(1200), 2, 0.06);
}

TEST(Radiograph, ExposureControlKeepsTheMedianPixelAtTheDoseWhateverThePatient) {
  RadiographSettings settings;
  settings.detector.quanta_per_pixel = 333;
  for (const float attenuation : {0.004F, 0.02F}) {
    Radiograph radiograph(small_view(), cube_of(21, 10, attenuation), settings, kSeed);
    const auto expected = radiograph.expected_quanta({});
    std::vector<float> quanta(expected.begin(), expected.end());
    std::nth_element(quanta.begin(), quanta.begin() + 6000, quanta.end());
    EXPECT_NEAR(quanta[6000], 333, 1);
  }
}

TEST(Radiograph, ScatterIsAsStrongAsAskedAndTakesFromTheContrast) {
  RadiographSettings clean = without_noise();
  clean.detector.scatter_to_primary = 0;
  RadiographSettings veiled = without_noise();
  veiled.detector.scatter_to_primary = 1;
  const auto contrast = [](const RadiographSettings& settings) {
    Radiograph radiograph(small_view(), water_patient(), settings, kSeed);
    const auto span = radiograph.expected_quanta({});
    const std::vector<float> without(span.begin(), span.end());
    const auto with = radiograph.expected_quanta(scene_with(bent_catheter()));
    double darkest = 0;
    for (std::size_t i = 0; i < without.size(); ++i) darkest = std::max(darkest, 1.0 - with[i] / without[i]);
    return darkest;
  };
  // Through the middle of the wall: exp(-mu * chord) of the primary, and half of all quanta are primary.
  EXPECT_NEAR(contrast(veiled) / contrast(clean), 0.5, 0.01);
}

TEST(Radiograph, WithoutRadiationThereIsNoPicture) {
  Radiograph radiograph(small_view(), water_patient(), {}, kSeed);
  RadiographScene scene;
  scene.fluoroscopy_on = false;
  std::vector<std::uint8_t> pixels(radiograph.bytes_per_image(), 77);

  EXPECT_EQ(radiograph.render(scene, pixels), RadiographOutcome::kNoRadiation);
  EXPECT_EQ(pixels, std::vector<std::uint8_t>(pixels.size(), 77));
  scene.fluoroscopy_on = true;
  EXPECT_EQ(radiograph.render(scene, pixels), RadiographOutcome::kExposed);
  EXPECT_NE(pixels, std::vector<std::uint8_t>(pixels.size(), 77));
}

TEST(Radiograph, TheCollimatorsBladesAreBlackAndItsWindowIsUnchanged) {
  RadiographSettings settings = without_noise();
  settings.display.bits = 8;
  Radiograph radiograph(small_view(), water_patient(), settings, kSeed);
  RadiographScene scene;
  const std::vector<std::uint8_t> open = picture_of(radiograph, scene);
  scene.clutter.collimator = true;
  const std::vector<std::uint8_t> closed = picture_of(radiograph, scene);

  EXPECT_EQ(closed[50 * kWidth + 60], open[50 * kWidth + 60]);
  EXPECT_EQ(closed[50 * kWidth + 10], 0);  // 22 px from the left
  EXPECT_EQ(closed[5 * kWidth + 60], 0);   // 16 px from the top
  EXPECT_EQ(closed[98 * kWidth + 60], 0);  // 24 px from the bottom
}

TEST(Radiograph, TwoViewsOfOneCatheterAgreeWithTheirCameras) {
  for (const double lao_deg : {-40.0, 50.0}) {
    const CameraCalibration view = small_view("A", lao_deg);
    const RadiographRod rod = bent_catheter();
    const CatheterShadow shadow(rod, view);
    const Crossing crossing = crossing_of(rod, Camera(view), 50);
    const int x = static_cast<int>(std::lround(crossing.x_px));
    EXPECT_GT(shadow.at(x, 50), 20 * std::abs(shadow.at(x - 12, 50)));
    EXPECT_GT(shadow.at(x, 50), 20 * std::abs(shadow.at(x + 12, 50)));
  }
}

TEST(Radiograph, SettingsThatCannotBeAreRefusedByName) {
  const AttenuationVolume patient = cube_of(5, 10, 0.01F);
  const auto refusal = [&](auto change) {
    RadiographSettings settings;
    change(settings);
    try {
      Radiograph(small_view(), patient, settings, kSeed);
    } catch (const std::invalid_argument& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_NE(refusal([](auto& s) { s.display.bits = 7; }).find("bits is 7"), std::string::npos);
  EXPECT_NE(refusal([](auto& s) { s.detector.quanta_per_pixel = 0; }).find("quanta_per_pixel"),
            std::string::npos);
  EXPECT_NE(refusal([](auto& s) { s.detector.lag = 1; }).find("lag is 1"), std::string::npos);
  EXPECT_NE(refusal([](auto& s) { s.detector.scatter_to_primary = NAN; }).find("scatter_to_primary"),
            std::string::npos);
  EXPECT_NE(refusal([](auto& s) { s.lumen.radius_mm = Eigen::VectorXd::Ones(3); }).find("3 radii"),
            std::string::npos);
  EXPECT_EQ(refusal([](auto&) {}), "");
  CameraCalibration empty = small_view();
  empty.width = 0;
  EXPECT_THROW(Radiograph(empty, patient, {}, kSeed), std::invalid_argument);
}

TEST(RadiographDeathTest, ABufferOfAnotherSizeIsABugOfTheCaller) {
  Radiograph radiograph(small_view(), cube_of(5, 10, 0.01F), {}, kSeed);
  std::vector<std::uint8_t> pixels(7);
  EXPECT_DEATH(radiograph.render({}, pixels), "pixel buffer");
}

}  // namespace
}  // namespace tubed
