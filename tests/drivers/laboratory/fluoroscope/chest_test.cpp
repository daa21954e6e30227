// The procedural chest, and what the default settings make of it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>
#include <vector>

#include "drivers/laboratory/fluoroscope/c_arm.hpp"
#include "drivers/laboratory/fluoroscope/clutter.hpp"
#include "drivers/laboratory/fluoroscope/radiograph.hpp"
#include "drivers/laboratory/fluoroscope/thorax.hpp"
#include "drivers/laboratory/fluoroscope/thorax_anatomy.hpp"

namespace tubed {
namespace {

/// Coarse, to be quick; made once.
const AttenuationVolume& chest() {
  static const AttenuationVolume volume = make_thorax({.spacing_mm = 2});
  return volume;
}

CameraCalibration paper_view(double lao_deg = 60) { return c_arm_view("A", {lao_deg, 0}, {0, -20, -95}); }

/// Mean attenuation within 3 mm of a place.
double attenuation_at(const Eigen::Vector3d& p_room_mm) {
  const Eigen::Vector3d place =
      (chest().T_room_volume().inverse() * p_room_mm).cwiseQuotient(chest().spacing_mm());
  double sum = 0;
  for (int number = 0; number < 27; ++number) {
    const Eigen::Vector3d off(number % 3 - 1, number / 3 % 3 - 1, number / 9 - 1);
    const Eigen::Vector3i voxel = (place + 1.5 * off).array().round().cast<int>();
    sum += chest().at(voxel.x(), voxel.y(), voxel.z()) / 27;
  }
  return sum;
}

TEST(Chest, LungsHeartSpineAndAirAttenuateAsTheirTissuesDo) {
  EXPECT_NEAR(attenuation_at({-90, 0, -40}), 0.0065, 0.0025) << "right lung, mostly air";
  EXPECT_NEAR(attenuation_at({85, 10, -60}), 0.0065, 0.0025) << "left lung";
  EXPECT_NEAR(attenuation_at({25, -65, -105}), 0.021, 0.002) << "heart, as blood";
  EXPECT_NEAR(attenuation_at({-100, -40, -190}), 0.0215, 0.002) << "liver";
  EXPECT_NEAR(attenuation_at({17, 12, -53}), 0.0213, 0.001) << "descending aorta";
  EXPECT_EQ(attenuation_at({-185, -155, 0}), 0) << "beside the patient";
  EXPECT_EQ(attenuation_at({-13, 23, 15}), 0) << "trachea";
}

TEST(Chest, RibsFollowEachOtherAlongTheChestWallAndVertebraeAlongTheSpine) {
  // How often a walk from the neck down enters bone.
  const auto bones = [](const std::function<Eigen::Vector3d(double z)>& walk) {
    int count = 0;
    bool in_bone = false;
    for (double z = 60; z > -100; z -= 1) {
      const Eigen::Vector3d place = chest().T_room_volume().inverse() * walk(z);
      const Eigen::Vector3i voxel = place.cwiseQuotient(chest().spacing_mm()).array().round().cast<int>();
      const double here = chest().at(voxel.x(), voxel.y(), voxel.z());
      count += !in_bone && here > 0.027 ? 1 : 0;
      in_bone = here > (in_bone ? 0.0225 : 0.027);
    }
    return count;
  };
  const int ribs = bones([](double z) {
    const anatomy::CrossSection cage = anatomy::rib_cage(z);
    return Eigen::Vector3d(cage.x - cage.half_width - 3.5, cage.y, z);
  });
  const int end_plates = bones([](double z) { return anatomy::spine(z); });

  EXPECT_GE(ribs, 5);
  EXPECT_LE(ribs, 9);
  // 160 mm of thoracic spine hold six or seven vertebrae, with two end plates each.
  EXPECT_GE(end_plates, 6);
  EXPECT_LE(end_plates, 15);
}

TEST(Chest, TheSameSeedGivesTheSamePatientAndAnotherSeedAnother) {
  const ThoraxSettings small{.spacing_mm = 4, .seed = 3, .z_low_room_mm = -120, .z_high_room_mm = 0};
  ThoraxSettings other = small;
  other.seed = 4;
  const AttenuationVolume first = make_thorax(small);
  const AttenuationVolume again = make_thorax(small);
  const AttenuationVolume different = make_thorax(other);
  const auto count = static_cast<std::size_t>(first.size().prod());

  EXPECT_TRUE(std::equal(first.voxels(), first.voxels() + count, again.voxels()));
  EXPECT_FALSE(std::equal(first.voxels(), first.voxels() + count, different.voxels()));
}

TEST(Chest, AGridThatCannotBeIsRefused) {
  EXPECT_THROW(make_thorax({.spacing_mm = 0.1}), std::invalid_argument);
  EXPECT_THROW(make_thorax({.spacing_mm = NAN}), std::invalid_argument);
  EXPECT_THROW(make_thorax({.z_low_room_mm = 10, .z_high_room_mm = -10}), std::invalid_argument);
  ThoraxSettings uneven;
  uneven.aorta.radius_mm.resize(2);
  EXPECT_THROW(make_thorax(uneven), std::invalid_argument);
}

TEST(Chest, TheCatheterStandsOutOfTheNoiseByTwoAndAHalfToThreeInThePapersView) {
  // Contrast: grey values without and with catheter, without noise, at the pixels of its centreline. Noise:
  // the standard deviation of these pixels over 40 exposures. Both per pixel; the median along the catheter,
  // clear of its electrodes.
  RadiographSettings clean;
  clean.detector.quanta_per_pixel = INFINITY;
  clean.detector.electronic_noise = 0;
  RadiographScene scene;
  scene.catheters.push_back(catheter_along(mean_aorta(), 60));
  const std::size_t size = 400 * 600;
  std::vector<std::uint8_t> with(size), without(size), noisy(size);
  Radiograph(paper_view(), chest(), clean, 1).render(scene, with);
  Radiograph(paper_view(), chest(), clean, 1).render({}, without);
  Radiograph radiograph(paper_view(), chest(), {}, 1);
  std::vector<double> sum(size), squares(size);
  constexpr int kExposures = 40;
  for (scene.exposure = 0; scene.exposure < kExposures; ++scene.exposure) {
    radiograph.render(scene, noisy);
    for (std::size_t i = 0; i < size; ++i) {
      sum[i] += noisy[i];
      squares[i] += static_cast<double>(noisy[i]) * noisy[i];
    }
  }
  const Camera camera(paper_view());
  std::vector<double> ratios;
  const Eigen::Matrix3Xd& centreline = scene.catheters.front().centreline_room_mm;
  for (Eigen::Index i = 25; i < centreline.cols(); ++i) {
    const auto seen = camera.project(centreline.col(i));
    if (!seen || !camera.contains(seen->p_image_px, 1)) {
      continue;
    }
    const auto pixel =
        static_cast<std::size_t>(std::lround(seen->p_image_px.y()) * 400 + std::lround(seen->p_image_px.x()));
    const double variance = squares[pixel] / kExposures - sum[pixel] * sum[pixel] / kExposures / kExposures;
    ratios.push_back((without[pixel] - with[pixel]) / std::sqrt(variance));
  }
  ASSERT_GT(ratios.size(), 200U);
  std::nth_element(ratios.begin(), ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2),
                   ratios.end());
  RecordProperty("median_contrast_to_noise", std::to_string(ratios[ratios.size() / 2]));

  EXPECT_GT(ratios[ratios.size() / 2], 2.5);
  EXPECT_LT(ratios[ratios.size() / 2], 3.0);
}

TEST(Chest, ContrastAgentWireAndLeadsDarkenThePictureWhereTheyAre) {
  RadiographSettings settings;
  add_default_clutter(settings);
  add_lumen(settings, mean_aorta());
  Radiograph radiograph(paper_view(36), chest(), settings, 1);
  const auto expected = [&](const ClutterStates& clutter) {
    RadiographScene scene;
    scene.clutter = clutter;
    const auto quanta = radiograph.expected_quanta(scene);
    return std::vector<float>(quanta.begin(), quanta.end());
  };
  const std::vector<float> patient = expected({});
  const auto darker = [&](const std::vector<float>& other, const Eigen::Vector3d& p_room_mm) {
    const Eigen::Vector2d p = Camera(paper_view(36)).project(p_room_mm)->p_image_px;
    const auto pixel = static_cast<std::size_t>(std::lround(p.y()) * 400 + std::lround(p.x()));
    return 1 - other[pixel] / patient[pixel];
  };
  const Eigen::Vector3d in_arch = mean_aorta().centreline_room_mm.col(21);

  EXPECT_GT(darker(expected({.contrast_age_s = 1.2}), in_arch), 0.15);
  EXPECT_EQ(darker(expected({.contrast_age_s = 0.01}), in_arch), 0) << "the agent has not come so far yet";
  EXPECT_LT(darker(expected({.contrast_age_s = 20}), in_arch), 0.01) << "washed out";
  EXPECT_GT(darker(expected({.second_wire = true}), settings.second_wire[0].centreline_room_mm.col(150)),
            0.1);
  EXPECT_GT(darker(expected({.ecg_leads = true}), settings.ecg_leads[0].centreline_room_mm.col(3)), 0.2);
  EXPECT_EQ(expected({}), patient) << "and it all goes away again";
}

TEST(Chest, HeartBeatAndBreathingMoveTheirPartsOnlyAndComeBack) {
  RadiographSettings settings;
  settings.motion.heart_phases = 2;
  settings.motion.breathing_phases = 2;
  CameraCalibration view = paper_view(0);
  // Every fourth pixel will do.
  view.width = 100;
  view.height = 150;
  view.fx = view.fy = 500;
  view.cx = 50;
  view.cy = 75;
  Radiograph radiograph(view, chest(), settings, 1);
  const auto expected = [&](double time_s, const ClutterStates& clutter) {
    RadiographScene scene;
    scene.time_s = time_s;
    scene.clutter = clutter;
    const auto quanta = radiograph.expected_quanta(scene);
    return std::vector<float>(quanta.begin(), quanta.end());
  };
  const std::vector<float> rest = expected(0, {});
  const auto max_change = [&](const std::vector<float>& other, int top, int bottom) {
    double greatest = 0;
    for (auto i = static_cast<std::size_t>(top * 100); i < static_cast<std::size_t>(bottom * 100); ++i) {
      greatest = std::max<double>(greatest, std::abs(other[i] / rest[i] - 1));
    }
    return greatest;
  };
  const std::vector<float> systole = expected(0.35 * settings.motion.heart_period_s, {.heart_beat = true});
  const std::vector<float> inspired = expected(settings.motion.breathing_period_s / 2, {.breathing = true});

  // z = -20 of the arch projects to row 75 - (95 - 20) * 500 / 1200, about 44; the heart lies below.
  EXPECT_GT(max_change(systole, 60, 95), 0.05);
  EXPECT_LT(max_change(systole, 0, 40), 0.001);
  EXPECT_GT(max_change(inspired, 70, 110), 0.15);
  EXPECT_EQ(expected(0, {.heart_beat = true, .breathing = true}), rest);
  EXPECT_EQ(expected(settings.motion.breathing_period_s / 2, {}), rest) << "still unless asked for";

  const Eigen::Vector3d below_dome(0, -50, -160);
  EXPECT_NEAR(
      radiograph.tissue_displacement(below_dome, settings.motion.breathing_period_s / 2, {.breathing = true})
          .z(),
      -settings.motion.diaphragm_travel_mm, 0.5);
  EXPECT_LT(
      radiograph
          .tissue_displacement({-15, 50, -100}, settings.motion.breathing_period_s / 2, {.breathing = true})
          .norm(),
      0.1)
      << "the spine stays";
}

TEST(CArm, AnglesPutTheCameraWhereTheyAreNamedAfter) {
  const Eigen::Vector3d target(10, 20, -30);
  const auto centre = [&](double lao, double cranial) -> Eigen::Vector3d {
    return c_arm_view("A", {lao, cranial}, target).T_camera_world.inverse().translation() - target;
  };
  EXPECT_TRUE(centre(0, 0).isApprox(Eigen::Vector3d(0, -1200, 0), 1e-9)) << "in front";
  EXPECT_TRUE(centre(90, 0).isApprox(Eigen::Vector3d(1200, 0, 0), 1e-9)) << "left";
  EXPECT_NEAR(centre(0, 30).z(), 600, 1e-9) << "toward the head";
  for (const double lao : {-70.0, 0.0, 35.0}) {
    const CameraCalibration view = c_arm_view("A", {lao, 12}, target);
    EXPECT_NEAR(view.T_camera_world.linear().determinant(), 1, 1e-12);
    const Camera camera(view);
    EXPECT_TRUE(camera.project(target)->p_image_px.isApprox(Eigen::Vector2d(200, 300), 1e-9));
    EXPECT_LT(camera.project(target + Eigen::Vector3d(0, 0, 50))->p_image_px.y(), 300) << "the head is up";
  }
  const Camera front(c_arm_view("A", {0, 0}, target));
  EXPECT_GT(front.project(target + Eigen::Vector3d(50, 0, 0))->p_image_px.x(), 200)
      << "the patient's left is right";
}

}  // namespace
}  // namespace tubed
