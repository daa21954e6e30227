// Which rest shape does the tip have: of one instant, straight against a hook, from every side.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "daemon/estimator/coil_observation.hpp"
#include "daemon/estimator/rest_hook.hpp"
#include "daemon/estimator/tube_map.hpp"
#include "daemon/estimator/tube_views.hpp"

namespace tubed {

/// Solves one instant with a straight tip and with a hook whose plane may have any roll, each from its own
/// starts: a roll that begins half a turn away from the truth does not come to it. Nothing is carried over
/// from one call to the next. Called by the optimizer thread; memory is taken in the constructor.
class HookSearch {
 public:
  HookSearch(const EstimatorSettings& settings, const InstrumentDescription& instrument,
             const RoomDescription& room);

  /// chi^2 of the shape with a straight tip, with all that contradicts it: coils, bending, image lines, and
  /// kUnseenCost for each line of the tip where the image shows no tube. False with fewer than two usable
  /// coils or without an image that shows the tube.
  bool solve_straight(const Observation& observation, const CoilObservations& coils);
  [[nodiscard]] double straight_cost() const { return straight_.cost; }

  /// The same with `hook` from one of kStarts directions of its binormal, which becomes that of the shape
  /// found. Precondition: solve_straight() was true for the same instant.
  double solve_with(RestHook& hook, int start, const Observation& observation, const CoilObservations& coils);

  /// How far the tip of the shape that solve_with() found last lies from that of the straight one, mm.
  [[nodiscard]] double between_tips_mm() const;

  /// Of the image: a line of the tip without a ridge within reach. A roll that looks at nothing would win
  /// otherwise. Lines are 2 mm apart and not independent.
  static constexpr double kUnseenCost = 4;
  static constexpr int kStarts = 8;  ///< directions of the binormal

 private:
  struct Hypothesis {
    Eigen::Matrix3Xd C;
    double cost = 0;
  };

  void soften_tip(int from_segment);
  void look(const Observation& observation, const CoilObservations& coils, Hypothesis& hypothesis);

  TubeMap map_;
  TubeViews views_;
  Eigen::VectorXd bending_;  ///< factors of map_
  TubeEstimate figures_;     ///< of images; nobody reads them
  Hypothesis straight_;
  Eigen::Matrix3Xd C_coils_;  ///< with a straight tip, of the coils alone
  Hypothesis hooked_;
  float agreeing_ = 0;
};

}  // namespace tubed
