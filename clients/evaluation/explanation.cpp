#include "clients/evaluation/explanation.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <memory>
#include <sstream>
#include <stdexcept>

#include "clients/evaluation/estimate_rows.hpp"
#include "clients/evaluation/offline_reconstruction.hpp"
#include "daemon/estimator/agreement/agreement_words.hpp"
#include "daemon/estimator/images/tube_views.hpp"
#include "daemon/estimator/paper/paper_image_mle.hpp"
#include "daemon/estimator/single_frame_solver.hpp"
#include "daemon/image/band_likelihood.hpp"
#include "daemon/image/measured_view.hpp"
#include "daemon/image/vesselness_meter.hpp"

namespace tubed {

namespace {

constexpr int kReach_px = 10;         // as the recursive estimator looks at first
constexpr double kBandReach_px = 14;  // what the histograms are learnt from
constexpr double kPointSpacing_mm = 1;

const SequenceFrame& row_of(const Sequence& sequence, const ExplainedImage& which) {
  const SequenceFrame* asked = nullptr;
  for (const SequenceFrame& row : sequence.frames) {
    if (row.frame == which.frame) {
      asked = &row;
    }
  }
  if (asked == nullptr) {
    throw std::runtime_error("no frame " + std::to_string(which.frame) + " in " + sequence.folder.string() +
                             "; frames.csv has " + std::to_string(sequence.frames.front().frame) + " to " +
                             std::to_string(sequence.frames.back().frame));
  }
  if (which.camera.empty()) {
    return *asked;
  }
  for (const SequenceFrame& row : sequence.frames) {
    const std::string& name = sequence.room.cameras[static_cast<std::size_t>(row.camera)].name;
    if (row.t_s == asked->t_s && name == which.camera) {
      return row;
    }
  }
  throw std::runtime_error("camera \"" + which.camera + "\" took no image at the instant of frame " +
                           std::to_string(which.frame));
}

void add_point(const Camera& camera, const Eigen::Vector3d& p_world_mm, double radius_mm,
               ProjectedTube& tube) {
  if (const auto projection = camera.project(p_world_mm)) {
    tube.centreline_px.push_back(projection->p_image_px);
    tube.half_width_px.push_back(radius_mm * camera.calibration().fx / projection->depth_mm);
  }
}

UniformCubicBSpline spline_of(const TubeEstimate& estimate) {
  return {static_cast<int>(estimate.coefficient_count), static_cast<double>(estimate.length_mm)};
}

std::vector<Eigen::Vector2d> marks_of(const Camera& camera, const TubeEstimate& estimate,
                                      const InstrumentDescription& instrument) {
  std::vector<Eigen::Vector2d> marks_px;
  if (estimate.coefficient_count < 4) return marks_px;
  const Eigen::Matrix3Xd C = coefficients_of(estimate);
  const UniformCubicBSpline spline = spline_of(estimate);
  for (const double mark_mm : instrument.marks_mm) {
    const CubicBasis basis = spline.basis(mark_mm);
    const auto here = camera.project(combine(C, basis.first, basis.value));
    if (here && camera.contains(here->p_image_px)) marks_px.push_back(here->p_image_px);
  }
  return marks_px;
}

void search_lines(const Camera& camera, Explanation& explanation) {
  const TubeEstimate& before = explanation.before;
  if (before.coefficient_count < 4) {
    return;
  }
  explanation.reach_px = kReach_px;
  explanation.layout = LineLayout(static_cast<double>(before.length_mm));
  project_lines(camera, spline_of(before), coefficients_of(before), explanation.layout,
                static_cast<double>(before.radius_mm), explanation.lines);
  drop_blind_lines(explanation.image, explanation.layout, kReach_px, explanation.lines);
  const auto search = std::make_unique<LineSearch>();
  explanation.found = search->search(explanation.image, explanation.lines, explanation.layout.count,
                                     kReach_px, kLineTransition_px);
}

void find_posterior(Explanation& explanation) {
  const ProjectedTube& tube = explanation.estimated;
  std::vector<PathVertex> path;
  for (std::size_t i = 0; i < tube.centreline_px.size(); ++i) {
    path.push_back({tube.centreline_px[i], tube.half_width_px[i]});
  }
  AppearanceModel model;
  BandLikelihood band;
  band.choose_band(explanation.image, path, kBandReach_px, model, PathEnd::kGoesOn);
  if (!model.learn(explanation.image, band.pixels(), 1)) {
    return;
  }
  explanation.posterior.reserve(explanation.image.grey.size());
  for (std::size_t i = 0; i < explanation.image.grey.size(); ++i) {
    const float foreground = model.foreground(explanation.image.grey[i], explanation.image.vesselness[i]);
    const float background = model.background(explanation.image.grey[i], explanation.image.vesselness[i]);
    explanation.posterior.push_back(foreground / (foreground + background));
  }
}

/// Vesselness everywhere, as a picture shows all of it.
void filter_whole(ImageMeasurement& image, ImageOnDemand& on_demand) {
  ImageArea all = image.measured;
  all.add_whole();
  on_demand.filter_missing(image, all);
}

/// What was measured of the image, also where the view had moved and its pose no longer holds.
void take_image(const Observation& observation, std::size_t camera, Explanation& explanation) {
  const MovedImage& moved = observation.moved[camera];
  ImageMeasurement* const image = moved.image != nullptr ? moved.image : observation.images[camera];
  explanation.view_has_moved = moved.image != nullptr;
  if (image == nullptr) {  // of a view that has moved, without radiation or refused
    explanation.view_has_moved = true;
    explanation.image.state = observation.image_rejected ? ImageState::kRejected : ImageState::kOff;
    return;
  }
  filter_whole(*image, moved.image != nullptr ? *moved.on_demand : *observation.on_demand[camera]);
  explanation.image = *image;
  if (!explanation.view_has_moved) return;
  const TubeEstimate& after = explanation.after;
  for (std::size_t i = 0; i < after.view_count; ++i) {
    const ViewUsed& used = after.views[i];
    if (used.camera != camera || used.exposure_monotonic_ns != to_ns(image->exposure)) continue;
    CameraCalibration& stands = explanation.camera;
    stands.fx = used.focal_length_px[0] / explanation.binning;
    stands.fy = used.focal_length_px[1] / explanation.binning;
    const Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> T(used.T_camera_world.data());
    stands.T_camera_world.matrix() = T;
  }
}

Observation without_images(Observation observation) {
  observation.images = {};
  observation.moved = {};
  observation.is_image_instant = false;
  return observation;
}

std::string format(const char* pattern, auto... values) {
  std::array<char, 256> text{};
  std::snprintf(text.data(), text.size(), pattern, values...);
  return text.data();
}

std::string words_of(const TubeEstimate& estimate) {
  const std::string why = estimate.reasons.empty() ? "" : ": " + names_of(estimate.reasons);
  return std::string(name_of(estimate.validity)) + why;
}

/// Why an image that was measured did not become part of the estimate, as far as the estimate tells it.
std::string why_left_out(const Explanation& explanation) {
  const TubeEstimate& after = explanation.after;
  if (explanation.mode == EstimatorMode::kEm) return "mode em looks at no image";
  if (after.reasons.has(Reason::kGeometryChanged)) return "the view moved, or may have, and no pose said so";
  if (after.coefficient_count == 0) return "there is no shape that it could be compared with";
  if (explanation.found.in_view < TubeViews::kMinLines) {
    return format("%d of the tube's lines are in view, %d are needed", explanation.found.in_view,
                  TubeViews::kMinLines);
  }
  const bool as_printed = explanation.mode == EstimatorMode::kPaper;
  const double needed = as_printed ? PaperImageMle::kMinAgreeing : SingleFrameSolver::kMinAgreeing;
  const auto agreeing = static_cast<double>(after.image_inlier_ratio);
  if (agreeing < needed) {
    return format("too few of its lines agree with the shape, %.0f %%; expected %.0f %% or more",
                  100 * agreeing, 100 * needed);
  }
  const std::string begin = format("%.0f %% of its lines agree with the shape, but ", 100 * agreeing);
  if (as_printed) return begin + "coils and image have no depths in common";
  return begin + (agreeing < SingleFrameSolver::kDoubtfulAgreeing
                      ? "they would pull it further than it can be wrong, or are so few that it may be chance"
                      : "they are so few that it may be chance");
}

std::string part_taken(const Explanation& explanation) {
  if (!explanation.after.has_image) return "the image took no part: " + why_left_out(explanation);
  return format("the image took part; of its lines %.0f %% agree with the shape",
                static_cast<double>(100 * explanation.after.image_inlier_ratio));
}

std::string error_words(const char* which, const ProjectedTube& tube, const Explanation& explanation) {
  std::vector<double> off = distances_px(tube, *explanation.truth, explanation.camera);
  for (double& distance_px : off) distance_px *= explanation.binning;
  if (off.empty()) {
    return std::string(which) + ": not in view";
  }
  std::sort(off.begin(), off.end());
  return format("%s off the truth: median %.2f px, 95 %% within %.2f px, greatest %.2f px", which,
                off[off.size() / 2], off[off.size() * 95 / 100], off.back());
}

/// Distance to the segment a b; t is 0 where the nearest place is a, 1 where it is b.
double to_segment(const Eigen::Vector2d& p, const Eigen::Vector2d& a, const Eigen::Vector2d& b, double& t) {
  const Eigen::Vector2d along = b - a;
  t = std::clamp((p - a).dot(along) / std::max(along.squaredNorm(), 1e-12), 0.0, 1.0);
  return (p - a - t * along).norm();
}

}  // namespace

ProjectedTube project(const Camera& camera, const TubeEstimate& estimate) {
  ProjectedTube tube;
  if (estimate.coefficient_count < 4) {
    return tube;
  }
  const Eigen::Matrix3Xd C = coefficients_of(estimate);
  const UniformCubicBSpline spline = spline_of(estimate);
  for (double s_mm = 0; s_mm <= spline.length_mm(); s_mm += kPointSpacing_mm) {
    const CubicBasis basis = spline.basis(s_mm);
    add_point(camera, combine(C, basis.first, basis.value), static_cast<double>(estimate.radius_mm), tube);
    if (tube.held_by.size() < tube.centreline_px.size()) tube.held_by.push_back(held_by_at(estimate, s_mm));
  }
  return tube;
}

std::vector<double> distances_px(const ProjectedTube& from, const ProjectedTube& to,
                                 const CameraCalibration& camera) {
  const Camera view(camera);
  std::vector<double> distances;
  for (const Eigen::Vector2d& p : from.centreline_px) {
    if (!view.contains(p)) {
      continue;
    }
    double least = 1e9;
    bool at_end = false;
    for (std::size_t i = 0; i + 1 < to.centreline_px.size(); ++i) {
      double t = 0;
      const double distance = to_segment(p, to.centreline_px[i], to.centreline_px[i + 1], t);
      if (distance < least) {
        least = distance;
        at_end = (i == 0 && t <= 0) || (i + 2 == to.centreline_px.size() && t >= 1);
      }
    }
    if (least < 1e9 && !at_end) {
      distances.push_back(least);
    }
  }
  return distances;
}

Explanation explain_image(const Sequence& sequence, const ExplainedImage& which,
                          const EstimatorSettings& settings, const FrangiSettings& frangi,
                          std::chrono::nanoseconds max_image_timeout) {
  const SequenceFrame& row = row_of(sequence, which);
  Explanation explanation;
  explanation.frame = row.frame;
  explanation.t_s = row.t_s;
  const CameraCalibration detector = camera_of(sequence, row);
  explanation.binning =
      binning_of(sequence.room.cameras[static_cast<std::size_t>(row.camera)], sequence.room.instruments);
  explanation.camera = binned(detector, explanation.binning);
  explanation.mode = settings.mode;
  const InstrumentDescription& instrument = sequence.room.instruments.front();
  const auto estimator = make_estimator(settings, instrument, sequence.room);
  const auto unaware = make_estimator(settings, instrument, sequence.room);  // of the last image
  observe_in_turn(
      sequence, Images::kMeasured, frangi,
      [&](const SequenceInstant& instant, const Observation& observation, AreaPredictions& next) {
        const bool last = instant.t_s == row.t_s;
        unaware->estimate(last ? without_images(observation) : observation, explanation.before);
        estimator->estimate(observation, explanation.after);
        next.add(*estimator, explanation.after);
        if (last) {
          take_image(observation, static_cast<std::size_t>(row.camera), explanation);
          std::array<char, 256> words{};
          if (estimator->describe_moved_view(words)) explanation.moved_view = words.data();
        }
        return !last;
      },
      max_image_timeout);
  const Camera camera(explanation.camera);
  explanation.agreement = describe_agreement(explanation.after.agreement, instrument, sequence.room.cameras);
  explanation.predicted = project(camera, explanation.before);
  explanation.estimated = project(camera, explanation.after);
  explanation.marks_px = marks_of(camera, explanation.after, instrument);
  if (const SequenceTruth* truth = find_truth(sequence, row.frame)) {
    explanation.truth.emplace();
    for (Eigen::Index i = 0; i < truth->points_world_mm.cols(); ++i) {
      add_point(camera, truth->points_world_mm.col(i), sequence.room.instruments.front().diameter_mm / 2,
                *explanation.truth);
    }
  }
  if (explanation.image.state == ImageState::kMeasured) {
    search_lines(camera, explanation);
    find_posterior(explanation);
  }
  return explanation;
}

std::vector<std::string> words_of(const Explanation& explanation) {
  std::vector<std::string> words{
      format("frame %u, camera %s, %.3f s, mode %s", explanation.frame, explanation.camera.name.c_str(),
             explanation.t_s, std::string(name_of(explanation.mode)).c_str()),
      words_of(explanation.after)};
  if (explanation.image.state != ImageState::kMeasured) {
    words.emplace_back(explanation.image.state == ImageState::kOff ? "fluoroscopy off: no image"
                                                                   : "the image was refused");
  } else {
    words.push_back(format("%d lines in view, %.0f %% see a ridge where the tube was found; usual ridge %.2f",
                           explanation.found.in_view, 100 * explanation.found.inlier_ratio,
                           static_cast<double>(explanation.found.ridge_height)));
    if (explanation.binning > 1) {
      words.push_back(
          format("measured with squares of %d x %d pixels as one", explanation.binning, explanation.binning));
    }
    words.push_back(part_taken(explanation));
  }
  if (!explanation.moved_view.empty()) {
    words.push_back(explanation.moved_view);
  }
  if (explanation.after.agreement.probability > 0) {
    words.push_back(explanation.agreement);
  }
  if (explanation.truth) {
    words.push_back(error_words("predicted", explanation.predicted, explanation));
    words.push_back(error_words("estimated", explanation.estimated, explanation));
  }
  return words;
}

std::string lines_csv(const Explanation& explanation) {
  std::ostringstream text;
  text << "s_mm,base_x_px,base_y_px,normal_x,normal_y,offset_px,sigma_px,agrees\n";
  for (int i = 0; i < explanation.layout.count; ++i) {
    const CorrespondenceLine& line = explanation.lines[static_cast<std::size_t>(i)];
    if (line.in_view) {
      const Eigen::Vector2d base_px = unbinned_px(line.base_px, explanation.binning);
      text << explanation.layout.s_mm(i) << ',' << base_px.x() << ',' << base_px.y() << ',' << line.normal.x()
           << ',' << line.normal.y() << ',' << line.offset_px * explanation.binning << ','
           << std::sqrt(line.variance_px2) * explanation.binning << ',' << (line.agrees ? 1 : 0) << '\n';
    }
  }
  return text.str();
}

}  // namespace tubed
