// Modes "em" and "joint": every instant is solved afresh from its own measurements; nothing is carried over
// but the image lines that bridge the gap to the next image.
#pragma once

#include <array>
#include <vector>

#include "daemon/estimator/estimator.hpp"
#include "daemon/estimator/tube_map.hpp"
#include "daemon/image/correspondence_lines.hpp"

namespace tubed {

/// See Estimator for thread and promises. `em`: weighted MAP of Eq. (14) of the coils. `joint`: from that
/// start, the tube is looked for on lines normal to its projection in every image of the instant, and coils
/// and lines are solved together; three rounds with narrowing lines.
class SingleFrameEstimator final : public Estimator {
 public:
  SingleFrameEstimator(const EstimatorSettings& settings, const InstrumentDescription& instrument,
                       const RoomDescription& room);

  void estimate(const Observation& observation, TubeEstimate& estimate) noexcept override;
  void reset() noexcept override;

 private:
  using Lines = std::array<CorrespondenceLine, LineSearch::kMaxLines>;
  using Constraints = std::array<LineConstraint, LineSearch::kMaxLines>;

  /// Image lines of the newest image of one camera, kept to bridge the time to the next one.
  struct View {
    Camera camera;
    Constraints constraints{};  ///< variance as measured, before ageing
    int count = 0;
    MonotonicTime exposure{};  ///< of the image they come from; zero = none
    double inlier_ratio = 0;
    double in_view_ratio = 0;
    Constraints aged{};  ///< what the solver is given
  };

  bool solve_em(CoilObservations& coils, TubeEstimate& estimate);
  void reject_outlier(CoilObservations& coils);
  void fuse_images(const Observation& observation, const CoilObservations& coils, TubeEstimate& estimate);
  bool measure_images(const Observation& observation, int reach_px, TubeEstimate& estimate);
  void project_lines(View& view, int& in_view);
  void measure_view(const ImageMeasurement& image, View& view, int reach_px);
  int gather_views(MonotonicTime instant);
  void judge(const Observation& observation, const CoilObservations& coils, TubeEstimate& estimate) const;
  void write_shape(TubeEstimate& estimate) const;
  void write_coils(const CoilObservations& coils, TubeEstimate& estimate) const;
  void write_ages(const Observation& observation, const EmFrame* frame, TubeEstimate& estimate) const;

  EstimatorSettings settings_;
  InstrumentDescription instrument_;
  RigidTransform T_world_em_;
  bool registered_;
  TubeMap map_;
  Eigen::Matrix3Xd C_;          ///< the newest shape
  Eigen::Matrix3Xd C_without_;  ///< scratch of the leave-one-out test
  std::vector<View> views_;
  std::array<ViewConstraints, kMaxCameras> constraints_{};
  LineSearch search_;
  Lines lines_{};
  int line_count_;
  double line_spacing_mm_;
  bool has_shape_ = false;
  bool has_covariance_ = false;
  bool converged_ = false;
  MonotonicTime shape_time_{};  ///< the instant of the newest shape
};

}  // namespace tubed
