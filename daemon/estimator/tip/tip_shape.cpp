#include "daemon/estimator/tip/tip_shape.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "daemon/estimator/images/tube_views.hpp"
#include "idl/geometry/squared.hpp"

namespace tubed {

namespace {

// What is tried where the configuration says nothing, or that the tip is straight. The opening of a hook is
// free by a quarter, so that these two stand for those beside them.
constexpr std::array<RestArc, 2> kGenericHooks{{{14, 8}, {30, 16}}};
constexpr std::size_t kStartsEach = HookSearch::kStarts;
constexpr double kAskEvery_s = 0.5;
constexpr double kAskWhenKnown_s = 2;
constexpr double kMinAnswered = 0.25;  // of a round that an image answers
constexpr int kMinRounds = 3;
constexpr double kMemory = 0.15;  // share of the newest answer
// Gains, chi^2 of the straight tip less that of the hook, means over rounds: measured with bench/tips.
constexpr double kAdopted = 12;
constexpr double kAdoptedAtOnce = 25;  // of two rounds
// Without images, of the first round: later a tip may have been bent by hand.
constexpr double kToldByCoils = 15;
constexpr double kDropped = 4;  // an adopted hook: straight tips keep 2 to 3 where they were taken for one
constexpr double kClearlyStraight = 0;
constexpr double kUndecided = 8;
constexpr double kUndecidedFarCoil = 0;  // where the first coil would not see the smallest hook
constexpr double kSeesTheHook_mm = 3;    // from where it begins
constexpr double kSameTip_mm = 2;        // which of the two it is then makes no difference
constexpr double kNoSuchHook = -5;
constexpr double kStraightened = 0.55;   // of its curvature: nearly two of kSigmaOfOpening below as made
constexpr double kBentFurther = 1.6;     // of its curvature: more than two of kSigmaOfOpening above
constexpr double kNotStraight = 12;      // as for a hook that is adopted
constexpr double kSigmaOfMaking = 0.15;  // of its curvature
constexpr double kSigmaOfUnknownHook_per_mm = 0.04;  // of hooks of 6 to 30 mm
constexpr double kMayBeHook = 0.2;  // a tip that nobody has described, before it is looked at
constexpr double kSideKnownFor_s = 1.5;

// By how much an arc of that length moves its end, as long as it is flat.
double end_moved_mm(double curvature_per_mm, double length_mm) {
  return std::min(curvature_per_mm * squared(length_mm) / 2, length_mm);
}

double longest_mm(const std::vector<RestHook>& hooks) {
  double longest = 0;
  for (const RestHook& hook : hooks) longest = std::max(longest, hook.length_mm());
  return longest;
}

// Every start of every hook, and the best of each once more.
std::size_t solutions_of_a_round(const std::vector<RestHook>& hooks) {
  return (kStartsEach + 1) * hooks.size();
}

std::vector<RestHook> hooks_of(const UniformCubicBSpline& spline, const InstrumentDescription& instrument) {
  std::vector<RestHook> hooks;
  if (is_preshaped(instrument.rest_shape)) {
    hooks.emplace_back(spline, instrument.rest_curve());
    return hooks;
  }
  for (const RestArc& arc : kGenericHooks) {
    if (arc.length_mm < instrument.length_mm / 2) hooks.emplace_back(spline, RestCurve{{arc}});
  }
  return hooks;
}

}  // namespace

TipShape::TipShape(const EstimatorSettings& settings, const InstrumentDescription& instrument,
                   const RoomDescription& room)
    : configured_(instrument.rest_shape),
      hooks_(hooks_of(UniformCubicBSpline(settings.coefficient_count, instrument.length_mm), instrument)),
      search_(settings, instrument, room, longest_mm(hooks_)),
      records_(hooks_.size()) {
  sight_world_.fill(Eigen::Vector3d::Zero());
  reset();
}

void TipShape::reset() {
  std::fill(records_.begin(), records_.end(), Record{});
  active_.reset();
  next_start_ = 0;
  opening_ = 1;
  if (is_preshaped(configured_)) active_ = 0;
  asked_ = image_ = newest_ = MonotonicTime{};
  tip_seen_.fill(MonotonicTime{});
}

bool TipShape::is_due(MonotonicTime instant) const {
  const bool is_known = std::all_of(records_.begin(), records_.end(),
                                    [](const Record& record) { return record.asked >= kMinRounds; }) &&
                        (active_ ? records_[*active_].mean_gain > kAdopted : gain() < kClearlyStraight);
  return to_ns(asked_) == 0 || instant < asked_ ||
         seconds_between(asked_, instant) >= (is_known ? kAskWhenKnown_s : kAskEvery_s);
}

std::optional<std::size_t> TipShape::likeliest() const {
  std::optional<std::size_t> best;
  for (std::size_t i = 0; i < records_.size(); ++i) {
    if (records_[i].asked > 0 && (!best || records_[i].mean_gain > records_[*best].mean_gain)) best = i;
  }
  return best;
}

double TipShape::gain() const {
  const auto best = likeliest();
  return best ? records_[*best].mean_gain : 0;
}

// So many starts at this image that a round takes kAskEvery_s: a whole round at one image of many would keep
// the next one's shape waiting. Not fewer than a quarter: starts of one image have its noise in common, those
// of many images each their own, and the best of many that are independent is better than any hook is likely.
// Of the first round all at once: until it is over a hook is taken for a straight tip.
std::size_t TipShape::starts_now(MonotonicTime instant) const {
  const std::size_t all = solutions_of_a_round(hooks_);
  if (!likeliest()) return kStartsEach * hooks_.size();
  const double share = std::clamp(seconds_between(image_, instant) / kAskEvery_s, kMinAnswered, 1.0);
  return static_cast<std::size_t>(std::ceil(share * static_cast<double>(all)));
}

bool TipShape::ask(const Observation& observation, const CoilObservations& coils) {
  const std::size_t starts = starts_now(observation.instant);
  image_ = observation.instant;
  newest_ = std::max(newest_, image_);
  // A tip that no coil is near is followed through the image first: there is no shape to try hooks on.
  if (hooks_.empty() || !coils.hold_tip() || (next_start_ == 0 && !is_due(observation.instant))) {
    return false;
  }
  if (!search_.solve_straight(observation, coils)) {
    return false;
  }
  if (next_start_ == 0) asked_ = observation.instant;
  const std::size_t all = solutions_of_a_round(hooks_);
  for (std::size_t i = 0; i < starts && next_start_ < all; ++i, ++next_start_) {
    if (next_start_ < kStartsEach * hooks_.size()) {
      try_start(next_start_ / kStartsEach, static_cast<int>(next_start_ % kStartsEach), observation);
    } else {
      ask_again_if_by_far(next_start_ - kStartsEach * hooks_.size(), observation);
    }
  }
  if (next_start_ < all) {
    return false;
  }
  next_start_ = 0;
  return decide();
}

// Each start against the straight tip of the same image; of a round the best.
void TipShape::try_start(std::size_t which, int start, const Observation& observation) {
  RestHook& hook = hooks_[which];
  Record& record = records_[which];
  const Eigen::Vector3d plane = hook.binormal();
  const double gain = search_.straight_cost() - search_.solve_with(hook, start, observation);
  if (start == 0 || gain > record.best_gain) {
    record.best_gain = gain;
    record.best_start = start;
    record.best_apart_mm = search_.between_tips_mm();
    record.best_binormal = hook.binormal();
  }
  record.best_gain_of_coils =
      start == 0 ? search_.gain_of_coils() : std::max(record.best_gain_of_coils, search_.gain_of_coils());
  // That of a hook in use belongs to the shape, which knows what was before.
  hook.set_binormal(which == active_ && record.asked > 0 ? plane : record.best_binormal);
}

// What an image that another tube crosses says by far, the next one does not.
void TipShape::ask_again_if_by_far(std::size_t which, const Observation& observation) {
  RestHook& hook = hooks_[which];
  Record& record = records_[which];
  if (record.best_gain < kAdoptedAtOnce) return;
  const Eigen::Vector3d plane = hook.binormal();
  const double gain = search_.straight_cost() - search_.solve_with(hook, record.best_start, observation);
  record.best_gain = std::min(record.best_gain, gain);
  hook.set_binormal(plane);
}

// What one round alone says is left out: of two the lesser counts, then the middle one of three.
void TipShape::Record::remember_round() {
  ++asked;
  const auto [last, last_but_one] = before;
  if (asked == 1) {
    gain = best_gain;
  } else if (asked == 2) {
    gain = std::min(best_gain, last);
  } else {
    gain = std::max(std::min(best_gain, last),
                    std::min(std::max(best_gain, last), last_but_one));  // the middle one
  }
  const double share = std::max(kMemory, 1.0 / std::max(asked - 1, 1));
  mean_gain += (gain - mean_gain) * share;
  mean_apart_mm += (best_apart_mm - mean_apart_mm) * share;
  before = {best_gain, last};
}

bool TipShape::decide() {
  for (Record& record : records_) {
    record.remember_round();
  }
  const std::optional<std::size_t> best = likeliest();
  const Record& record = records_[*best];
  const std::optional<std::size_t> before = active_;
  const bool is_sure = record.asked >= kMinRounds;
  if (configured_ == RestShape::kUnknown) {
    if (active_ && is_sure && records_[*active_].mean_gain < kDropped) {
      active_.reset();
    } else if ((record.asked > 1 && record.gain > kAdoptedAtOnce) ||
               (record.asked == 1 && record.gain > kAdopted && record.best_gain_of_coils > kToldByCoils) ||
               (is_sure && record.mean_gain > kAdopted)) {
      active_ = best;
    }
  } else if (is_preshaped(configured_) && is_sure) {
    if (record.mean_gain < kNoSuchHook) active_.reset();
    if (record.mean_gain > kUndecided) active_ = 0;
  }
  return active_ != before;
}

bool TipShape::is_held(const CoilObservations& coils) const {
  return !active_ || hooks_[*active_].is_held_by(coils.first_used_mm());
}

void TipShape::note_shape(const Eigen::Matrix3Xd& C) {
  opening_ = active_ ? hooks_[*active_].fitted_binormal(C).norm() : 1;
}

void TipShape::note_view(std::size_t view, MonotonicTime instant, const Eigen::Vector3d& sight_world) {
  newest_ = std::max(newest_, instant);
  tip_seen_[view] = instant;
  sight_world_[view] = sight_world;
}

bool TipShape::is_seen_from_two_sides() const {
  for (std::size_t a = 0; a < tip_seen_.size(); ++a) {
    for (std::size_t b = 0; b < a; ++b) {
      const bool are_new = to_ns(tip_seen_[a]) != 0 && to_ns(tip_seen_[b]) != 0 &&
                           seconds_between(std::min(tip_seen_[a], tip_seen_[b]), newest_) < kSideKnownFor_s;
      if (are_new && are_two_sides(sight_world_[a], sight_world_[b])) return true;
    }
  }
  return false;
}

// It begins after the shape of the first image that shows the tip, which is as open.
bool TipShape::is_in_first_round(const CoilObservations& coils) const {
  const bool is_seen = std::ranges::any_of(tip_seen_, [](MonotonicTime seen) { return to_ns(seen) != 0; });
  return records_.front().asked == 0 && (next_start_ > 0 || (is_seen && coils.hold_tip()));
}

bool TipShape::is_undecided(const CoilObservations& coils) const {
  if (hooks_.empty()) return false;
  const bool is_blind = coils.first_used_mm() > hooks_.front().length_mm() - kSeesTheHook_mm;
  if (is_blind && is_in_first_round(coils)) return true;
  const double gain_asked = is_blind ? kUndecidedFarCoil : kUndecided;
  const int rounds_asked = is_blind ? 1 : 2;
  return std::any_of(records_.begin(), records_.end(), [=](const Record& record) {
    return record.asked >= rounds_asked && record.mean_gain > gain_asked &&
           record.mean_apart_mm > kSameTip_mm;
  });
}

double TipShape::sigma_of_making_mm(double s_mm, const CoilObservations& coils) const {
  if (!active_ || is_held(coils)) return 0;
  const RestHook& hook = hooks_[*active_];
  const double length_mm = std::max(0.0, hook.length_mm() - s_mm);
  const double curvature_per_mm = hook.curve().whole_turn_rad() / hook.length_mm();
  return kSigmaOfMaking * end_moved_mm(curvature_per_mm, length_mm);
}

double TipShape::sigma_of_unknown_tip_mm(double s_mm, const CoilObservations& coils) const {
  // Of a tip that no coil is near MirrorTest says how far it may be elsewhere.
  if (configured_ != RestShape::kUnknown || hooks_.empty() || !coils.hold_tip()) return 0;
  // Before the first coil, or as far as the smallest hook goes.
  const double loose_mm = std::min(coils.first_used_mm(), hooks_.front().length_mm()) - s_mm;
  return end_moved_mm(unknown_curvature_per_mm(), std::max(0.0, loose_mm));
}

Eigen::Matrix3d TipShape::unseen_directions() const {
  // What lines across the tube show of a tip that is taken for straight may be a hook from its side.
  if (active_ || gain() > kDropped) return Eigen::Matrix3d::Identity();
  if (is_seen_from_two_sides()) return Eigen::Matrix3d::Zero();
  const auto newest = std::ranges::max_element(tip_seen_);
  const Eigen::Vector3d& sight = sight_world_[static_cast<std::size_t>(newest - tip_seen_.begin())];
  return sight * sight.transpose();
}

// Root mean square of what is not known of the tip's curvature beyond the first coil: of a hook that is in
// use how it differs from its like, of a straight tip that it may be a hook.
double TipShape::unknown_curvature_per_mm() const {
  if (active_) return kSigmaOfUnknownHook_per_mm;
  const bool is_asked = std::ranges::all_of(records_, [](const Record& record) { return record.asked > 1; });
  const double p_hook = is_asked ? 1 / (1 + std::exp((kUndecided - gain()) / 2)) : kMayBeHook;
  return std::sqrt(p_hook) / kGenericHooks.front().radius_mm;
}

TipDoubt TipShape::doubt(const CoilObservations& coils) const {
  if (configured_ == RestShape::kStraight) {
    const bool is_hook = std::ranges::any_of(records_, [](const Record& record) {
      return record.asked >= kMinRounds && record.mean_gain > kNotStraight;
    });
    return is_hook ? TipDoubt::kNotStraight : TipDoubt::kNone;
  }
  if (!active_) {
    if (is_preshaped(configured_)) return TipDoubt::kNoSuchHook;
    return is_undecided(coils) ? TipDoubt::kUndecided : TipDoubt::kNone;
  }
  if (records_[*active_].asked == 0) return TipDoubt::kNotLooked;
  if (is_preshaped(configured_) && opening_ < kStraightened) {
    return TipDoubt::kStraightened;
  }
  if (is_preshaped(configured_) && opening_ > kBentFurther) {
    return TipDoubt::kBentFurther;
  }
  if (is_held(coils)) return TipDoubt::kNone;
  if (!is_seen_from_two_sides()) return TipDoubt::kOneView;
  // Two views tell to which side a hook turns, and not how far one bends that nobody has described.
  return is_preshaped(configured_) ? TipDoubt::kNone : TipDoubt::kUndecided;
}

void write_tip_doubt(TipDoubt doubt, const InstrumentDescription& instrument, std::span<char> words) {
  const char* text = "";
  switch (doubt) {
    case TipDoubt::kNone:
      break;
    case TipDoubt::kNotLooked:
      text = "the tip is a hook whose roll no image has shown yet: half a second of fluoroscopy shows it";
      break;
    case TipDoubt::kOneView:
      text =
          "the tip is a hook that no coil lies in: one view cannot tell to which side it turns; give a "
          "second view or mount a coil inside the hook";
      break;
    case TipDoubt::kUndecided:
      text = "the tip may be pre-shaped: say rest_shape in the configuration";
      break;
    case TipDoubt::kStraightened:
      text =
          "the tip is far straighter than rest_shape says: a wire or a wall straightens it, or it is another "
          "catheter";
      break;
    case TipDoubt::kBentFurther:
      text = "the tip is far more bent than rest_shape says: check rest_shape and which catheter is in use";
      break;
    case TipDoubt::kTakenStraight:
      text =
          "the tip is pre-shaped, and is taken for straight in modes em and paper and without cameras: its "
          "end is elsewhere";
      break;
    case TipDoubt::kNotStraight:
      text =
          "coils and images show a pre-shaped tip, and a straight one is configured: check rest_shape and "
          "which catheter is in use";
      break;
    case TipDoubt::kNoSuchHook:
      text =
          "coils and images show a straight tip, and a hook is configured: check rest_shape and which "
          "catheter is in use";
      break;
  }
  std::snprintf(words.data(), words.size(), "%s: %s", instrument.id.c_str(), text);
}

}  // namespace tubed
