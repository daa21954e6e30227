#include "clients/calibration/simulated_phantom.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <fstream>
#include <sstream>

#include "clients/calibration/configuration_fragment.hpp"
#include "drivers/png/png_file.hpp"
#include "idl/geometry/degree.hpp"

namespace tubed {

namespace {

constexpr double kDetectorBehind = 1.5;  // source to detector, of source to what is looked at

std::vector<std::uint8_t> pixels_at(const SimulatedCArm& simulated, const BallPhantom& phantom,
                                    std::size_t image) {
  BallScene scene;
  const auto count = static_cast<Eigen::Index>(phantom.balls.size());
  scene.balls_world_mm.resize(3, count);
  scene.radius_mm.resize(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    scene.balls_world_mm.col(i) = phantom.p_world_mm(static_cast<std::size_t>(i));
    scene.radius_mm[i] = phantom.balls[static_cast<std::size_t>(i)].diameter_mm / 2;
  }
  BallExposure exposure = simulated.exposure;
  exposure.seed += static_cast<std::int64_t>(1000 * image);
  return ball_radiograph(camera_at(simulated, image), scene, exposure);
}

ConfigurationFragment truth_of(const SimulatedCArm& simulated) {
  ConfigurationFragment truth;
  truth.found_by = "the simulation: the truth of its images, SIMULATED";
  truth.date = date_of_today();
  for (std::size_t i = 0; i < simulated.angles.size(); ++i) {
    const CameraCalibration camera = camera_at(simulated, i);
    const std::string table = "camera[image-" + std::to_string(i + 1) + "].";
    truth.values.push_back({table + "fx", camera.fx});
    truth.values.push_back({table + "fy", camera.fy});
    truth.values.push_back({table + "cx", camera.cx});
    truth.values.push_back({table + "cy", camera.cy});
    truth.values.push_back(
        {table + "distortion", std::vector<double>(camera.distortion.begin(), camera.distortion.end())});
    truth.values.push_back({table + "mirrored", camera.mirrored});
    truth.values.push_back({table + "T_camera_world", Eigen::Matrix4d(camera.T_camera_world.matrix())});
  }
  return truth;
}

Eigen::Vector3d place_before(const CameraCalibration& camera) {
  const auto place_mm = camera.looked_at_world_mm();
  if (!place_mm) {
    throw PhantomError(
        "camera \"" + camera.name +
        "\" does not look toward the world's origin: nobody knows where a phantom would stand");
  }
  return *place_mm;
}

/// The camera on an isocentric C-arm that stands at 0, 0 where the camera is, its isocentre what that looks
/// at.
CameraCalibration turned(const SimulatedCArm& simulated, std::size_t image) {
  CameraCalibration camera = *simulated.camera;
  CArm arm;
  arm.source_isocentre_mm = (camera.T_camera_world * place_before(camera)).z();
  arm.T_c_arm_world = pose_of(arm).inverse() * camera.T_camera_world;
  arm.primary_angle_deg = simulated.angles[image].primary_deg;
  arm.secondary_angle_deg = simulated.angles[image].secondary_deg;
  camera.T_camera_world = pose_of(arm);
  camera.name = "image-" + std::to_string(image + 1);
  camera.mirrored = camera.mirrored || simulated.mirrored;
  if (simulated.distortion != std::array<double, 5>{}) camera.distortion = simulated.distortion;
  return camera;
}

void write_text(const std::filesystem::path& file, const std::string& text) {
  std::ofstream out(file, std::ios::binary);
  out << text;
  out.close();
  if (!out) throw PhantomError(file.string() + ": cannot be written");
}

}  // namespace

SimulatedCArm usual_c_arm() {
  SimulatedCArm simulated;
  simulated.c_arm.source_detector_mm = 1200;
  simulated.c_arm.source_isocentre_mm = 785;
  simulated.c_arm.pixel_pitch_mm = 0.6;
  simulated.c_arm.T_c_arm_world.linear() =
      Eigen::AngleAxisd(0.12, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
  simulated.c_arm.T_c_arm_world.translation() = Eigen::Vector3d(6, -4, 9);
  simulated.angles = {{0, 0}, {30, 0}, {-30, 5}, {60, -10}, {-55, 0}, {10, 25}};
  simulated.cx = 257.3;
  simulated.cy = 253.9;
  constexpr double kQuanta = 1000;
  simulated.exposure.detector.quanta_per_pixel = kQuanta;
  return simulated;
}

SimulatedCArm c_arm_of(const CameraCalibration& camera) {
  SimulatedCArm simulated = usual_c_arm();
  simulated.camera = camera;
  simulated.width = camera.width;
  simulated.height = camera.height;
  simulated.angles = {{0, 0}, {30, 0}, {-30, 5}, {10, 25}};
  const double isocentre_mm = (camera.T_camera_world * place_before(camera)).z();
  simulated.c_arm.source_detector_mm = kDetectorBehind * isocentre_mm;
  simulated.c_arm.pixel_pitch_mm = simulated.c_arm.source_detector_mm / camera.fx;
  return simulated;
}

BallPhantom phantom_before(const CameraCalibration& camera) {
  BallPhantom phantom = helix_phantom();
  phantom.T_world_phantom.translation() = place_before(camera);
  return phantom;
}

CameraCalibration camera_at(const SimulatedCArm& simulated, std::size_t image) {
  if (simulated.camera) return turned(simulated, image);
  CArm arm = simulated.c_arm;
  arm.primary_angle_deg = simulated.angles[image].primary_deg;
  arm.secondary_angle_deg = simulated.angles[image].secondary_deg;
  CameraCalibration camera;
  camera.name = "image-" + std::to_string(image + 1);
  camera.width = simulated.width;
  camera.height = simulated.height;
  camera.cx = simulated.cx;
  camera.cy = simulated.cy;
  camera.distortion = simulated.distortion;
  camera.mirrored = simulated.mirrored;
  place(arm, camera);
  return camera;
}

CalibrationPicture picture_at(const SimulatedCArm& simulated, const BallPhantom& phantom, std::size_t image) {
  return calibration_picture("image-" + std::to_string(image + 1), simulated.width, simulated.height,
                             pixels_at(simulated, phantom, image));
}

std::vector<std::filesystem::path> write_simulated_phantom(const SimulatedCArm& simulated,
                                                           const BallPhantom& phantom,
                                                           const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw PhantomError(folder.string() + ": cannot be made: " + error.message());
  write_text(folder / "phantom.toml", to_toml(phantom));
  write_text(folder / "truth.toml", to_toml(truth_of(simulated)));
  std::ostringstream angles;
  std::vector<std::filesystem::path> files;
  for (std::size_t i = 0; i < simulated.angles.size(); ++i) {
    angles << (i == 0 ? "" : ":") << simulated.angles[i].primary_deg << ","
           << simulated.angles[i].secondary_deg;
    files.push_back(folder / ("image-" + std::to_string(i + 1) + ".png"));
    try {
      write_png(files.back(),
                {simulated.width, simulated.height,
                 simulated.exposure.bits == 8 ? PixelLayout::kGrey8 : PixelLayout::kGrey16,
                 pixels_at(simulated, phantom, i)},
                PngCompression::kFast);
    } catch (const PngError& problem) {
      throw PhantomError(files.back().string() + ": " + problem.what());
    }
  }
  write_text(folder / "angles.txt", angles.str() + "\n");
  return files;
}

}  // namespace tubed
