#include "clients/calibration/tube_sightings.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>

#include "clients/evaluation/estimate_rows.hpp"
#include "clients/evaluation/offline_reconstruction.hpp"
#include "daemon/image/measured_view.hpp"
#include "daemon/image/projected_lines.hpp"
#include "daemon/image/tube_end.hpp"
#include "daemon/image/vesselness_meter.hpp"
#include "idl/geometry/image_mask.hpp"

namespace tubed {

namespace {

constexpr double kBesideCoil_mm = 6;
constexpr double kMinAgreeing = 0.5;  // share of the lines beside a coil
constexpr double kBeyondTip_px = 34;  // that is filtered around the tip
constexpr int kEndOutside_px = 30;    // how far beyond the expected end is looked
constexpr int kEndLines = 12;         // in view, to look for the end

/// The tube as coils alone have it, and the lines across it in one image.
struct Lines {
  explicit Lines(double length_mm) : layout(length_mm) {}
  LineLayout layout;
  CorrespondenceLines lines;
  LineSearch search;

  [[nodiscard]] const CorrespondenceLine& at(int line) const { return lines[static_cast<std::size_t>(line)]; }
  [[nodiscard]] Eigen::Vector2d found(int line) const {
    return at(line).base_px + at(line).offset_px * at(line).normal;
  }
};

/// Only the images of one camera, their stamps corrected.
Sequence images_of(const Sequence& sequence, const SightingSearch& search, std::vector<std::size_t>& rows) {
  Sequence images = sequence;
  images.frames.clear();
  for (std::size_t i = 0; i < sequence.frames.size(); ++i) {
    const SequenceFrame& frame = sequence.frames[i];
    if (frame.camera == search.camera && frame.fluoroscopy_on()) {
      images.frames.push_back(frame);
      images.frames.back().t_s -= search.offset_s;
      rows.push_back(i);
    }
  }
  return images;
}

std::optional<TubeSighting> beside_coil(const Lines& lines, double s_mm) {
  int asked = 0, agreeing = 0, nearest = -1;
  double offset_px = 0;
  for (int i = 0; i < lines.layout.count; ++i) {
    const double away_mm = std::abs(lines.layout.s_mm(i) - s_mm);
    if (away_mm > kBesideCoil_mm || !lines.at(i).in_view) continue;
    ++asked;
    if (!lines.at(i).agrees) continue;
    ++agreeing;
    offset_px += lines.at(i).offset_px;
    if (nearest < 0 || away_mm < std::abs(lines.layout.s_mm(nearest) - s_mm)) nearest = i;
  }
  constexpr int kMinLines = 3;
  if (agreeing < kMinLines || agreeing < kMinAgreeing * asked) return std::nullopt;
  TubeSighting seen;
  seen.direction = lines.at(nearest).normal;
  seen.p_image_px = lines.at(nearest).base_px + offset_px / agreeing * seen.direction;
  return seen;
}

/// The end, on the path that the lines have found; as TubeViews looks for it, and further.
std::optional<TubeSighting> end_of(const ImageMeasurement& image, const Camera& camera, const Lines& lines,
                                   float ridge_height) {
  std::array<Eigen::Vector2d, kEndLines> found_px;
  for (int i = 0; i < kEndLines; ++i) {
    if (i >= lines.layout.count || !lines.at(i).in_view) return std::nullopt;
    found_px[static_cast<std::size_t>(i)] = lines.found(i);
  }
  const auto path = EndPath::over(found_px, lines.layout.spacing_mm, kEndOutside_px);
  if (!path) return std::nullopt;
  if (std::ranges::any_of(path->points_px(), [&](const Eigen::Vector2d& p_px) {
        return is_masked(camera.calibration(), p_px);
      })) {
    return std::nullopt;
  }
  const auto ridge_end = find_tube_end(image, path->points_px(), ridge_height);
  if (!ridge_end) return std::nullopt;
  const auto end =
      sharpened(*ridge_end, image, path->points_px(), lines.at(0).half_width_px).value_or(*ridge_end);
  constexpr double kMaxVariance_px2 = 16;
  if (end.variance > kMaxVariance_px2) return std::nullopt;
  TubeSighting seen;
  seen.is_end = true;
  seen.p_image_px = path->at(end.place);
  seen.direction = path->outward();
  return seen;
}

}  // namespace

std::vector<TubeSighting> sight_tube(const ConfiguredSequence& run, const SightingSearch& search) {
  std::vector<std::size_t> rows;
  const Sequence images = images_of(run.sequence, search, rows);
  const InstrumentDescription& instrument = images.room.instruments.front();
  EstimatorSettings settings = run.estimator;
  settings.mode = EstimatorMode::kEm;
  const auto estimator = make_estimator(settings, instrument, images.room);
  const auto estimate = std::make_unique<TubeEstimate>();
  const auto lines = std::make_unique<Lines>(instrument.length_mm);
  std::vector<TubeSighting> sightings;
  const auto look = [&](std::size_t row, ImageMeasurement& image, ImageOnDemand& on_demand) {
    // As its images are measured.
    const CameraCalibration of_detector = camera_of(images, images.frames[row]);
    const int binning =
        binning_of(images.room.cameras[static_cast<std::size_t>(search.camera)], images.room.instruments);
    const Camera camera(binned(of_detector, binning));
    const UniformCubicBSpline spline(static_cast<int>(estimate->coefficient_count),
                                     static_cast<double>(estimate->length_mm));
    project_lines(camera, spline, coefficients_of(*estimate), lines->layout, instrument.diameter_mm / 2,
                  lines->lines);
    ImageArea area(image.width, image.height);
    add_lines(lines->lines, lines->layout, search.reach_px, kBeyondTip_px, area);
    on_demand.filter_missing(image, area);
    drop_blind_lines(image, lines->layout, search.reach_px, lines->lines);
    const auto outcome =
        lines->search.search(image, lines->lines, lines->layout.count, search.reach_px, kLineTransition_px);
    const auto add = [&](std::optional<TubeSighting> seen, std::size_t coil) {
      if (!seen) return;
      seen->t_s = run.sequence.frames[rows[row]].t_s;
      seen->frame = rows[row];
      seen->coil = coil;
      seen->p_image_px = unbinned_px(seen->p_image_px, binning);
      sightings.push_back(*seen);
    };
    for (std::size_t k = 0; k < instrument.coils.size(); ++k) {
      add(beside_coil(*lines, instrument.coils[k].offset_from_tip_mm), k);
    }
    add(end_of(image, camera, *lines, outcome.ridge_height), 0);
  };
  observe_in_turn(
      images, Images::kMeasured, run.frangi,
      [&](const SequenceInstant& instant, const Observation& observation, AreaPredictions& next) {
        estimator->estimate(observation, *estimate);
        next.add(*estimator, *estimate);
        const auto camera = static_cast<std::size_t>(search.camera);
        ImageMeasurement* const image = observation.images[camera];
        if (image != nullptr && image->state == ImageState::kMeasured && estimate->coefficient_count >= 4) {
          look(instant.rows.front(), *image, *observation.on_demand[camera]);
        }
        return true;
      },
      run.max_image_timeout);
  return sightings;
}

}  // namespace tubed
