// Any estimator, in a room whose views may move without a word.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "daemon/estimator/single_frame_estimator.hpp"
#include "daemon/estimator/view/view_relocaliser.hpp"

namespace tubed {

/// Has a ViewRelocaliser for each camera find where a view stands after a move that no pose announced, gives
/// its images to the estimator inside from then on, and adds what is open of that pose to the covariance of
/// what the image holds. GEOMETRY_CHANGED stays until a pose is given. See Estimator for thread and promises.
class RelocalisingEstimator final : public Estimator {
 public:
  /// `room` as measured_room() has it.
  RelocalisingEstimator(const EstimatorSettings& settings, const InstrumentDescription& instrument,
                        const RoomDescription& room, std::unique_ptr<Estimator> inside);

  void update(const Observation& observation, TubeEstimate& estimate) noexcept override;
  void look_further(const Observation& observation) noexcept override;
  void reset() noexcept override;
  [[nodiscard]] ImageNeed image_need() const noexcept override { return inside_->image_need(); }
  [[nodiscard]] std::optional<RidgePolarity> polarity_of(std::size_t camera) const noexcept override {
    return inside_->polarity_of(camera);
  }
  [[nodiscard]] bool describe_disagreement(std::span<char> words) const noexcept override {
    return inside_->describe_disagreement(words);
  }
  [[nodiscard]] bool describe_jump(std::span<char> words) const noexcept override {
    return inside_->describe_jump(words);
  }
  [[nodiscard]] bool describe_moved_view(std::span<char> words) const noexcept override;

 private:
  /// The pose with which an image was shown to the estimator inside.
  struct Lent {
    ViewPose pose;
    MonotonicTime exposure{};  ///< zero: none was
  };

  void lend(std::size_t view, const MovedImage& moved);
  [[nodiscard]] bool is_lent(std::size_t view, const MovedImage& moved) const;
  template <typename Show>
  void show_lent(const Observation& observation, const Show& show);
  void refine(std::size_t view, const Observation& observation, const TubeEstimate& estimate);
  void add_pose_errors(TubeEstimate& estimate) const;
  void doubt(TubeEstimate& estimate) const;

  std::unique_ptr<Estimator> inside_;
  SingleFrameEstimator coils_;              ///< what a pose in use is held against
  std::unique_ptr<TubeEstimate> by_coils_;  ///< what it writes
  bool tips_are_straight_;  ///< or, where they are not, a shape says so by its number of coefficients
  std::vector<CameraCalibration> cameras_;
  std::vector<std::unique_ptr<ViewRelocaliser>> views_;
  std::array<Lent, kMaxCameras> lent_;  ///< the newest of each camera
};

}  // namespace tubed
