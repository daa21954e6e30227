#include "daemon/estimator/view/pose_in_use.hpp"

#include <algorithm>
#include <chrono>

#include "daemon/estimator/view/move_hypotheses.hpp"

namespace tubed {

namespace {

constexpr std::chrono::milliseconds kMaxBad{1000};

}  // namespace

PoseInUse::PoseInUse(Eigen::Index line_count) {
  for (Eigen::Matrix3Xd& place_mm : refined_at_mm_) place_mm.resize(3, line_count);
}

void PoseInUse::begin(MonotonicTime exposure) {
  refined_ = 0;
  bad_since_ = last_use_ = exposure;
}

bool PoseInUse::note(MonotonicTime exposure, bool is_good, bool says_something) {
  const bool was_away = exposure - last_use_ > kMaxBad;
  last_use_ = exposure;
  if (is_good || was_away || !says_something) bad_since_ = exposure;
  return exposure - bad_since_ <= kMaxBad;
}

double PoseInUse::news_of(const Eigen::Matrix3Xd& points_mm) const {
  double news = 1;
  for (std::size_t k = 0; k < std::min(refined_, refined_at_mm_.size()); ++k) {
    news = std::min(news, MoveHypotheses::news_between(points_mm, refined_at_mm_[k]));
  }
  return news;
}

void PoseInUse::note_refined_at(const Eigen::Matrix3Xd& points_mm) {
  refined_at_mm_[refined_++ % refined_at_mm_.size()] = points_mm;
}

}  // namespace tubed
