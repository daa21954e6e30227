#include "drivers/laboratory/fluoroscope/ball_radiograph.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstring>

#include "drivers/laboratory/fluoroscope/counted_noise.hpp"
#include "drivers/laboratory/fluoroscope/pixel_kernels.hpp"
#include "drivers/laboratory/fluoroscope/pixel_rays.hpp"

namespace tubed {

namespace {

constexpr std::uint64_t kBallQuanta = 11;
constexpr std::uint64_t kBallElectronics = 12;
constexpr int kRaysPerSide = 9;

/// A ball in the camera frame.
struct CameraBall {
  Eigen::Vector3d p_camera_mm;
  double radius_mm;

  /// Length of the part of the ray through (slope, 1) that lies in the ball.
  [[nodiscard]] double chord_mm(const Eigen::Vector2d& slope) const {
    const Eigen::Vector3d direction = slope.homogeneous().normalized();
    const double distance2 = p_camera_mm.cross(direction).squaredNorm();
    return 2 * std::sqrt(std::max(0.0, radius_mm * radius_mm - distance2));
  }
};

/// Pixels that a ball may shade: first and last column and row.
struct PixelBox {
  int left, right, top, bottom;
};

/// Twice the ball's radius around its centre, so that lens distortion and obliquity have room.
std::optional<PixelBox> shaded_pixels(const Camera& camera, const Eigen::Vector3d& p_world_mm,
                                      double radius_mm) {
  const std::optional<Projection> centre = camera.project(p_world_mm);
  if (!centre || centre->depth_mm <= 2 * radius_mm) return std::nullopt;
  const double reach_px = 2 * radius_mm * centre->J_image_world.norm() + 3;
  const auto least = [&](double at) { return std::max(0, static_cast<int>(std::floor(at - reach_px))); };
  const auto most = [&](double at, int size) {
    return std::min(size - 1, static_cast<int>(std::ceil(at + reach_px)));
  };
  const Eigen::Vector2d& at = centre->p_image_px;
  if (!camera.contains(at, -reach_px)) return std::nullopt;
  return PixelBox{least(at.x()), most(at.x(), camera.calibration().width), least(at.y()),
                  most(at.y(), camera.calibration().height)};
}

/// Share of a pixel's rays that the ball lets through.
double transmission_of(const PixelRays& rays, std::size_t pixel, const CameraBall& ball,
                       double attenuation_per_mm) {
  double sum = 0;
  for (int row = 0; row < kRaysPerSide; ++row) {
    for (int column = 0; column < kRaysPerSide; ++column) {
      const Eigen::Vector2d offset_px((column + 0.5) / kRaysPerSide - 0.5, (row + 0.5) / kRaysPerSide - 0.5);
      sum += std::exp(-attenuation_per_mm * ball.chord_mm(rays.slope_camera(pixel, offset_px)));
    }
  }
  return sum / (kRaysPerSide * kRaysPerSide);
}

void shade(const PixelRays& rays, const BallScene& scene, Eigen::Index index, std::vector<float>& picture) {
  const Eigen::Vector3d p_world_mm = scene.balls_world_mm.col(index);
  const auto box = shaded_pixels(rays.camera(), p_world_mm, scene.radius_mm[index]);
  if (!box) return;
  const CameraBall ball{rays.camera().calibration().T_camera_world * p_world_mm, scene.radius_mm[index]};
  for (int y = box->top; y <= box->bottom; ++y) {
    for (int x = box->left; x <= box->right; ++x) {
      const std::size_t pixel =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(rays.width()) + static_cast<std::size_t>(x);
      picture[pixel] *= static_cast<float>(transmission_of(rays, pixel, ball, scene.ball_attenuation_per_mm));
    }
  }
}

/// Transmission of the plastic.
std::vector<float> body_picture(const PixelRays& rays, double attenuation) {
  std::vector<float> picture;
  picture.reserve(rays.size());
  for (int y = 0; y < rays.height(); ++y) {
    for (int x = 0; x < rays.width(); ++x) {
      const double right = 2.0 * x / rays.width() - 1;
      const double down = 2.0 * y / rays.height() - 1;
      const double shape = 1 - 0.1 * (right * right + down * down) - 0.05 * right;
      picture.push_back(static_cast<float>(std::exp(-attenuation * shape)));
    }
  }
  return picture;
}

/// From transmissions to detected quanta; the beam without phantom has `open_quanta`.
void detect(const BallExposure& exposure, int width, int height, float open_quanta,
            std::vector<float>& picture) {
  const DetectorSettings& detector = exposure.detector;
  PointSpread(width, height, detector.source_blur_px).apply(picture);
  double mean = 0;
  for (const float value : picture) mean += value;
  mean /= static_cast<double>(picture.size());
  const auto scatter = static_cast<float>(detector.scatter_to_primary * mean);
  for (float& value : picture) value = (value + scatter) / (1 + scatter) * open_quanta;
  std::vector<float> deviates(picture.size());
  const NormalTable normal;
  if (std::isfinite(detector.quanta_per_pixel)) {
    normal.draw(noise_key(exposure.seed, kBallQuanta, 0), deviates);
    count_quanta(deviates, picture);
  }
  PointSpread(width, height, detector.detector_blur_px).apply(picture);
  normal.draw(noise_key(exposure.seed, kBallElectronics, 0), deviates);
  for (std::size_t i = 0; i < picture.size(); ++i) {
    picture[i] += static_cast<float>(detector.electronic_noise) * deviates[i];
  }
}

std::vector<std::uint8_t> grey_values(const std::vector<float>& picture, float open_quanta,
                                      const BallExposure& exposure) {
  const float full = exposure.bits == 8 ? 255 : 65535;
  const float scale = static_cast<float>(exposure.open_beam) * full / open_quanta;
  std::vector<std::uint8_t> pixels(picture.size() * (exposure.bits == 8 ? 1 : 2));
  for (std::size_t i = 0; i < picture.size(); ++i) {
    const float value = std::clamp(std::round(picture[i] * scale), 0.0F, full);
    const auto grey = static_cast<std::uint16_t>(exposure.inverted ? full - value : value);
    if (exposure.bits == 8) {
      pixels[i] = static_cast<std::uint8_t>(grey);
    } else {
      std::memcpy(&pixels[2 * i], &grey, 2);
    }
  }
  return pixels;
}

void mirror(int width, int height, std::vector<float>& picture) {
  for (int y = 0; y < height; ++y) {
    const auto row = picture.begin() + static_cast<std::ptrdiff_t>(y) * width;
    std::reverse(row, row + width);
  }
}

}  // namespace

std::vector<std::uint8_t> ball_radiograph(const CameraCalibration& camera, const BallScene& scene,
                                          const BallExposure& exposure) {
  const PixelRays rays(camera);
  std::vector<float> picture = body_picture(rays, scene.body_attenuation);
  for (Eigen::Index i = 0; i < scene.balls_world_mm.cols(); ++i) shade(rays, scene, i, picture);
  const double quanta = exposure.detector.quanta_per_pixel;
  const double of_body = std::exp(-scene.body_attenuation);
  const auto open_quanta = static_cast<float>((std::isfinite(quanta) ? quanta : 1e6) / of_body);
  detect(exposure, rays.width(), rays.height(), open_quanta, picture);
  if (camera.mirrored) mirror(rays.width(), rays.height(), picture);
  return grey_values(picture, open_quanta, exposure);
}

}  // namespace tubed
