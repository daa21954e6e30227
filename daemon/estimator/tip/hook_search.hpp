// Which rest shape does the tip have: of one instant, straight against a hook, from every side.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "daemon/estimator/coils/coil_observation.hpp"
#include "daemon/estimator/images/tube_views.hpp"
#include "daemon/estimator/tip/rest_hook.hpp"
#include "daemon/estimator/tube_map.hpp"

namespace tubed {

/// Solves one instant with a straight tip and with a hook whose plane may have any roll, each from its own
/// starts: a roll that begins half a turn away from the truth does not come to it. Only the last part of the
/// tube is solved, which alone says what its tip is like. Nothing is carried
/// over from one instant to the next. Called by the optimizer thread; memory is taken in the constructor.
class HookSearch {
 public:
  /// `hook_mm`: length of the longest hook that will be asked for.
  HookSearch(const EstimatorSettings& settings, const InstrumentDescription& instrument,
             const RoomDescription& room, double hook_mm);

  /// chi^2 of the shape with a straight tip, with all that contradicts it: coils, bending, image lines, and
  /// kUnseenCost for each line of the tip where the image shows no tube. False with fewer than two usable
  /// coils of the last part or without an image that shows it.
  bool solve_straight(const Observation& observation, const CoilObservations& coils);
  [[nodiscard]] double straight_cost() const { return straight_.cost; }

  /// The same with `hook` from one of kStarts directions of its binormal, which becomes that of the shape
  /// found. Precondition: solve_straight() was true for the same instant.
  double solve_with(RestHook& hook, int start, const Observation& observation);

  /// chi^2 that the hook of solve_with() saved the coils and the bending, before the images were looked at.
  [[nodiscard]] double gain_of_coils() const { return straight_.cost_of_coils - hooked_.cost_of_coils; }

  /// How far the tip of the shape that solve_with() found last lies from that of the straight one, mm.
  [[nodiscard]] double between_tips_mm() const;

  /// Of the image: a line of the tip without a ridge within reach. A roll that looks at nothing would win
  /// otherwise. Lines are 2 mm apart and not independent.
  static constexpr double kUnseenCost = 4;
  static constexpr int kStarts = 8;  ///< directions of the binormal

  /// The part that is solved: at least so much before the hook, and so many coils.
  static constexpr double kBeforeHook_mm = 60;
  static constexpr std::size_t kCoils = 3;
  [[nodiscard]] double length_mm() const { return map_.spline().length_mm(); }

 private:
  struct Part {
    EstimatorSettings settings;        ///< fewer coefficients, as far apart as those of the whole tube
    InstrumentDescription instrument;  ///< so much shorter
  };
  static Part last_part(EstimatorSettings settings, InstrumentDescription instrument, double hook_mm);
  HookSearch(const Part& part, const RoomDescription& room);

  struct Hypothesis {
    Eigen::Matrix3Xd C;
    double cost = 0;
    double cost_of_coils = 0;  ///< before images
  };

  void soften_tip(int from_segment);
  void look(const Observation& observation, Hypothesis& hypothesis);

  TubeMap map_;
  TubeViews views_;
  Eigen::VectorXd bending_;  ///< factors of map_
  TubeEstimate figures_;     ///< of images; nobody reads them
  CoilObservations coils_;   ///< of the last part, the others missing
  Hypothesis straight_;
  Eigen::Matrix3Xd C_coils_;  ///< with a straight tip, of the coils alone
  Hypothesis hooked_;
  float agreeing_ = 0;
};

}  // namespace tubed
