#include "daemon/estimator/tip/doubted_tip_estimator.hpp"

#include <utility>

#include "daemon/estimator/report.hpp"
#include "daemon/estimator/tip/tip_shape.hpp"

namespace tubed {

DoubtedTipEstimator::DoubtedTipEstimator(const InstrumentDescription& instrument,
                                         std::unique_ptr<Estimator> straight)
    : instrument_(instrument), straight_(std::move(straight)) {}

void DoubtedTipEstimator::update(const Observation& observation, TubeEstimate& estimate) noexcept {
  straight_->update(observation, estimate);
  has_shape_ = estimate.point_count > 0;
  if (!has_shape_) return;
  estimate.reasons.add(Reason::kTipNotSeen);
  release_tip(instrument_.coils.front().offset_from_tip_mm, estimate);
  if (estimate.validity == Validity::kValid) estimate.validity = Validity::kQuestionable;
}

bool DoubtedTipEstimator::describe_disagreement(std::span<char> words) const noexcept {
  if (straight_->describe_disagreement(words)) return true;
  if (!has_shape_) return false;
  write_tip_doubt(TipDoubt::kTakenStraight, instrument_, words);
  return true;
}

}  // namespace tubed
