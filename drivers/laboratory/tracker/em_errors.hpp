// What a simulated tracker gets wrong: noise, a warped field, metal, and coils that fall silent or lie.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "drivers/interface/em_source.hpp"
#include "drivers/laboratory/tracker/smooth_field.hpp"

namespace tubed {

/// How often the noise of Eq. (19)-(20) is drawn.
enum class NoiseDraw {
  kEachMeasurement,  ///< as in the paper
  kOncePerCoil,      ///< the same error for ever: a coil that is mounted or calibrated wrong
};

enum class EmEventKind { kDropOut, kOutlier, kOutOfVolume, kStuck };

/// Something that befalls a coil for a while.
struct EmEvent {
  EmEventKind kind = EmEventKind::kDropOut;
  int sensor = 0;  ///< 0: all
  double from_s = 0;
  double until_s = 0;
  double size_mm = 0;  ///< of an outlier, in a direction of its own in each measurement; reported OK
};

/// A metal object that comes near for a while and bends the field around it: the displacement points away
/// from it and falls with the third power of the distance, as a dipole's field does.
struct MetalObject {
  double max_mm = 0;     ///< displacement of a coil that touches it
  double max_rad = 0;    ///< turn of its tangent there
  double reach_mm = 80;  ///< half of the displacement is left at this distance
  Eigen::Vector3d start_em_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d velocity_em_mm_s = Eigen::Vector3d::Zero();
  double from_s = 0;
  double until_s = 0;
};

struct EmErrorSettings {
  double lambda_mm = 0;  ///< Eq. (19)
  double psi_rad = 0;    ///< Eq. (20)
  NoiseDraw draw = NoiseDraw::kEachMeasurement;
  double warp_mm = 0;         ///< greatest displacement of the static field in the working volume
  double warp_rad = 0;        ///< greatest turn of a tangent there
  double jitter_mm = 0;       ///< root mean square of the displacement drawn in each measurement, Gaussian
  double jitter_rad = 0;      ///< root mean square of the tangent's turn, likewise
  double drop_out_share = 0;  ///< of single samples that are missing
  std::vector<MetalObject> metal;
  std::vector<EmEvent> events;
  /// Coils outside it are OUT_OF_VOLUME. Tracker's frame, mm.
  Eigen::AlignedBox3d volume_em_mm{Eigen::Vector3d::Constant(-1e9), Eigen::Vector3d::Constant(1e9)};
};

/// Turns true poses into measured ones. A pure function of settings, seed, sensor, measurement number and
/// time. Immutable, callable from any thread, measure() never allocates.
class EmErrors {
 public:
  /// `working_volume_em_mm`: where the greatest warp is looked for.
  EmErrors(EmErrorSettings settings, std::int64_t seed, const Eigen::AlignedBox3d& working_volume_em_mm);

  /// Measurement number k of a coil, taken at `t_s`. Tracker's frame.
  [[nodiscard]] CoilSample measure(int sensor, std::int64_t k, double t_s, const Eigen::Vector3d& p_em_mm,
                                   const Eigen::Vector3d& tangent_em) const noexcept;

  /// Since when the coil repeats itself at `t_s`; nothing when it does not. The caller measures as of then.
  [[nodiscard]] std::optional<double> stuck_since_s(int sensor, double t_s) const noexcept;

  /// The static field's displacement at a point, and the rotation vector of tangents there.
  [[nodiscard]] Eigen::Vector3d warp_mm(const Eigen::Vector3d& p_em_mm) const noexcept;
  [[nodiscard]] Eigen::Vector3d warp_rad(const Eigen::Vector3d& p_em_mm) const noexcept;

 private:
  EmErrorSettings settings_;
  std::int64_t seed_;
  SmoothField displacement_;
  SmoothField turn_;
};

}  // namespace tubed
