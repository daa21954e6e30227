// Why an estimate became what it is: what one image showed around the tube, and what was made of it.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "clients/evaluation/offline_reconstruction.hpp"
#include "daemon/estimator/estimator_settings.hpp"
#include "daemon/image/appearance_model.hpp"
#include "daemon/image/frangi_settings.hpp"
#include "daemon/image/image_measurement.hpp"
#include "daemon/image/projected_lines.hpp"
#include "drivers/replay/sequence_folder.hpp"
#include "idl/estimate.hpp"
#include "idl/geometry/camera.hpp"

namespace tubed {

/// A tube in one image: its centreline, tip first; parts behind the source are left out.
struct ProjectedTube {
  std::vector<Eigen::Vector2d> centreline_px;
  std::vector<double> half_width_px;   ///< as many
  std::vector<std::uint32_t> held_by;  ///< as many, CentrelinePoint::held_by; empty: of no estimate
};

/// One image and everything about it. Allocates.
struct Explanation {
  std::uint32_t frame = 0;
  double t_s = 0;
  /// Of the image as it is measured: all places below are pixels of that. Where the view had moved and the
  /// estimator found out where to, as it stands there.
  CameraCalibration camera;
  int binning = 1;  ///< the detector's pixels a side that one of them is
  EstimatorMode mode = EstimatorMode::kFilter;
  ImageMeasurement image;              ///< grey is empty-handed unless state is kMeasured
  bool view_has_moved = false;         ///< or may have: no pose says where the image was taken from
  std::string moved_view;              ///< Estimator::describe_moved_view(); empty: nothing is known of it
  std::string agreement;               ///< describe_agreement() of `after`
  TubeEstimate before;                 ///< of the same instant without its images: coils and what was known
  TubeEstimate after;                  ///< as published
  ProjectedTube predicted;             ///< of `before`
  ProjectedTube estimated;             ///< of `after`
  std::optional<ProjectedTube> truth;  ///< where the sequence tells it
  std::vector<Eigen::Vector2d> marks_px;  ///< where the estimated shape has the instrument's marks, in view

  int reach_px = 0;           ///< of the lines to either side
  LineLayout layout{100.0};   ///< of the lines
  CorrespondenceLines lines;  ///< searched around the predicted tube
  LineSearch::Outcome found;
  /// P(tube | y) of every pixel, tube and background being as likely, by histograms over grey value and
  /// vesselness learnt in this image around the estimated tube. Empty when it could not be learnt.
  std::vector<float> posterior;
};

/// Which image is asked about.
struct ExplainedImage {
  std::uint32_t frame = 0;  ///< as in frames.csv
  std::string camera;       ///< name of the view; empty: that of the row
};

/// Reconstructs the sequence up to that image. Throws std::runtime_error when there is no such image (with
/// what there is), SequenceError when one cannot be read.
Explanation explain_image(const Sequence& sequence, const ExplainedImage& which,
                          const EstimatorSettings& settings, const FrangiSettings& frangi,
                          std::chrono::nanoseconds max_image_timeout = kUsualMaxImageTimeout);

/// One line each of what a person should know: instant, validity with reasons, how the lines did, distance
/// from the truth where it is known.
std::vector<std::string> words_of(const Explanation& explanation);

/// s_mm, base, normal, offset, standard deviation, agrees; a header and a row a line in view. In pixels of
/// the detector.
std::string lines_csv(const Explanation& explanation);

/// The estimated centreline in that view, a point each mm; empty when there is no shape.
ProjectedTube project(const Camera& camera, const TubeEstimate& estimate);

/// 2D distances, px, from points of `from` inside the image to the nearest place on `to`; those of points
/// whose nearest place is an end of `to` are left out.
std::vector<double> distances_px(const ProjectedTube& from, const ProjectedTube& to,
                                 const CameraCalibration& camera);

}  // namespace tubed
