#include "clients/calibration/camera_words.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>

#include "idl/geometry/degree.hpp"

namespace tubed {

namespace {

using Statements = std::vector<CameraStatement>;

constexpr double kMuchClipped = 0.2;  // of the pixels

std::string of(std::size_t part, std::size_t whole) {
  return std::to_string(part) + " of " + std::to_string(whole);
}

std::string percent(double share, int count = 0) { return decimals(100 * share, count) + " %"; }

void say_points(const CameraFindings& findings, Statements& statements) {
  for (const CalibratedImage& image : findings.images) {
    if (3 * image.matched < 2 * image.in_image) {
      statements.push_back(
          {ReportVerdict::kDoubtful, image.name + ": only " + of(image.matched, image.in_image) +
                                         " balls that have to be in the image were found and fit; "
                                         "is it the phantom of this file, and is nothing before it?"});
    }
    if (image.clipped_share > kMuchClipped) {
      statements.push_back(
          {ReportVerdict::kDoubtful, image.name + ": " + percent(image.clipped_share) +
                                         " of the pixels have the least or greatest value; take it "
                                         "again with less dose or a wider window"});
    }
  }
}

void say_left_out(const CameraFindings& findings, Statements& statements) {
  std::map<std::size_t, int> times;
  for (const LeftOutPoint& out : findings.chosen.left_out) ++times[out.point.point];
  for (const auto& [point, count] : times) {
    if (2 * count > static_cast<int>(findings.images.size()) && findings.images.size() > 1) {
      statements.push_back(
          {ReportVerdict::kDoubtful, findings.point_names[point] + " does not fit in " +
                                         of(static_cast<std::size_t>(count), findings.images.size()) +
                                         " images: its place in the phantom's file is wrong, or it moved"});
    }
  }
}

void say_residual(const CameraFindings& findings, Statements& statements) {
  constexpr double kMaxGood_px = 0.5;
  const double rms_px = findings.chosen.fit.rms_px;
  statements.push_back({rms_px <= kMaxGood_px ? ReportVerdict::kGood : ReportVerdict::kDoubtful,
                        "points lie " + decimals(rms_px, 2) + " px (RMS) from where they project" +
                            (rms_px <= kMaxGood_px ? "" : ": more than a detector's geometry leaves")});
  const ResidualPattern& pattern = findings.pattern;
  if (pattern.has_s_distortion()) {
    statements.push_back(
        {ReportVerdict::kDoubtful, "residuals turn with the distance from the middle, " +
                                       decimals(std::abs(pattern.s_distortion_px), 1) +
                                       " px at the rim: S distortion of an image intensifier, which the "
                                       "configuration's distortion cannot express"});
  } else if (pattern.is_systematic()) {
    statements.push_back(
        {ReportVerdict::kDoubtful, "residuals are systematic: neighbours err alike (correlation " +
                                       decimals(pattern.neighbour_correlation, 2) + ", chance stays below " +
                                       decimals(pattern.correlation_limit, 2) +
                                       "), so that the image is bent otherwise than k1 k2 p1 p2 k3 can"});
  }
}

void say_focal(const CameraFindings& findings, Statements& statements) {
  const CameraFit& fit = findings.chosen.fit;
  if (!findings.chosen.model.focal) {
    statements.push_back(
        {ReportVerdict::kGood, "focal length held at " + decimals(fit.intrinsics.fx, 1) + " px"});
    return;
  }
  constexpr double kMaxGood = 0.005;
  const double sigma = fit.sigma_of(0) / fit.intrinsics.fx;
  statements.push_back(
      {sigma < kMaxGood ? ReportVerdict::kGood : ReportVerdict::kDoubtful,
       "focal length " + decimals(fit.intrinsics.fx, 1) + " px, standard deviation " + percent(sigma, 2) +
           (sigma < kMaxGood ? ""
                             : ": the phantom is too shallow, or the views too much alike, to "
                               "tell focal length from distance")});
}

/// Focal length, pitch and distance say the same when two of them are given.
void say_distances(const CameraFindings& findings, Statements& statements) {
  const CameraSettings& settings = findings.settings;
  const CameraFit& fit = findings.chosen.fit;
  if (!settings.pixel_pitch_mm) return;
  const double distance_mm = fit.intrinsics.fx * *settings.pixel_pitch_mm;
  if (!settings.source_detector_mm) {
    statements.push_back({ReportVerdict::kGood, "with pixels of " + decimals(*settings.pixel_pitch_mm, 3) +
                                                    " mm the source is " + decimals(distance_mm, 0) +
                                                    " mm from the detector"});
    return;
  }
  const double factor = distance_mm / *settings.source_detector_mm;
  constexpr double kTolerance = 0.02;
  if (std::abs(factor - 1) < kTolerance) {
    statements.push_back({ReportVerdict::kGood, "source to detector " + decimals(distance_mm, 0) +
                                                    " mm, as given within " +
                                                    percent(std::abs(factor - 1), 1)});
    return;
  }
  const double pitch_mm = *settings.source_detector_mm / fit.intrinsics.fx;
  statements.push_back(
      {ReportVerdict::kBad,
       "the image asks for source_detector_mm / pixel_pitch_mm = " + decimals(fit.intrinsics.fx, 0) +
           ", given is " + decimals(fit.intrinsics.fx / factor, 0) + "; consistent would be a pitch of " +
           decimals(pitch_mm, 3) + " mm (zoom, binning, or a pitch at the isocentre?) or a distance of " +
           decimals(distance_mm, 0) + " mm; which of them is wrong, the image cannot tell"});
}

void say_principal_point(const CameraFindings& findings, Statements& statements) {
  const ChosenFit& chosen = findings.chosen;
  const double sigma_px = std::max(chosen.fit.sigma_of(2), chosen.fit.sigma_of(3));
  if (chosen.is_principal_point_held) {
    statements.push_back({ReportVerdict::kGood,
                          "the principal point cannot be seen from these images and is held at the "
                          "image's middle, taken for within " +
                              decimals(*chosen.model.principal_sigma_px, 1) + " px"});
  } else if (chosen.principal_offset_in_sigmas > 3.5) {
    statements.push_back(
        {ReportVerdict::kDoubtful,
         "the principal point is " +
             decimals(chosen.principal_offset_in_sigmas * *chosen.model.principal_sigma_px, 0) +
             " px from the image's middle: is the image cropped or collimated "
             "to one side?"});
  } else {
    statements.push_back({ReportVerdict::kGood, "principal point " + decimals(chosen.fit.intrinsics.cx, 1) +
                                                    ", " + decimals(chosen.fit.intrinsics.cy, 1) +
                                                    " px, standard deviation " + decimals(sigma_px, 1) +
                                                    " px"});
  }
}

void say_distortion(const CameraFindings& findings, Statements& statements) {
  const IntrinsicsModel& model = findings.chosen.model;
  if (model.distortion_terms == 0) {
    statements.push_back({ReportVerdict::kGood, "no distortion that is significant: left at 0"});
    return;
  }
  const double covered = covered_share(findings.chosen, findings.width, findings.height);
  constexpr double kMinCovered = 0.4;
  statements.push_back(
      {covered > kMinCovered ? ReportVerdict::kGood : ReportVerdict::kDoubtful,
       "distortion, up to " + decimals(findings.distortion_px, 1) + " px in the image; points cover " +
           percent(covered) + " of it" +
           (covered > kMinCovered ? ""
                                  : ", beyond them it is a guess: move the phantom through the "
                                    "whole image")});
}

void say_directions(const CameraFindings& findings, Statements& statements) {
  const auto& views = findings.chosen.fit.views;
  if (views.size() < 2) return;
  double widest = 0;
  for (const FittedView& view : views) {
    const Eigen::Matrix3d turn =
        views.front().T_camera_world.linear().transpose() * view.T_camera_world.linear();
    widest = std::max(widest, Eigen::AngleAxisd(turn).angle() / kDegree);
  }
  constexpr double kMinApart_deg = 10;
  if (widest < kMinApart_deg) {
    statements.push_back(
        {ReportVerdict::kDoubtful, "all images are from one direction, within " + decimals(widest, 1) +
                                       " deg: they are little more than one; turn the C-arm or the phantom "
                                       "by 30 deg or more in between"});
  }
}

void say_mirrored(const CameraFindings& findings, Statements& statements) {
  if (findings.mirrored != findings.settings.mirrored) {
    statements.push_back(
        {ReportVerdict::kDoubtful,
         findings.mirrored
             ? "the phantom is seen in its mirror image: the images come as seen from the detector, "
               "and mirrored = true is offered; or the phantom's file has left-handed coordinates, one axis "
               "of the wrong sign or two exchanged: look which side of the phantom an image shows"
             : "the phantom is not mirrored although mirrored = true was given: mirrored = false is "
               "offered"});
  }
}

/// Widths say whether diameters and places are in one unit.
void say_sizes(const CameraFindings& findings, Statements& statements) {
  std::vector<double> factors;
  for (std::size_t i = 0; i < findings.images.size(); ++i) {
    const RigidTransform& pose = findings.chosen.fit.views[i].T_camera_world;
    for (const CameraPoint& point : findings.chosen.views[i].points) {
      for (const FoundBall& ball : findings.images[i].found) {
        if ((ball.p_image_px - point.p_image_px).norm() < 1e-9) {
          const double expected_px =
              2 * point.radius_mm * findings.chosen.fit.intrinsics.fx / (pose * point.p_world_mm).z();
          factors.push_back(ball.diameter_px / expected_px);
        }
      }
    }
  }
  if (factors.empty()) return;
  std::nth_element(factors.begin(), factors.begin() + static_cast<std::ptrdiff_t>(factors.size() / 2),
                   factors.end());
  const double factor = factors[factors.size() / 2];
  if (factor < 0.8 || factor > 1.2) {
    statements.push_back(
        {ReportVerdict::kDoubtful, "shadows are " + decimals(factor, 2) +
                                       " times as wide as the phantom's file says: are diameters and "
                                       "places from the same drawing?"});
  }
}

/// The image alone does not tell a large phantom far away from a small one near by; nobody radiographs the
/// latter.
void say_units(const CameraFindings& findings, Statements& statements) {
  if (findings.images.front().found.empty()) return;  // a board before an optical camera
  constexpr double kMinDepth_mm = 200;
  constexpr double kMaxDepth_mm = 3000;
  const double depth_mm = findings.chosen.fit.views.front().pivot_depth_mm;
  if (depth_mm < kMinDepth_mm || depth_mm > kMaxDepth_mm) {
    statements.push_back(
        {ReportVerdict::kBad,
         "the phantom would stand " + decimals(depth_mm, 0) +
             " mm from the source: the phantom's file is not in mm (cm: multiply by 10, inches: "
             "by 25.4)"});
  }
}

const char* reading_that_fits(const CameraFindings& findings, double rms_turn_deg) {
  for (const AngleReading& reading : other_readings()) {
    std::vector<GantryAngles> angles;
    for (const GantryAngles& given : findings.settings.angles) angles.push_back(reading.read(given));
    const auto fit = fit_c_arm(findings.chosen.fit, angles, {1, findings.settings.source_isocentre_mm});
    if (fit && fit->rms_turn_deg < 0.3 * rms_turn_deg && fit->rms_turn_deg < 3) return reading.words;
  }
  return nullptr;
}

void say_c_arm(const CameraFindings& findings, Statements& statements) {
  if (findings.settings.angles.empty()) return;
  if (!findings.settings.pixel_pitch_mm) {
    statements.push_back(
        {ReportVerdict::kDoubtful, "angles were given, but no --pitch: without it there is no C-arm model"});
    return;
  }
  if (!findings.c_arm) {
    statements.push_back(
        {ReportVerdict::kDoubtful,
         "one direction does not tell the isocentre's distance from where the world lies: give "
         "images at angles 30 deg or more apart, or --source-isocentre"});
    return;
  }
  constexpr double kMaxTurn_deg = 1;
  constexpr double kMaxShift_mm = 5;
  const CArmFit& fit = *findings.c_arm;
  const bool is_good = fit.rms_turn_deg < kMaxTurn_deg && fit.rms_shift_mm < kMaxShift_mm;
  std::string words = "the angles explain the poses to " + decimals(fit.rms_turn_deg, 2) + " deg and " +
                      decimals(fit.rms_shift_mm, 1) + " mm (RMS), source to isocentre " +
                      decimals(fit.c_arm.source_isocentre_mm, 1) + " mm";
  if (!is_good) {
    const char* const reading = reading_that_fits(findings, fit.rms_turn_deg);
    words += reading != nullptr ? std::string("; they fit as ") + reading
                                : std::string("; are the angles those of these images, in their order?");
  }
  statements.push_back({is_good ? ReportVerdict::kGood : ReportVerdict::kBad, words});
}

void say_configured(const CameraFindings& findings, Statements& statements) {
  if (!findings.settings.configured || findings.c_arm) return;
  const RigidTransform& before = findings.settings.configured->T_camera_world;
  const RigidTransform& now = findings.chosen.fit.views.front().T_camera_world;
  const Eigen::Matrix3d turn = before.linear().transpose() * now.linear();
  const double turn_deg = Eigen::AngleAxisd(turn).angle() / kDegree;
  constexpr double kOpposite_deg = 150;
  if (turn_deg > kOpposite_deg) {
    statements.push_back(
        {ReportVerdict::kDoubtful, "the view is turned by " + decimals(turn_deg, 0) +
                                       " deg against the configured one: does the phantom lie upside "
                                       "down, or the other way round, in the world?"});
  }
}

}  // namespace

std::string size_words(int width, int height) {
  return std::to_string(width) + " x " + std::to_string(height) + " px";
}

std::string decimals(double value, int count) {
  std::ostringstream text;
  text << std::fixed << std::setprecision(count) << value;
  return text.str();
}

std::string too_few_balls(const CalibrationPicture& picture, std::size_t found, const BallPhantom& phantom) {
  std::string words = picture.name + ": " + std::to_string(found) + " balls found, \"" + phantom.name +
                      "\" has " + std::to_string(phantom.balls.size()) + " and 6 are needed at least";
  if (picture.clipped_share() > kMuchClipped) {
    return words + "; " + percent(picture.clipped_share()) +
           " of the pixels have the least or greatest value: the image is saturated, take it with less dose "
           "or a "
           "wider window";
  }
  return words +
         "; is the phantom in the image? Balls have to be 3 to 40 px wide and stand apart; with more dose, "
         "or an "
         "average of several images, small ones stand out";
}

std::string not_recognised(const CalibrationPicture& picture, const std::vector<FoundBall>& found,
                           const BallPhantom& phantom, const std::optional<PhantomMatch>& match,
                           const std::optional<PhantomMatch>& unsized) {
  std::string words = picture.name + ": " + std::to_string(found.size()) +
                      " discs found, but no pose shows \"" + phantom.name + "\" (" +
                      std::to_string(phantom.balls.size()) + " balls) there";
  if (unsized && unsized->is_certain()) {
    std::vector<double> factors;
    for (const MatchedBall& pair : unsized->pairs) {
      const PhantomBall& ball = phantom.balls[pair.ball];
      const double depth_mm = (unsized->T_camera_phantom * ball.p_phantom_mm).z();
      factors.push_back(found[pair.found].diameter_px * depth_mm / unsized->intrinsics.fx / ball.diameter_mm);
    }
    std::sort(factors.begin(), factors.end());
    const double factor = factors[factors.size() / 2];
    words +=
        "; places fit, but shadows are " + decimals(factor, factor < 0.1 ? 3 : 1) +
        " times as wide as the file's diameters: are places and diameters in the same unit (1 inch is 25.4 "
        "mm)?";
    return words;
  }
  if (match) {
    words += "; the best explains " + of(match->pairs.size(), match->in_image);
  }
  if (picture.clipped_share() > kMuchClipped) {
    words += "; " + percent(picture.clipped_share()) + " of the pixels are saturated";
  }
  return words + "; is the file that of this phantom, and is nothing else in the image?";
}

std::vector<CameraStatement> statements_of(const CameraFindings& findings) {
  Statements statements;
  say_mirrored(findings, statements);
  say_focal(findings, statements);
  say_residual(findings, statements);
  say_principal_point(findings, statements);
  say_distortion(findings, statements);
  say_distances(findings, statements);
  say_c_arm(findings, statements);
  say_points(findings, statements);
  say_left_out(findings, statements);
  say_units(findings, statements);
  say_sizes(findings, statements);
  say_directions(findings, statements);
  say_configured(findings, statements);
  std::stable_sort(statements.begin(), statements.end(),
                   [](const CameraStatement& a, const CameraStatement& b) {
                     return static_cast<int>(a.verdict) > static_cast<int>(b.verdict);
                   });
  return statements;
}

}  // namespace tubed
