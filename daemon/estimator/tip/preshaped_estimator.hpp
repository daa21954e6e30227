// Tubes whose tip may be pre-shaped: the same estimator twice, with a straight tip and with a hook, and who
// says which of them holds.
#pragma once

#include <memory>
#include <vector>

#include "daemon/estimator/estimator.hpp"
#include "daemon/estimator/tip/tip_shape.hpp"

namespace tubed {

/// Runs the one estimator or the other, never both; the one that takes over begins afresh. That with a hook
/// has more coefficients: a spline of 16 mm cannot bend as a hook of 8 mm does. Says AMBIGUOUS where the
/// side to which a hook turns is not known, or whether there is one; TIP_NOT_SEEN where a configured hook's
/// roll has not been looked for yet, and where another tip is seen than the configured one. See Estimator for
/// thread and promises.
class PreshapedEstimator final : public Estimator {
 public:
  /// `make` makes an estimator with such settings; its rest shape is straight.
  template <typename Make>
  PreshapedEstimator(const EstimatorSettings& settings, const InstrumentDescription& instrument,
                     const RoomDescription& room, const Make& make)
      : PreshapedEstimator(settings, instrument, room) {
    straight_ = make(settings);
    hooked_ = make(settings_for_hooks(settings, instrument.length_mm));
    hooked_->set_rest(tip_shape_.rest());
  }

  void update(const Observation& observation, TubeEstimate& estimate) noexcept override;
  void look_further(const Observation& observation) noexcept override;
  void reset() noexcept override;
  [[nodiscard]] ImageNeed image_need() const noexcept override { return active().image_need(); }
  [[nodiscard]] bool describe_disagreement(std::span<char> words) const noexcept override;
  [[nodiscard]] bool describe_jump(std::span<char> words) const noexcept override {
    return active().describe_jump(words);
  }

  /// Coefficients no further than kHookSpacing_mm apart, if there can be as many.
  static EstimatorSettings settings_for_hooks(const EstimatorSettings& settings, double length_mm);
  static constexpr double kHookSpacing_mm = 8.5;

 private:
  PreshapedEstimator(const EstimatorSettings& settings, const InstrumentDescription& instrument,
                     const RoomDescription& room);

  [[nodiscard]] RestShapedEstimator& active() const { return tip_shape_.rest() ? *hooked_ : *straight_; }
  [[nodiscard]] CoilObservations observe(const Observation& observation) const;
  void note_shape(const TubeEstimate& estimate);
  void add_error_of_making(const CoilObservations& coils, TubeEstimate& estimate) const;
  void note_views(const Observation& observation, const TubeEstimate& estimate);

  EstimatorSettings settings_;
  InstrumentDescription instrument_;
  RigidTransform T_world_em_;
  bool registered_;
  std::vector<Camera> cameras_;
  TipShape tip_shape_;
  Eigen::Matrix3Xd C_;                ///< of the newest shape with a hook
  TipDoubt doubt_ = TipDoubt::kNone;  ///< of the newest estimate
  bool is_room_wrong_ = false;        ///< then: coils and images disagree everywhere
  std::unique_ptr<RestShapedEstimator> straight_;
  std::unique_ptr<RestShapedEstimator> hooked_;
};

}  // namespace tubed
