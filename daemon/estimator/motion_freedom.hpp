// How free a tube is to move sideways, learnt from how far its measurements pull.
#pragma once

namespace tubed {

/// Multiplies the variance of the sideways motion (TubeMotion::Freedom): as free as the measurements say.
/// chi^2 of how far they pull, a degree of freedom, should be 1. A jerk frees it for one measurement. Copied
/// with the state; never allocates.
///
/// `lasting_share` is LastingCoilErrors::share(). Where coils err by noise, a tube held firmer averages more
/// of it. Where their errors stay there is nothing to average, and what they do from place to place would be
/// held instead.
class MotionFreedom {
 public:
  static constexpr double kFreedomOfAJerk = 20;  ///< factor on the variance of the sideways motion

  /// As it is learnt.
  [[nodiscard]] double learnt() const { return learnt_; }

  /// What the measurement with this CoilInnovations::surprise() needs: the learnt one, more in a jerk. How
  /// surprising a measurement usually is depends on the tracker and on the motion, so that only a mean of
  /// earlier ones is a measure.
  double needed_for(double surprise);

  /// That was what the newest EM measurement was taken with.
  void remember_used(double freedom) { last_ = freedom; }

  /// An update pulled by this chi^2, `interval_s` after the one before; expected was that much.
  void adapt(double pulled, double expected, double interval_s, double lasting_share);

  /// Factor on what is published of the covariance, so that sigma does not say more than it has to while
  /// motion is calm.
  [[nodiscard]] double variance_factor() const;

  /// As at a beginning; how surprising measurements usually are stays.
  void begin() { learnt_ = last_ = 1; }
  void forget_surprises() { usual_ = UsualSurprise{}; }
  void keep_surprises_of(const MotionFreedom& other) { usual_ = other.usual_; }

  /// The sideways factor of a learnt one, and the least that a stretch may drift, of its usual variance.
  [[nodiscard]] static double sideways(double learnt, double lasting_share);
  [[nodiscard]] static double min_drift(double lasting_share);

 private:
  struct UsualSurprise {
    double mean = 1;  ///< geometric, of the newest
    int count = 0;    ///< that it is the mean of
  };

  double learnt_ = 1;
  double last_ = 1;
  UsualSurprise usual_;
};

}  // namespace tubed
