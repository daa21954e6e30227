// An estimator that says so where images are read in a wrong way.
#pragma once

#include <memory>
#include <span>

#include "daemon/estimator/images/misread_images.hpp"

namespace tubed {

/// The estimates of another estimator, which say EM_IMAGE_DISAGREE and are not VALID while MisreadImages has
/// found that pictures are negatives or mirrored. They are not read otherwise by themselves: a configuration
/// that is wrong has to be known by a person. But where the configuration leaves the polarity open, what is
/// found is what the next images are read for. See Estimator for thread and promises.
class MisreadImagesEstimator final : public Estimator {
 public:
  /// `room` as measured_room() has it.
  MisreadImagesEstimator(const EstimatorSettings& settings, const InstrumentDescription& instrument,
                         const RoomDescription& room, std::unique_ptr<Estimator> inside);

  void update(const Observation& observation, TubeEstimate& estimate) noexcept override;
  void look_further(const Observation& observation) noexcept override;
  [[nodiscard]] ImageNeed image_need() const noexcept override { return inside_->image_need(); }
  [[nodiscard]] std::optional<RidgePolarity> polarity_of(std::size_t camera) const noexcept override {
    return misread_.polarity_of(camera);
  }
  [[nodiscard]] bool describe_disagreement(std::span<char> words) const noexcept override;
  [[nodiscard]] bool describe_jump(std::span<char> words) const noexcept override {
    return inside_->describe_jump(words);
  }
  [[nodiscard]] bool describe_moved_view(std::span<char> words) const noexcept override {
    return inside_->describe_moved_view(words);
  }
  void reset() noexcept override;

 private:
  InstrumentDescription instrument_;
  std::vector<CameraCalibration> cameras_;
  std::unique_ptr<Estimator> inside_;
  MisreadImages misread_;
  bool is_lost_ = false;  ///< the newest estimate's images do not show the tube
};

}  // namespace tubed
