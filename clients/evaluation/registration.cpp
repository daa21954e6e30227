#include "clients/evaluation/registration.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <memory>
#include <stdexcept>
#include <utility>

#include "clients/evaluation/explanation.hpp"
#include "clients/evaluation/offline_reconstruction.hpp"
#include "clients/evaluation/statistics.hpp"

namespace tubed {

namespace {

double p95_of(const RegisteredImage& image) { return quantile(image.distance_px, 0.95); }

ProjectedTube project(const Camera& camera, const Eigen::Matrix3Xd& points_world_mm) {
  ProjectedTube tube;
  for (const auto& p_world_mm : points_world_mm.colwise()) {
    if (const auto projection = camera.project(p_world_mm)) {
      tube.centreline_px.push_back(projection->p_image_px);
    }
  }
  return tube;
}

/// Median over the points before the camera; 0: there is none.
double width_px(const Camera& camera, const Eigen::Matrix3Xd& points_world_mm, double diameter_mm) {
  std::vector<double> widths_px;
  for (const auto& p_world_mm : points_world_mm.colwise()) {
    if (const auto projection = camera.project(p_world_mm)) {
      widths_px.push_back(camera.calibration().fx * diameter_mm / projection->depth_mm);
    }
  }
  return widths_px.empty() ? 0 : quantile(widths_px, 0.5);
}

std::string row_of(const RegisteredImage& image) {
  std::array<char, 160> text{};
  std::snprintf(text.data(), text.size(), "%5u %-6s %10.2f %8.2f %8.0f %%  ", image.frame,
                image.camera.c_str(), quantile(image.distance_px, 0.5), p95_of(image),
                100 * static_cast<double>(image.agreeing));
  return text.data() + std::string(name_of(image.validity)) + ' ' + names_of(image.reasons) + '\n';
}

}  // namespace

std::vector<RegistrationMethod> registration_methods() {
  std::vector<RegistrationMethod> methods;
  for (const auto& [form, name] : kImageLikelihoodForms) {
    RegistrationMethod& method = methods.emplace_back();
    method.name = name;
    method.settings.mode = EstimatorMode::kJoint;
    method.settings.image_likelihood = form;
  }
  RegistrationMethod& paper = methods.emplace_back();
  paper.name = "paper";
  paper.settings.mode = EstimatorMode::kPaper;
  paper.settings.paper.mle_start = PaperMleStart::kEm;
  return methods;
}

std::vector<RegisteredImage> register_images(const Sequence& sequence, const EstimatorSettings& settings,
                                             const FrangiSettings& frangi) {
  if (sequence.truth.empty()) {
    throw std::runtime_error(sequence.folder.string() +
                             " has no truth.csv to compare with; name one image with --image");
  }
  std::vector<RegisteredImage> images;
  const auto add = [&](const SequenceFrame& row, const TubeEstimate& estimate) {
    const SequenceTruth* truth = find_truth(sequence, row.frame);
    if (truth == nullptr) {
      return;
    }
    const Camera camera(camera_of(sequence, row));
    RegisteredImage image{row.frame,        camera.calibration().name,   estimate.validity,
                          estimate.reasons, estimate.image_inlier_ratio, {}};
    image.width_px = width_px(camera, truth->points_world_mm, sequence.room.instruments.front().diameter_mm);
    image.distance_px = distances_px(project(camera, estimate), project(camera, truth->points_world_mm),
                                     camera.calibration());
    if (!image.distance_px.empty()) {
      images.push_back(std::move(image));
    }
  };
  const auto estimator = make_estimator(settings, sequence.room.instruments.front(), sequence.room);
  const auto estimate = std::make_unique<TubeEstimate>();
  observe_in_turn(sequence, Images::kMeasured, frangi,
                  [&](const SequenceInstant& instant, const Observation& observation, auto&&...) {
                    estimator->reset();
                    estimator->estimate(observation, *estimate);
                    for (const std::size_t row : instant.rows) {
                      const SequenceFrame& frame = sequence.frames[row];
                      const auto* image = observation.images[static_cast<std::size_t>(frame.camera)];
                      if (image != nullptr && image->state == ImageState::kMeasured) add(frame, *estimate);
                    }
                    return true;
                  });
  return images;
}

RegistrationSummary summary_of(const std::vector<RegisteredImage>& images) {
  RegistrationSummary summary;
  summary.images = images.size();
  std::vector<double> all_px;
  for (const RegisteredImage& image : images) {
    all_px.insert(all_px.end(), image.distance_px.begin(), image.distance_px.end());
    const bool off = p95_of(image) > std::max(kCaptured_px, image.width_px / 2);
    summary.captured += off ? 1 : 0;
    summary.flagged += off && image.validity != Validity::kValid ? 1 : 0;
  }
  if (!all_px.empty()) {
    summary.median_px = quantile(all_px, 0.5);
    summary.p95_px = quantile(all_px, 0.95);
  }
  return summary;
}

std::string table_of(std::vector<RegisteredImage> images, std::size_t max_rows) {
  std::stable_sort(images.begin(), images.end(),
                   [](const RegisteredImage& a, const RegisteredImage& b) { return p95_of(a) > p95_of(b); });
  std::string table = "frame camera  median px  95 % px  agreeing  validity\n";
  for (std::size_t i = 0; i < std::min(max_rows, images.size()); ++i) {
    table += row_of(images[i]);
  }
  return table;
}

}  // namespace tubed
