#include "drivers/laboratory/played_run.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace tubed {

namespace {

constexpr double kMaxTurnBetween_rad = 0.08;

/// Do the tangents of two shapes differ by so much somewhere that a straight line between them is too short?
bool too_far_apart(const CatheterShape& a, const CatheterShape& b) {
  const double until_mm = std::min(a.length_mm(), b.length_mm());
  for (double s_mm = 0; s_mm < until_mm; s_mm += a.spacing_mm()) {
    if (a.at(s_mm).tangent_world.dot(b.at(s_mm).tangent_world) < std::cos(kMaxTurnBetween_rad)) {
      return true;
    }
  }
  return false;
}

}  // namespace

PlayedRun::PlayedRun(std::shared_ptr<const Catheterisation> run, double steps_per_s)
    : run_(std::move(run)), steps_per_s_(steps_per_s) {
  for (std::size_t step = 0; step + 1 < run_->shapes.size(); ++step) {
    jumps_.push_back(run_->steps[step].snapped && too_far_apart(run_->shapes[step], run_->shapes[step + 1]));
  }
}

double PlayedRun::duration_s() const { return static_cast<double>(run_->steps.size()) / steps_per_s_; }

double PlayedRun::step_at(double t_s) const {
  const auto last = static_cast<double>(run_->steps.size());
  if (last == 0) {
    return 0;
  }
  const double along = std::fmod(std::max(t_s, 0.0) * steps_per_s_, 2 * last);
  return along <= last ? along : 2 * last - along;
}

PlayedRun::Between PlayedRun::between(double t_s) const {
  const double step = step_at(t_s);
  const auto before = std::min(static_cast<std::size_t>(step), run_->shapes.size() - 1);
  const std::size_t after = std::min(before + 1, run_->shapes.size() - 1);
  const double share = step - static_cast<double>(before);
  return {before, after, before < jumps_.size() && jumps_[before] ? std::round(share) : share};
}

ShapePoint PlayedRun::at(double t_s, double s_mm) const {
  const Between place = between(t_s);
  const ShapePoint a = run_->shapes[place.before].at(s_mm);
  if (place.share == 0) {
    return a;
  }
  const ShapePoint b = run_->shapes[place.after].at(s_mm);
  return {(1 - place.share) * a.p_world_mm + place.share * b.p_world_mm,
          ((1 - place.share) * a.tangent_world + place.share * b.tangent_world).normalized()};
}

double PlayedRun::insertion_mm(double t_s) const {
  const Between place = between(t_s);
  return (1 - place.share) * run_->insertion_mm[place.before] + place.share * run_->insertion_mm[place.after];
}

}  // namespace tubed
