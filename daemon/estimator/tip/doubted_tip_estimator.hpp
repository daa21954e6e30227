// Tubes with a pre-shaped tip whose estimator takes it for a straight one.
#pragma once

#include <memory>
#include <span>

#include "daemon/estimator/estimator.hpp"

namespace tubed {

/// The estimates of another estimator, whose tip nobody has to believe: they say TIP_NOT_SEEN, are not VALID,
/// and no coil holds what lies before the first one that is used. See Estimator for thread and promises.
class DoubtedTipEstimator final : public Estimator {
 public:
  DoubtedTipEstimator(const InstrumentDescription& instrument, std::unique_ptr<Estimator> straight);

  void update(const Observation& observation, TubeEstimate& estimate) noexcept override;
  void look_further(const Observation& observation) noexcept override {
    straight_->look_further(observation);
  }
  [[nodiscard]] ImageNeed image_need() const noexcept override { return straight_->image_need(); }
  [[nodiscard]] bool describe_disagreement(std::span<char> words) const noexcept override;
  [[nodiscard]] bool describe_jump(std::span<char> words) const noexcept override {
    return straight_->describe_jump(words);
  }
  void reset() noexcept override { straight_->reset(); }

 private:
  InstrumentDescription instrument_;
  std::unique_ptr<Estimator> straight_;
  bool has_shape_ = false;  ///< the newest estimate
};

}  // namespace tubed
