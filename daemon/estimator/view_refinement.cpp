// The pose of a view that was found, made better while its images are used.
#include <algorithm>

#include "daemon/estimator/view_relocaliser.hpp"

namespace tubed {

// 1: the tube is where no image has shown it yet.
double ViewRelocaliser::news_for(const Hypothesis& hypothesis) const {
  if (!hypothesis.has_used) return 1;
  return std::min(1.0, (points_mm_ - hypothesis.points_used_mm).colwise().norm().mean() / kOtherPlace_mm);
}

// Against all places that it was refined at: what comes back there is nothing new.
double ViewRelocaliser::news_for_refinement() const {
  double news = news_for(hypotheses_[likeliest_]);
  for (std::size_t k = 0; k < std::min(refined_, kPlaces); ++k) {
    news = std::min(news, (points_mm_ - refined_at_mm_[k]).colwise().norm().mean() / kOtherPlace_mm);
  }
  return news;
}

// Where the tube is the estimate knows better than coils of one instant.
void ViewRelocaliser::refine(const MovedImage& moved, const TubeEstimate& estimate,
                             const TubeEstimate& by_coils) {
  if (state_ != State::kFound || !moved.has_settled || !take_shape(estimate)) return;
  const double news = news_for_refinement();
  if (news < kWorthwhileNews) return;
  Eigen::Matrix3Xd& here_mm = refined_at_mm_[refined_ % kPlaces];
  here_mm = points_mm_;
  if (!take_shape(by_coils)) return;
  ++refined_;
  correct(moved, news, hypotheses_[likeliest_]);
  hypotheses_[likeliest_].points_used_mm = here_mm;
  pose_ = hypotheses_[likeliest_].pose;
  note_sigma();
}

}  // namespace tubed
