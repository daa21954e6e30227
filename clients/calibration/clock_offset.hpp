// By how much images are stamped too late against the coils, from a tube that moves in view.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

namespace tubed {

/// One number that an image says, in a channel: the same place of the tube, across or along itself, over the
/// recording.
struct SeenNumber {
  double t_s = 0;           ///< the image's stamp
  std::size_t channel = 0;  ///< errors that last are those of a channel
  /// Seen less where coils have it, px, and where they have it in the image, if the image was taken at that
  /// time of the tracker's clock; nothing where no coil was measured then.
  struct Against {
    double residual_px = 0;
    Eigen::Vector2d p_image_px = Eigen::Vector2d::Zero();
    double speed_px_s = 0;  ///< of where coils have it, along what is seen, from the measurements used here
    double other_speed_px_s = 0;  ///< the same from measurements before and after these
  };
  std::function<std::optional<Against>(double t_s)> against;
};

/// What was found. `offset_s`: an image's exposure is its stamp less that.
struct ClockOffset {
  double offset_s = 0;
  double sigma_s = 0;        ///< by the jackknife over blocks
  double white_sigma_s = 0;  ///< if images' errors were independent
  int blocks = 0;
  std::size_t count = 0;      ///< numbers that took part
  double rms_px = 0;          ///< of what is left of them
  double motion_px_s = 0;     ///< RMS speed by which they say anything: of places that come back
  double peak_in_sigmas = 0;  ///< how much better than the best offset that is not its neighbour
  bool is_at_border = false;  ///< no offset within reach is the best
  struct Tried {
    double offset_s = 0;
    double rms_px = 0;          ///< of what is left
    double log_likelihood = 0;  ///< of the numbers, with the scales of all channels unknown
  };
  std::vector<Tried> curve;  ///< over all offsets that were tried
};

/// Where it is looked for.
struct ClockSearch {
  double around_s = 0;
  double reach_s = 0.5;  ///< to either side
};

/// Least squares of seen less measured places over the offset. What the registration, the camera, arc
/// lengths and the tracker's field are off by depends on where the tube is, and not on how fast: each channel
/// has a polynomial of second degree in the place and a slope in time for that, so that only motion which
/// comes back to where it was says anything. Speeds from the tracker are noisy, and their noise is that of
/// the residual where both come from the same measurements: the second speed is the instrument of the first
/// (Durbin, Rev. Inst. Int. Stat. 22, 1954), so that measurements may lie as they like about the exposures.
/// Errors of images last over many frames: sigma is the delete-one
/// jackknife over blocks of time of 2 s and more (Efron and Stein, Ann. Statist. 9, 1981), widened for few
/// blocks. Weights are Cauchy's.
///
/// Nothing with fewer than 40 numbers, or six blocks that have some.
std::optional<ClockOffset> find_clock_offset(const std::vector<SeenNumber>& numbers,
                                             const ClockSearch& search);

}  // namespace tubed
