// What an instrument's tip is like while nothing bends it: as configured, or as coils and images have it.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "daemon/estimator/coils/coil_observation.hpp"
#include "daemon/estimator/estimator.hpp"
#include "daemon/estimator/tip/hook_search.hpp"
#include "daemon/estimator/tip/rest_hook.hpp"

namespace tubed {

/// What speaks against the tip of a shape.
enum class TipDoubt {
  kNone,
  kNotLooked,     ///< a hook is configured, and no image has been asked for its roll yet
  kOneView,       ///< a hook that no coil lies in, seen from one side: its mirror image is as likely
  kUndecided,     ///< straight or a hook, their tips are apart, and neither is clearly the likelier
  kStraightened,  ///< a hook is configured, and the tip is found far less bent than that
  kBentFurther,   ///< a hook is configured, and the tip is found far more bent than that
  kNoSuchHook,    ///< a hook is configured, and a straight tip explains coils and images better
  kNotStraight,   ///< a straight tip is configured, and a hook explains coils and images better
  kTakenStraight  ///< a hook is configured, and who estimates knows of straight tips alone
};

/// Is it that two shapes are about as likely (AMBIGUOUS), and not that one is contradicted or nobody has
/// looked (TIP_NOT_SEEN)?
inline bool is_ambiguous(TipDoubt doubt) {
  return doubt == TipDoubt::kOneView || doubt == TipDoubt::kUndecided;
}

/// Asks HookSearch now and then, remembers by how much a hook was the better explanation, and says which rest
/// shape the shapes of this instrument are solved with. Evidence of one image repeats in the next one: gains
/// are averaged, never added up, and no hook is taken for what one round alone says. Called by the optimizer
/// thread; memory is taken in the constructor.
class TipShape {
 public:
  TipShape(const EstimatorSettings& settings, const InstrumentDescription& instrument,
           const RoomDescription& room);
  TipShape(const TipShape&) = delete;
  TipShape& operator=(const TipShape&) = delete;

  void reset();

  /// At an image's instant, after its shape: asks if it is time to. True when rest() has become another one:
  /// what a shape was led to before was wrong.
  bool ask(const Observation& observation, const CoilObservations& coils);

  /// The hook that bending is measured from, with the plane it was last found in; nullptr: a straight tip.
  [[nodiscard]] RestHook* rest() { return active_ ? &hooks_[*active_] : nullptr; }
  [[nodiscard]] const RestHook* rest() const { return active_ ? &hooks_[*active_] : nullptr; }

  /// Does a used coil lie in the hook, so that its side is known?
  [[nodiscard]] bool is_held(const CoilObservations& coils) const;

  [[nodiscard]] TipDoubt doubt(const CoilObservations& coils) const;

  /// Standard deviation an axis, mm, of a point at s_mm from the tip that comes of not knowing exactly how
  /// the hook in use is made; 0 where a coil holds it, and behind it.
  [[nodiscard]] double sigma_of_making_mm(double s_mm, const CoilObservations& coils) const;

  /// The same of a tip that nobody has described, which may bend otherwise beyond the first coil than it is
  /// taken to; 0 behind that. Where an image shows the point it holds along unseen_directions() alone.
  [[nodiscard]] double sigma_of_unknown_tip_mm(double s_mm, const CoilObservations& coils) const;

  /// Projects onto what the views that showed the tip leave open: the newest one's axis, or nothing where it
  /// was seen from two sides. 3 x 3, world.
  [[nodiscard]] Eigen::Matrix3d unseen_directions() const;

  /// The shape that was found with rest(), 3 x coefficients: how far its hook is open is kept.
  void note_shape(const Eigen::Matrix3Xd& C);

  /// The view with this index showed the tip at that instant, looking along `sight_world` (unit).
  void note_view(std::size_t view, MonotonicTime instant, const Eigen::Vector3d& sight_world);

  /// Mean gain (chi^2) of the likeliest hook over a straight tip.
  [[nodiscard]] double gain() const;

 private:
  /// What asking has brought for one hook.
  struct Record {
    double mean_gain = 0;
    double mean_apart_mm = 0;        ///< its tip from that of the straight shape
    int asked = 0;                   ///< rounds of all starts
    double gain = 0;                 ///< what the newest rounds say together
    double best_gain = 0;            ///< of this round
    double best_gain_of_coils = 0;   ///< the same without images
    std::array<double, 2> before{};  ///< best_gain of the two rounds before, newest first
    double best_apart_mm = 0;        ///< of this round's best
    int best_start = 0;
    Eigen::Vector3d best_binormal = Eigen::Vector3d::UnitZ();

    void remember_round();
  };

  [[nodiscard]] bool is_due(MonotonicTime instant) const;
  [[nodiscard]] std::size_t starts_now(MonotonicTime instant) const;
  void try_start(std::size_t which, int start, const Observation& observation);
  void ask_again_if_by_far(std::size_t which, const Observation& observation);
  bool decide();
  [[nodiscard]] std::optional<std::size_t> likeliest() const;
  [[nodiscard]] bool is_undecided(const CoilObservations& coils) const;
  [[nodiscard]] double unknown_curvature_per_mm() const;
  [[nodiscard]] bool is_in_first_round(const CoilObservations& coils) const;
  [[nodiscard]] bool is_seen_from_two_sides() const;

  RestShape configured_;
  std::vector<RestHook> hooks_;  ///< those that are tried; of a configured one that alone
  HookSearch search_;
  std::vector<Record> records_;
  std::optional<std::size_t> active_;
  double opening_ = 1;          ///< of the newest shape's hook: its curvature, as made 1
  std::size_t next_start_ = 0;  ///< of this round, over all hooks; 0: none has begun
  MonotonicTime asked_{};       ///< beginning of the newest round
  MonotonicTime image_{};       ///< the newest instant of one
  MonotonicTime newest_{};
  std::array<MonotonicTime, kMaxCameras> tip_seen_{};
  std::array<Eigen::Vector3d, kMaxCameras> sight_world_{};  ///< the view's axis
};

/// What to do about it, into `words`, zero-terminated and cut to their size.
void write_tip_doubt(TipDoubt doubt, const InstrumentDescription& instrument, std::span<char> words);

}  // namespace tubed
