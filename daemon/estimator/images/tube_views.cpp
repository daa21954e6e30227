#include "daemon/estimator/images/tube_views.hpp"

#include <algorithm>
#include <cmath>

#include "daemon/image/measured_view.hpp"
#include "daemon/image/predicted_lines.hpp"
#include "daemon/image/tube_end.hpp"
#include "daemon/image/vesselness_meter.hpp"
#include "idl/geometry/image_mask.hpp"
#include "idl/geometry/squared.hpp"

namespace tubed {

namespace {

// Noise agrees with 0.62 of 8 to 16 lines in one image of 5, of 24 to 32 in one of 16, of 80 in one of 100.
constexpr int kMinLinesNotByChance = 40;
constexpr double kMinSurprising = 0.6;     // share of the lines of a view that may surprise
constexpr int kEndInside = 12;             // lines of the tip that must be in view to look for its end
constexpr int kEndOutside_px = 20;         // how far beyond the expected tip is looked
constexpr double kSigmaEnd_px = 3.0;       // of the end beside its own variance
constexpr double kSameEnd_px = 4;          // of ridge and greys: a ridge filter goes on for up to 3 px
constexpr double kOneInstant_s = 0.002;    // within which exposures of several views are one
constexpr double kLineAgeing_mm_s = 20.0;  // how fast an aged image line loses its worth

constexpr double kTwoSides_rad = 10 * M_PI / 180;

// An edge of bone that goes on where the tube ends carries the ridge on, and no step in grey.
bool is_confirmed(const Eigen::Vector2d& ridge_end_px, const std::optional<LineConstraint>& end_by_greys) {
  return end_by_greys && (end_by_greys->target_px - ridge_end_px).norm() < kSameEnd_px;
}

// A line where vesselness is not to be had, or where no tube could be seen, is not in view. How many there
// were.
int leave_out_unreadable(const ImageMeasurement& image, const LineLayout& layout, int reach_px,
                         CorrespondenceLines& lines) {
  const int unmeasured =
      drop_unmeasured_lines(image.measured, layout, reach_px, TubeViews::kBeyondTip_px, lines);
  return unmeasured + drop_blind_lines(image, layout, reach_px, lines);
}

}  // namespace

const ViewConstraints* view_of_tip(std::span<const ViewConstraints> views) {
  const auto nearest = std::min_element(views.begin(), views.end(), [](const auto& a, const auto& b) {
    return a.lines[0].s_mm < b.lines[0].s_mm;  // lines begin at the tip
  });
  return nearest != views.end() ? &*nearest : nullptr;
}

bool are_two_sides(const Eigen::Vector3d& sight_a_world, const Eigen::Vector3d& sight_b_world) {
  return sight_a_world.cross(sight_b_world).norm() > std::sin(kTwoSides_rad);
}

bool show_tip_from_two_sides(std::span<const ViewConstraints> views, double loose_mm) {
  const auto shows_tip = [=](const ViewConstraints& view) { return view.lines[0].s_mm < loose_mm / 2; };
  const auto sight_world = [](const ViewConstraints& view) -> Eigen::Vector3d {
    return view.camera->calibration().T_camera_world.linear().row(2).transpose();
  };
  for (std::size_t a = 0; a < views.size(); ++a) {
    for (std::size_t b = 0; b < a; ++b) {
      if (shows_tip(views[a]) && shows_tip(views[b]) &&
          are_two_sides(sight_world(views[a]), sight_world(views[b]))) {
        return true;
      }
    }
  }
  return false;
}

TubeViews::TubeViews(const EstimatorSettings& settings, const InstrumentDescription& instrument,
                     const RoomDescription& room)
    : settings_(settings),
      layout_(instrument.length_mm),
      radius_mm_(instrument.diameter_mm / 2),
      marks_(instrument.marks_mm, instrument.mark_length_mm) {
  for (const CameraCalibration& calibration : room.cameras) {
    views_.push_back(View{Camera(calibration), make_image_likelihood(settings.image_likelihood)});
    areas_.emplace_back(calibration.width, calibration.height);
  }
}

void TubeViews::look_from(const Observation& observation) {
  for (std::size_t v = 0; v < views_.size(); ++v) {
    const ImageMeasurement* image = observation.images[v];
    if (image != nullptr && image->state == ImageState::kMeasured) {
      views_[v].camera.look_from(image->geometry);
      views_[v].pose_sigma = image->geometry ? image->geometry->sigma : PoseSigma{};
      views_[v].own_pose = image->brought_geometry;
    }
  }
}

bool TubeViews::measure(const Observation& observation, const UniformCubicBSpline& spline,
                        const Eigen::Matrix3Xd& C, const TubeSearch& search, TubeEstimate& estimate) {
  bool looked = false;
  look_from(observation);
  estimate.has_image = false;
  estimate.image_inlier_ratio = 0;
  estimate.in_view_ratio = 0;
  for (std::size_t v = 0; v < views_.size(); ++v) {
    ImageMeasurement* image = observation.images[v];
    if (image == nullptr || image->state != ImageState::kMeasured) {
      continue;
    }
    View& view = views_[v];
    int in_view = project_lines(view.camera, spline, C, layout_, radius_mm_, lines_);
    if (search.prediction != nullptr) {
      predict_lines(view.camera, spline, *search.prediction, layout_, lines_);
    }
    in_view -= leave_out_before(search.from_mm, layout_, lines_);
    in_view -= leave_out_beyond(search.to_mm, layout_, lines_);
    if (observation.on_demand[v] != nullptr) {
      filter_around_lines(*observation.on_demand[v], *image, areas_[v], search.reach_px);
    }
    in_view -= leave_out_unreadable(*image, layout_, search.reach_px, lines_);
    measure_view(*image, view, in_view, search);
    looked = true;
    estimate.has_image = estimate.has_image || view.count > 0;
    estimate.image_inlier_ratio =
        std::max(estimate.image_inlier_ratio, static_cast<float>(view.inlier_ratio));
    estimate.in_view_ratio = std::max(estimate.in_view_ratio, static_cast<float>(view.in_view_ratio));
  }
  return looked;
}

// The second Frangi of this image: what is going to be read and was not foreseen.
void TubeViews::filter_around_lines(ImageOnDemand& on_demand, ImageMeasurement& image, ImageArea& area,
                                    int reach_px) {
  area.clear();
  add_lines(lines_, layout_, reach_px, kBeyondTip_px, area);
  on_demand.filter_missing(image, area);
}

void TubeViews::measure_view(const ImageMeasurement& image, View& view, int in_view,
                             const TubeSearch& search) {
  view.count = 0;
  view.end_by_greys.reset();
  view.exposure = image.exposure;
  view.in_view_ratio = static_cast<double>(in_view) / layout_.count;
  view.inlier_ratio = 0;
  view.tip = {};
  view.surprise = {};
  view.lines_asked = in_view < kMinLines ? 0 : in_view;
  if (view.lines_asked == 0) {
    return;
  }
  const LineSearch::Outcome outcome =
      view.likelihood->find(image, lines_, layout_.count, search.reach_px, search.among);
  view.inlier_ratio = outcome.inlier_ratio;
  view.tip = {tubed::misses_tip(lines_, layout_), tubed::unseen_at_tip(lines_, layout_)};
  if (search.prediction != nullptr) {
    view.surprise = surprise_of(lines_, layout_, settings_.sigma_image_px, radius_mm_);
  }
  if (view.inlier_ratio < kMinFound) {
    return;
  }
  view.seen.record({lines_.data(), static_cast<std::size_t>(layout_.count)}, layout_.spacing_mm);
  for (int i = 0; i < layout_.count; ++i) {
    const CorrespondenceLine& line = lines_[static_cast<std::size_t>(i)];
    if (line.in_view) {
      const double variance =
          (line.variance_px2 + settings_.sigma_image_px * settings_.sigma_image_px) * settings_.image_temper;
      view.measured[static_cast<std::size_t>(view.count++)] = {
          layout_.s_mm(i), line.base_px + line.offset_px * line.normal, line.normal, variance};
    }
  }
  if (search.asks_marks) {
    const auto room = std::span(view.measured).subspan(static_cast<std::size_t>(view.count));
    view.count += marks_.measure(image, {lines_, layout_}, room);
  }
  measure_end(image, view, outcome.ridge_height, search.tip_is_held);
}

Surprise TubeViews::surprise(MonotonicTime instant) const {
  Surprise surprise;
  for (const View& view : views_) {
    const bool is_shown = view.exposure == instant && view.inlier_ratio >= kMinSurprising;
    if (is_shown) surprise.join(view.surprise);
  }
  return surprise;
}

int TubeViews::unseen_at_tip(MonotonicTime instant) const {
  int most = 0;
  for (const View& view : views_) {
    if (view.exposure == instant) most = std::max(most, view.tip.unseen);
  }
  return most;
}

bool TubeViews::may_agree_by_chance(MonotonicTime instant) const {
  return std::ranges::none_of(views_, [instant](const View& view) {
    return view.exposure == instant && view.lines_asked >= kMinLinesNotByChance;
  });
}

bool TubeViews::misses_tip(MonotonicTime instant) const {
  bool misses = false;
  for (const View& view : views_) {
    if (view.exposure == instant && view.tip.misses) {
      if (!*view.tip.misses) {
        return false;
      }
      misses = true;
    }
  }
  return misses;
}

// The lines say where the tube is across itself only; where its tip ends says where it is along itself. Where
// no coil says that as well it counts for what it is. Otherwise a shape that stops short of the tube's end,
// bends less and is steep for the rest of its length would be the more likely one.
void TubeViews::measure_end(const ImageMeasurement& image, View& view, float ridge_height, bool tip_is_held) {
  std::array<Eigen::Vector2d, kEndInside> found_px;
  for (int i = 0; i < kEndInside; ++i) {
    if (i >= layout_.count || !lines_[static_cast<std::size_t>(i)].in_view) return;
    const CorrespondenceLine& line = lines_[static_cast<std::size_t>(i)];
    found_px[static_cast<std::size_t>(i)] = line.base_px + line.offset_px * line.normal;
  }
  const auto path = EndPath::over(found_px, layout_.spacing_mm, kEndOutside_px);
  if (!path) return;
  const CameraCalibration& camera = view.camera.calibration();
  if (std::ranges::any_of(path->points_px(),
                          [&](const Eigen::Vector2d& p_px) { return is_masked(camera, p_px); })) {
    return;  // a tube that goes behind a mask does not end there
  }
  const auto end = find_tube_end(image, path->points_px(), ridge_height);
  if (!end) return;
  if (const auto step = sharpened(*end, image, path->points_px(), lines_.front().half_width_px)) {
    view.end_by_greys = {0, path->at(step->place), path->outward(), step->variance};
  }
  const Eigen::Vector2d end_px = path->at(end->place);
  if (tip_is_held && !is_confirmed(end_px, view.end_by_greys)) return;
  view.measured[static_cast<std::size_t>(view.count++)] = {
      0, end_px, path->outward(),
      (end->variance + squared(kSigmaEnd_px)) * (tip_is_held ? settings_.image_temper : 1)};
}

bool TubeViews::takes_part(const View& view, const Observation& observation) {
  return view.count > 0 && to_ns(view.exposure) != 0 &&
         std::abs(seconds_between(view.exposure, observation.instant)) <=
             std::chrono::duration<double>(observation.image_timeout).count();
}

bool TubeViews::shows(double s_mm, const Observation& observation) const {
  return std::any_of(views_.begin(), views_.end(),
                     [&](const View& view) { return takes_part(view, observation) && view.seen.at(s_mm); });
}

std::optional<ViewUsed> TubeViews::used(std::size_t view, const Observation& observation) const {
  const View& of = views_[view];
  return takes_part(of, observation) ? std::optional(used_view(view, of.camera.calibration(), of.exposure,
                                                               of.own_pose ? &of.pose_sigma : nullptr))
                                     : std::nullopt;
}

std::span<const ViewConstraints> TubeViews::constraints(const Observation& observation,
                                                        double variance_factor, bool only_of_instant) {
  std::size_t gathered = 0;
  for (View& view : views_) {
    const double age_s = std::abs(seconds_between(view.exposure, observation.instant));
    if (!takes_part(view, observation) || (only_of_instant && age_s > kOneInstant_s)) {
      continue;
    }
    const double pixels_per_mm = view.camera.calibration().fx / 1000.0;
    const double drift_px = kLineAgeing_mm_s * age_s * pixels_per_mm;
    for (std::size_t i = 0; i < static_cast<std::size_t>(view.count); ++i) {
      view.aged[i] = view.measured[i];
      view.aged[i].variance_px2 =
          view.measured[i].variance_px2 * variance_factor + drift_px * drift_px * settings_.image_temper;
    }
    gathered_[gathered++] = {&view.camera,    view.aged.data(),  view.count,
                             view.pose_sigma, view.end_by_greys, &view.seen};
  }
  return {gathered_.data(), gathered};
}

std::optional<double> TubeViews::agreeing(std::size_t view, MonotonicTime instant) const {
  const View& of = views_[view];
  const bool is_of_instant = std::abs(seconds_between(of.exposure, instant)) <= kOneInstant_s;
  return of.lines_asked > 0 && is_of_instant ? std::optional(of.inlier_ratio) : std::nullopt;
}

std::optional<bool> TubeViews::shows_tube(std::size_t view, MonotonicTime instant) const {
  const auto share = agreeing(view, instant);
  const bool may_be_chance = views_[view].lines_asked < kMinLinesNotByChance;
  return share && !may_be_chance ? std::optional(*share >= kMinFound) : std::nullopt;
}

MonotonicTime TubeViews::newest_exposure() const {
  MonotonicTime newest{};
  for (const View& view : views_) {
    newest = view.count > 0 ? std::max(newest, view.exposure) : newest;
  }
  return newest;
}

void TubeViews::trust(const Observation& observation) {
  for (std::size_t v = 0; v < views_.size(); ++v) {
    const ImageMeasurement* image = observation.images[v];
    if (image != nullptr && image->state == ImageState::kMeasured && views_[v].count > 0) {
      views_[v].likelihood->trust(*image);
    }
  }
}

void TubeViews::forget_instant(MonotonicTime instant) {
  for (View& view : views_) {
    if (view.exposure == instant) view.likelihood->distrust();
    view.count = view.exposure == instant ? 0 : view.count;
  }
}

void TubeViews::forget_lines() {
  for (View& view : views_) {
    view.count = 0;
    view.lines_asked = 0;
    view.exposure = MonotonicTime{};
  }
}

void TubeViews::forget() {
  forget_lines();
  marks_.forget();
  for (View& view : views_) {
    view.likelihood->forget();
  }
}

}  // namespace tubed
