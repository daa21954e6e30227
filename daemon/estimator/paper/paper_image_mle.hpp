// The paper's maximum likelihood estimation in the image plane, Sec. 2.2.2: knot points move at their depth
// until the pixels around the projected tube are explained best.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "daemon/estimator/estimator_settings.hpp"
#include "daemon/estimator/paper/paper_knot_curve.hpp"
#include "daemon/image/band_likelihood.hpp"
#include "daemon/image/correspondence_lines.hpp"
#include "daemon/image/seen_tube.hpp"
#include "drivers/interface/room.hpp"
#include "idl/geometry/camera.hpp"

namespace tubed {

/// What one image said.
struct PaperMleOutcome {
  bool looked = false;        ///< enough of the tube lies in the image to ask it
  double in_view_ratio = 0;   ///< share of the tube in the image
  double agreeing_ratio = 0;  ///< share of that on a ridge
  int iterations = 0;
};

/// One a camera and instrument; remembers how the tube looked. Allocates as it works.
class PaperImageMle {
 public:
  /// Share of the tube in the image that has to lie on a ridge for the image to be believed.
  static constexpr double kMinAgreeing = 0.5;

  PaperImageMle(const EstimatorSettings& settings, const InstrumentDescription& instrument,
                const CameraCalibration& camera, const KnotCurve& curve);

  /// The next image was taken with this geometry; with nothing, with that of the camera. What is not known of
  /// the pose is left out.
  void look_from(const std::optional<ViewGeometry>& geometry);

  /// Moves the knot points K (3 x n, mm, world) parallel to the image plane from where they are. K_em: where
  /// the coils alone have them, what the prior holds to. `first` round of an instant: with the start of
  /// the settings.
  PaperMleOutcome search(const ImageMeasurement& image, const Eigen::Matrix3Xd& K_em, bool first,
                         Eigen::Matrix3Xd& K);

  /// Lets the appearance model learn slowly from a tube that is trusted to be at K.
  void adapt(const ImageMeasurement& image, const Eigen::Matrix3Xd& K);

  void forget() { model_.forget(); }

  /// What the newest image that was searched showed of the tube.
  [[nodiscard]] const SeenTube& seen() const { return seen_; }

 private:
  /// Value and derivatives of what is minimised: -log of Eq. (15) over temper, plus the prior.
  struct Quadratic {
    double value = 0;
    Eigen::VectorXd gradient;
    Eigen::MatrixXd matrix;
  };
  using Lines = std::array<CorrespondenceLine, LineSearch::kMaxLines>;

  void project(const Eigen::Matrix3Xd& K);
  int prepare_lines();
  bool start_on_lines(const ImageMeasurement& image, const Eigen::Matrix3Xd& K_em, int reach_px,
                      Eigen::Matrix3Xd& K);
  void choose_band(const ImageMeasurement& image, const Eigen::Matrix3Xd& K);
  Quadratic expand(const Eigen::Matrix3Xd& K, const Eigen::Matrix3Xd& K_em, double epsilon_px,
                   bool with_derivatives);
  [[nodiscard]] Eigen::MatrixXd knot_information(const BandDerivatives& derivatives) const;
  int climb(const Eigen::Matrix3Xd& K_em, double epsilon_px, Eigen::Matrix3Xd& K);
  [[nodiscard]] Eigen::VectorXd moved_in_plane(const Eigen::Matrix3Xd& K, const Eigen::Matrix3Xd& K_em) const;
  [[nodiscard]] Eigen::Matrix3Xd displaced(const Eigen::Matrix3Xd& K, const Eigen::VectorXd& step) const;

  EstimatorSettings settings_;
  double radius_mm_;
  double spacing_mm_ = 0;  ///< of the vertices along the tube
  Camera camera_;
  Eigen::Matrix<double, 3, 2> plane_world_;  ///< the camera's x and y axes
  Eigen::MatrixXd weights_;                  ///< of the knot points (columns) in each vertex (rows)
  Eigen::MatrixXd line_prior_;               ///< 2 n x 2 n, per mm^2: of displacements from K_em
  Eigen::MatrixXd mle_prior_;
  AppearanceModel model_;
  BandLikelihood band_;
  std::vector<PathVertex> path_;
  std::vector<Eigen::Matrix2d> J_image_plane_;  ///< px per mm of each vertex
  LineSearch search_{LineSearch::Manner::kAsPublished};
  Lines lines_{};
  SeenTube seen_{};
};

}  // namespace tubed
