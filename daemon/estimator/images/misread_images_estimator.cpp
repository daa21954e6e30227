#include "daemon/estimator/images/misread_images_estimator.hpp"

#include <utility>

#include "daemon/estimator/agreement/agreement_words.hpp"

namespace tubed {

namespace {

EmImageAgreement agreement_of(const MisreadImages::Found& found, EmImageAgreement agreement = {}) {
  agreement.disagree = true;
  agreement.explanation = found.reading;
  agreement.index = found.camera;
  agreement.as_stated = 0;
  agreement.probability = static_cast<float>(found.agreeing);
  return agreement;
}

}  // namespace

MisreadImagesEstimator::MisreadImagesEstimator(const EstimatorSettings& settings,
                                               const InstrumentDescription& instrument,
                                               const RoomDescription& room, std::unique_ptr<Estimator> inside)
    : instrument_(instrument),
      cameras_(room.cameras),
      inside_(std::move(inside)),
      misread_(settings, instrument, room) {}

void MisreadImagesEstimator::reset() noexcept {
  inside_->reset();
  misread_.forget();
  is_lost_ = false;
}

void MisreadImagesEstimator::update(const Observation& observation, TubeEstimate& estimate) noexcept {
  inside_->update(observation, estimate);
  is_lost_ = estimate.reasons.has(Reason::kImageLostTube);
  if (!misread_.is_wrong() || estimate.point_count == 0 || observation.fluoroscopy_off) return;
  estimate.agreement = agreement_of(*misread_.found(), estimate.agreement);
  estimate.reasons.add(Reason::kEmImageDisagree);
  if (estimate.validity == Validity::kValid) estimate.validity = Validity::kQuestionable;
}

void MisreadImagesEstimator::look_further(const Observation& observation) noexcept {
  inside_->look_further(observation);
  misread_.look(observation, is_lost_);
}

bool MisreadImagesEstimator::describe_disagreement(std::span<char> words) const noexcept {
  if (!misread_.is_wrong()) return inside_->describe_disagreement(words);
  write_disagreement(agreement_of(*misread_.found()), instrument_, cameras_, words);
  return true;
}

}  // namespace tubed
