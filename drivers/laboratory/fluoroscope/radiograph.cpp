#include "drivers/laboratory/fluoroscope/radiograph.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "drivers/laboratory/fluoroscope/body_motion.hpp"
#include "drivers/laboratory/fluoroscope/check_settings.hpp"
#include "drivers/laboratory/fluoroscope/console.hpp"
#include "drivers/laboratory/fluoroscope/contrast_agent.hpp"
#include "drivers/laboratory/fluoroscope/counted_noise.hpp"
#include "drivers/laboratory/fluoroscope/exposure.hpp"
#include "drivers/laboratory/fluoroscope/pixel_kernels.hpp"
#include "drivers/laboratory/fluoroscope/pixel_rays.hpp"
#include "drivers/laboratory/fluoroscope/projected_body.hpp"
#include "drivers/laboratory/fluoroscope/rod_shadow.hpp"
#include "idl/geometry/precondition.hpp"

namespace tubed {

namespace {

constexpr std::uint64_t kQuantumNoise = 1;
constexpr std::uint64_t kElectronicNoise = 2;

/// Tells two views of one seed apart: FNV-1a of the camera's name.
std::int64_t seed_of_view(std::int64_t seed, const std::string& camera) {
  std::uint64_t hash = 0xCBF29CE484222325;
  for (const char letter : camera) {
    hash = (hash ^ static_cast<unsigned char>(letter)) * 0x100000001B3;
  }
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(seed) ^ hash);
}

/// How much of the beam the collimator's rounded window lets through, a pixel.
std::vector<float> collimator_window(const CollimatorSettings& blades, int width, int height) {
  const Eigen::Array2d centre((blades.left_px + width - 1 - blades.right_px) / 2,
                              (blades.top_px + height - 1 - blades.bottom_px) / 2);
  const Eigen::Array2d half((width - blades.left_px - blades.right_px) / 2,
                            (height - blades.top_px - blades.bottom_px) / 2);
  std::vector<float> window;
  window.reserve(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      // Signed distance to a rounded rectangle; a penumbra of some pixels.
      const Eigen::Array2d beyond = (Eigen::Array2d(x, y) - centre).abs() - half + blades.corner_px;
      const double distance =
          beyond.max(0).matrix().norm() + std::min(beyond.maxCoeff(), 0.0) - blades.corner_px;
      constexpr double kPenumbra_px = 1.5;
      const double open = 0.5 * std::erfc(distance / kPenumbra_px);
      window.push_back(static_cast<float>(blades.transmission + (1 - blades.transmission) * open));
    }
  }
  return window;
}

void multiply(std::span<const float> factor, std::span<float> image) {
  for (std::size_t i = 0; i < image.size(); ++i) {
    image[i] *= factor[i];
  }
}

}  // namespace

class Radiograph::Implementation {
 public:
  Implementation(const CameraCalibration& camera, const AttenuationVolume& volume,
                 const RadiographSettings& settings, std::int64_t seed)
      : settings_(checked(settings)),
        seed_(seed_of_view(seed, camera.name)),
        rays_(camera),
        motion_(settings.motion),
        body_(rays_, volume, settings.motion),
        exposure_(settled_exposure(body_.at_rest(), rays_.width(), rays_.height(), settings.detector,
                                   settings.display)),
        shadow_(rays_),
        source_blur_(rays_.width(), rays_.height(), settings.detector.source_blur_px),
        detector_blur_(rays_.width(), rays_.height(), settings.detector.detector_blur_px),
        console_(settings.console, rays_.width(), rays_.height()),
        collimator_(collimator_window(settings.collimator, rays_.width(), rays_.height())),
        lumen_arc_mm_(arc_lengths_mm(settings.lumen.centreline_room_mm)),
        agent_per_mm_(lumen_arc_mm_.size()),
        rest_transmission_(rays_.size()),
        clutter_transmission_(rays_.size(), 1.0F),
        picture_(rays_.size()),
        deviates_(rays_.size()),
        previous_(rays_.size()) {
    transmissions(body_.at_rest(), rest_transmission_);
  }

  RadiographOutcome render(const RadiographScene& scene, std::span<std::uint8_t> pixels) {
    require(pixels.size() == bytes_per_image(),
            "radiograph: the pixel buffer has another size than the image");
    if (!scene.fluoroscopy_on) {
      fade();
      return RadiographOutcome::kNoRadiation;
    }
    expose(scene);
    source_blur_.apply(picture_);
    console_.shade(picture_);  // a grid stands at the detector
    detect(scene.exposure);
    show(pixels);
    burn_in(scene, pixels);
    return RadiographOutcome::kExposed;
  }

  /// Expected quanta of `scene` into picture_.
  void expose(const RadiographScene& scene) {
    const Posture posture = motion_.posture(scene.time_s, scene.clutter);
    if (posture.systole > 0 || posture.inspiration > 0) {
      body_.at(posture, deviates_);
      transmissions(deviates_, picture_);
    } else {
      std::copy(rest_transmission_.begin(), rest_transmission_.end(), picture_.begin());
    }
    place_clutter(scene.clutter);
    if (scene.clutter.second_wire || scene.clutter.ecg_leads || scene.clutter.surgery) {
      multiply(clutter_transmission_, picture_);
    }
    add_agent(scene.clutter.contrast_age_s);
    for (const RadiographRod& catheter : scene.catheters) {
      shadow_.add(catheter);
    }
    shadow_.apply(picture_);
    for (std::size_t i = 0; i < picture_.size(); ++i) {
      picture_[i] = picture_[i] * exposure_.open_beam_quanta + exposure_.scatter_quanta[i];
    }
    if (scene.clutter.collimator) {
      multiply(collimator_, picture_);
    }
  }

  [[nodiscard]] std::size_t bytes_per_image() const {
    return rays_.size() * (settings_.display.bits == 8 ? 1 : 2);
  }
  [[nodiscard]] const BodyMotion& motion() const { return motion_; }
  [[nodiscard]] std::span<const float> picture() const { return picture_; }

 private:
  void place_clutter(const ClutterStates& clutter) {
    if (clutter.second_wire == placed_wire_ && clutter.ecg_leads == placed_leads_ &&
        clutter.surgery == placed_surgery_) {
      return;
    }
    placed_surgery_ = clutter.surgery;
    placed_wire_ = clutter.second_wire;
    placed_leads_ = clutter.ecg_leads;
    if (placed_wire_) {
      for (const RadiographRod& rod : settings_.second_wire) shadow_.add(rod);
    }
    if (placed_leads_) {
      for (const RadiographRod& rod : settings_.ecg_leads) shadow_.add(rod);
    }
    if (placed_surgery_) {
      for (const RadiographRod& rod : settings_.surgery) shadow_.add(rod);
    }
    std::fill(clutter_transmission_.begin(), clutter_transmission_.end(), 1.0F);
    shadow_.apply(clutter_transmission_);
  }

  void add_agent(double age_s) {
    if (age_s < 0 || lumen_arc_mm_.size() == 0) {
      return;
    }
    for (Eigen::Index i = 0; i < lumen_arc_mm_.size(); ++i) {
      const double part = agent_concentration(settings_.lumen, lumen_arc_mm_[i], age_s);
      // What cannot be seen need not be drawn.
      agent_per_mm_[i] = part < 0.01 ? 0.0 : part * settings_.lumen.attenuation_per_mm;
    }
    shadow_.add_soft(settings_.lumen.centreline_room_mm, settings_.lumen.radius_mm, agent_per_mm_);
  }

  /// From expected quanta to what the detector reads, in place.
  void detect(std::int64_t exposure) {
    const auto index = static_cast<std::uint64_t>(exposure);
    if (std::isfinite(settings_.detector.quanta_per_pixel)) {
      normal_.draw(noise_key(seed_, kQuantumNoise, index), deviates_);
      count_quanta(deviates_, picture_);
    }
    detector_blur_.apply(picture_);
    const float stays = has_previous_ ? static_cast<float>(settings_.detector.lag) : 0.0F;
    if (settings_.detector.lag > 0) {
      for (std::size_t i = 0; i < picture_.size(); ++i) {
        picture_[i] += stays * (previous_[i] - picture_[i]);
      }
      std::copy(picture_.begin(), picture_.end(), previous_.begin());
      has_previous_ = true;
    }
    const auto sigma = static_cast<float>(settings_.detector.electronic_noise);
    if (sigma > 0) {
      normal_.draw(noise_key(seed_, kElectronicNoise, index), deviates_);
      for (std::size_t i = 0; i < picture_.size(); ++i) {
        picture_[i] += sigma * deviates_[i];
      }
    }
  }

  /// A read-out without radiation: what stays of the last picture.
  void fade() {
    for (float& quanta : previous_) {
      quanta *= static_cast<float>(settings_.detector.lag);
    }
  }

  void show(std::span<std::uint8_t> pixels) {
    if (settings_.display.readout == DetectorReadout::kIntensity) {
      constexpr float kSaturation = 8;  // times the median of the patient
      to_grey(0, kSaturation * static_cast<float>(settings_.detector.quanta_per_pixel), pixels);
      return;
    }
    const float scale = 1 / exposure_.open_beam_quanta;
    constexpr float kMin_quanta = 0.5F;
    for (float& quanta : picture_) {
      quanta = std::max(quanta, kMin_quanta) * scale;
    }
    negative_logs(picture_);
    for (std::size_t i = 0; i < picture_.size(); ++i) {
      picture_[i] -= exposure_.large_scale_log[i];
    }
    console_.process(exposure_.dark, exposure_.bright, picture_);
    to_grey(exposure_.dark, exposure_.bright, pixels);
  }

  void burn_in(const RadiographScene& scene, std::span<std::uint8_t> pixels) const {
    if (settings_.display.bits == 8) {
      console_.burn_in<std::uint8_t>(scene.time_s, scene.exposure, 255, pixels);
    } else {
      console_.burn_in<std::uint16_t>(
          scene.time_s, scene.exposure, static_cast<std::uint16_t>((1 << settings_.display.bits) - 1),
          {reinterpret_cast<std::uint16_t*>(pixels.data()), pixels.size() / sizeof(std::uint16_t)});
    }
  }

  /// picture_ from `dark` to `bright` as words of the detector.
  void to_grey(float dark, float bright, std::span<std::uint8_t> pixels) const {
    if (settings_.display.bits == 8) {
      to_grey8(picture_, dark, bright, pixels);
    } else {
      to_grey16(picture_, dark, bright, static_cast<float>((1 << settings_.display.bits) - 1), pixels);
    }
  }

  RadiographSettings settings_;
  std::int64_t seed_;
  PixelRays rays_;
  BodyMotion motion_;
  ProjectedBody body_;
  Exposure exposure_;
  RodShadow shadow_;
  PointSpread source_blur_;
  PointSpread detector_blur_;
  Console console_;
  NormalTable normal_;
  std::vector<float> collimator_;
  Eigen::VectorXd lumen_arc_mm_;
  Eigen::VectorXd agent_per_mm_;
  std::vector<float> rest_transmission_;
  std::vector<float> clutter_transmission_;
  bool placed_wire_ = false;
  bool placed_leads_ = false;
  bool placed_surgery_ = false;
  std::vector<float> picture_;   ///< the exposure being drawn: transmission, quanta, then -log
  std::vector<float> deviates_;  ///< also the line integrals of a moving patient
  std::vector<float> previous_;  ///< detector reading that lags behind
  bool has_previous_ = false;
};

Radiograph::Radiograph(const CameraCalibration& camera, const AttenuationVolume& volume,
                       const RadiographSettings& settings, std::int64_t seed)
    : implementation_(std::make_unique<Implementation>(camera, volume, settings, seed)) {}

Radiograph::~Radiograph() = default;
Radiograph::Radiograph(Radiograph&&) noexcept = default;
Radiograph& Radiograph::operator=(Radiograph&&) noexcept = default;

RadiographOutcome Radiograph::render(const RadiographScene& scene, std::span<std::uint8_t> pixels) {
  return implementation_->render(scene, pixels);
}

std::size_t Radiograph::bytes_per_image() const { return implementation_->bytes_per_image(); }

Eigen::Vector3d Radiograph::tissue_displacement(const Eigen::Vector3d& p_room_mm, double time_s,
                                                const ClutterStates& clutter) const {
  const BodyMotion& motion = implementation_->motion();
  return motion.displacement(p_room_mm.cast<float>(), motion.posture(time_s, clutter)).cast<double>();
}

std::span<const float> Radiograph::expected_quanta(const RadiographScene& scene) {
  implementation_->expose(scene);
  return implementation_->picture();
}

}  // namespace tubed
