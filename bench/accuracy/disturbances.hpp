// A sequence with something taken away or put wrong: how an estimator stands it is part of its accuracy.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <random>

#include "clients/evaluation/offline_reconstruction.hpp"

namespace tubed {

/// Which instants are judged.
using JudgedInstants = std::function<bool(const SequenceInstant&)>;

/// A unit vector, every direction as likely.
Eigen::Vector3d random_direction(std::mt19937_64& random);

/// Whether fluoroscopy is off at `t_s` when it is off for the last `off_s` of every `period_s`, counted from
/// `start_s`.
bool is_off(double t_s, double start_s, double off_s, double period_s);

/// The sequence with fluoroscopy off for the last `off_s` of every `period_s` from its first frame on.
Sequence with_fluoroscopy_off_for(Sequence sequence, double off_s, double period_s);

/// Each coil of each measurement missing with probability `share`, 0 .. 1; drawn by `seed`.
Sequence with_coils_dropped(Sequence sequence, double share, unsigned seed);

/// One coil of the tracker, 0 .. coil_count - 1 of the measurements, reported OK and wrong by `error_mm` in a
/// direction of the seed. Throws std::invalid_argument when no measurement has that coil.
Sequence with_coil_lying(Sequence sequence, int coil, double error_mm, unsigned seed);

/// The same for the last `wrong_s` of every `period_s` from the first measurement on, each time in a
/// direction of its own.
Sequence with_coil_erratic(Sequence sequence, int coil, double error_mm, double wrong_s, double period_s,
                           unsigned seed);

/// The same coil missing for the last `off_s` of every `period_s` from the first measurement on.
Sequence with_coil_missing(Sequence sequence, int coil, double off_s, double period_s);

/// Every `step`-th image (from the step-th on) replaced by the first one of the same camera: a catheter that
/// is not there any more, as a grabber with a stale buffer shows it. 0: none.
Sequence with_wrong_images(Sequence sequence, std::size_t step);

}  // namespace tubed
