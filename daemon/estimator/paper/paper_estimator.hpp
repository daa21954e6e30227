// Mode "paper": the method of Tran et al. as printed where it can be, every instant by itself (Sec. 2.2.3).
#pragma once

#include <optional>
#include <vector>

#include "daemon/estimator/estimator.hpp"
#include "daemon/estimator/paper/paper_em_map.hpp"
#include "daemon/estimator/paper/paper_image_mle.hpp"
#include "daemon/estimator/report.hpp"
#include "daemon/model/dense_solver.hpp"

namespace tubed {

/// MAP of Eq. (14) in 3D, then MLE of Eq. (18) in the image and MAP along the depth in turn until the knot
/// points rest. The image is that of the first camera that has one. What is published has no covariance
/// (infinity: unknown), as the paper gives none. Unlike the other modes it allocates, and
/// takes some milliseconds: for comparison, not for the operating room. Nothing leaves update() as an
/// exception: what fails makes an estimate that says NOT_CONVERGED.
class PaperEstimator final : public Estimator {
 public:
  PaperEstimator(const EstimatorSettings& settings, const InstrumentDescription& instrument,
                 const RoomDescription& room);

  void update(const Observation& observation, TubeEstimate& estimate) noexcept override;
  void reset() noexcept override;

 private:
  /// The shape at one instant, before it is written.
  struct Shape {
    Eigen::Matrix3Xd K;  ///< knot points, mm, world
    bool converged = false;
  };

  struct Published {
    Eigen::Matrix3Xd C;                   ///< coefficients, mm, world
    std::optional<MonotonicTime> time{};  ///< nothing: there is no shape yet
  };
  /// The image that took part last.
  struct Seen {
    MonotonicTime exposure{};
    std::optional<PoseSigma> own_pose{};  ///< that came with it
    std::size_t camera = 0;
  };

  bool solve(const Observation& observation, const CoilObservations& coils, TubeEstimate& estimate);
  ImageVerdict fuse(const ImageMeasurement& image, std::size_t camera, const CoilObservations& coils,
                    const PaperEmShape& em, TubeEstimate& estimate);
  bool solve_depths(const Camera& camera, const CoilObservations& coils, const PaperEmShape& em, Shape& shape,
                    TubeEstimate& estimate) const;
  void write_held_by_image(TubeEstimate& estimate) const;
  void keep();

  EstimatorSettings settings_;
  InstrumentDescription instrument_;
  RigidTransform T_world_em_;
  bool registered_;
  KnotCurve curve_;
  std::vector<Camera> cameras_;
  std::vector<PaperImageMle> searches_;  ///< one each of cameras_
  Eigen::MatrixXd samples_;              ///< weights of the knot points every mm, one place a row
  UniformCubicBSpline spline_;           ///< what is published
  LeastSquares fit_;
  Shape shape_;
  Published published_;
  ImageVerdict images_ = ImageVerdict::kNone;
  LostTube lost_tube_;
  Seen seen_;
};

}  // namespace tubed
