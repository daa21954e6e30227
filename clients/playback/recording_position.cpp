#include "clients/playback/recording_position.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace tubed {

RecordingPosition::RecordingPosition(std::vector<double> times_s)
    : times_s_(std::move(times_s)), t_s_(times_s_.front()) {}

void RecordingPosition::set_ready(std::size_t count) { ready_ = std::min(count, times_s_.size()); }

std::size_t RecordingPosition::instant_at(double t_s) const {
  const auto later = std::upper_bound(times_s_.begin(), times_s_.end(), t_s);
  return later == times_s_.begin() ? 0 : static_cast<std::size_t>(later - times_s_.begin()) - 1;
}

void RecordingPosition::advance(double now_s) {
  const double passed_s = std::max(now_s - now_s_.value_or(now_s), 0.0);
  now_s_ = now_s;
  if (!is_playing_ || ready_ == 0) return;
  t_s_ = std::min(t_s_ + passed_s * speed_, times_s_[ready_ - 1]);
  if (ready_ == times_s_.size() && t_s_ >= times_s_.back()) is_playing_ = false;
}

void RecordingPosition::play(double now_s) {
  advance(now_s);
  if (ready_ == times_s_.size() && t_s_ >= times_s_.back()) t_s_ = times_s_.front();
  is_playing_ = true;
}

void RecordingPosition::pause(double now_s) {
  advance(now_s);
  is_playing_ = false;
}

void RecordingPosition::seek(double t_s, double now_s) {
  advance(now_s);
  if (std::isnan(t_s) || ready_ == 0) return;
  t_s_ = std::clamp(t_s, times_s_.front(), times_s_[ready_ - 1]);
}

void RecordingPosition::step(int instants, double now_s) {
  pause(now_s);
  if (ready_ == 0) return;
  const auto wanted = static_cast<long long>(instant_at(t_s_)) + instants;
  t_s_ = times_s_[static_cast<std::size_t>(
      std::clamp<long long>(wanted, 0, static_cast<long long>(ready_) - 1))];
}

void RecordingPosition::set_speed(double speed, double now_s) {
  advance(now_s);
  if (!std::isnan(speed)) speed_ = std::clamp(speed, kMinSpeed, kMaxSpeed);
}

std::optional<std::size_t> RecordingPosition::instant() const {
  if (ready_ == 0) return std::nullopt;
  return std::min(instant_at(t_s_), ready_ - 1);
}

}  // namespace tubed
