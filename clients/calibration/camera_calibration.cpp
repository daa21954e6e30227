#include "clients/calibration/camera_calibration.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "clients/calibration/ball_matching.hpp"
#include "clients/calibration/camera_words.hpp"
#include "clients/calibration/phantom_mistakes.hpp"

namespace tubed {

namespace {

constexpr double kDegrees = 180 / std::numbers::pi;  // in a radian

void check_images(const std::vector<CalibrationPicture>& pictures, const CameraSettings& settings) {
  if (pictures.empty()) throw PhantomError("no image was given");
  const CalibrationPicture& first = pictures.front();
  for (const CalibrationPicture& picture : pictures) {
    if (picture.width != first.width || picture.height != first.height) {
      throw PhantomError(picture.name + ": is " + size_words(picture.width, picture.height) + ", but " +
                         first.name + " is " + size_words(first.width, first.height) +
                         "; give images of one camera in one mode");
    }
  }
  if (settings.configured &&
      (settings.configured->width != first.width || settings.configured->height != first.height)) {
    throw PhantomError(first.name + ": is " + size_words(first.width, first.height) + ", but camera \"" +
                       settings.camera + "\" is configured with " +
                       size_words(settings.configured->width, settings.configured->height) +
                       "; calibrate with images as the daemon gets them, neither scaled nor cropped");
  }
  if (!settings.angles.empty() && settings.angles.size() != pictures.size()) {
    throw PhantomError("angles of " + std::to_string(settings.angles.size()) + " images were given for " +
                       std::to_string(pictures.size()) + " images; give one pair an image, in their order");
  }
}

/// One image and the balls that were named on it.
struct RecognisedImage {
  std::vector<FoundBall> found;
  PhantomMatch match;
  bool mirrored;
};

/// A hint that balls were looked for with the wrong polarity; empty when they were not.
std::string other_polarity(const CalibrationPicture& picture, BallLook look) {
  constexpr std::size_t kMinOthers = 8;
  if (look.polarity == BallLook::Polarity::kEither) return "";
  const bool were_dark = look.polarity == BallLook::Polarity::kDark;
  look.polarity = were_dark ? BallLook::Polarity::kBright : BallLook::Polarity::kDark;
  const std::size_t others = find_balls(picture, look).size();
  return others < kMinOthers ? ""
                             : "; there are " + std::to_string(others) + (were_dark ? " bright" : " dark") +
                                   " ones: give --balls " + (were_dark ? "bright" : "dark");
}

/// The best of the image as it is and mirrored; throws with what is known when neither shows the phantom.
RecognisedImage recognise(const CalibrationPicture& picture, const BallPhantom& phantom,
                          const CameraSettings& settings, const MatchPrior& prior) {
  std::vector<FoundBall> found = find_balls(picture, settings.look);
  if (settings.mirrored) found = mirrored(std::move(found), picture.width);
  constexpr std::size_t kMinFound = 6;
  if (found.size() < kMinFound) {
    throw PhantomError(too_few_balls(picture, found.size(), phantom) +
                       other_polarity(picture, settings.look));
  }
  const auto match = match_balls(found, phantom, picture.width, picture.height, prior);
  const bool is_sure = match && match->is_certain() && 4 * match->pairs.size() >= 3 * match->in_image;
  if (!is_sure) {
    const std::vector<FoundBall> other = mirrored(found, picture.width);
    const auto other_match = match_balls(other, phantom, picture.width, picture.height, prior);
    const std::size_t pairs = match ? match->pairs.size() : 0;
    if (other_match && other_match->is_certain() && 2 * other_match->pairs.size() > 3 * pairs) {
      return {other, *other_match, !settings.mirrored};
    }
  }
  if (!match || !match->is_certain()) {
    MatchPrior any_size = prior;
    any_size.sizes = MatchPrior::Sizes::kIgnored;
    const auto unsized = match_balls(found, phantom, picture.width, picture.height, any_size);
    throw PhantomError(not_recognised(picture, found, phantom, match, unsized));
  }
  if (match->is_ambiguous) {
    throw PhantomError(picture.name + ": the phantom looks the same from two sides, " +
                       std::to_string(match->pairs.size()) +
                       " balls fit either; use one whose large balls stand at uneven places");
  }
  return {std::move(found), *match, settings.mirrored};
}

/// A view with what a better camera finds near each ball.
PointView paired_again(const RecognisedImage& image, const BallPhantom& phantom, const Intrinsics& intrinsics,
                       const RigidTransform& T_camera_world, double near_px) {
  const RigidTransform T_camera_phantom = T_camera_world * phantom.T_world_phantom;
  const auto pairs = pair_up(image.found, phantom, intrinsics, T_camera_phantom, near_px);
  return {points_of(pairs, image.found, phantom), T_camera_world};
}

std::size_t visible(const BallPhantom& phantom, const CameraCalibration& calibration, int width, int height) {
  CameraCalibration sized = calibration;
  sized.width = width;
  sized.height = height;
  const Camera camera(sized);
  std::size_t count = 0;
  for (std::size_t i = 0; i < phantom.balls.size(); ++i) {
    const auto at = camera.project(phantom.p_world_mm(i));
    if (at && camera.contains(at->p_image_px,
                              camera.calibration().fx * phantom.balls[i].diameter_mm / at->depth_mm)) {
      ++count;
    }
  }
  return count;
}

CameraPrior prior_of(const CameraSettings& settings, int width, int height) {
  CameraPrior prior;
  prior.width = width;
  prior.height = height;
  prior.focal_px = settings.focal_px;
  return prior;
}

ChosenFit fit_or_throw(const Intrinsics& first, const std::vector<PointView>& views,
                       const CameraPrior& prior) {
  auto chosen = choose_fit(first, views, prior);
  if (!chosen) {
    throw PhantomError(
        "focal length and pose cannot be told apart from these images; give images from more directions, a "
        "phantom that is deeper, or the focal length with --focal");
  }
  return std::move(*chosen);
}

void explain_with_c_arm(CameraFindings& findings) {
  const CameraSettings& settings = findings.settings;
  if (settings.angles.empty() || !settings.pixel_pitch_mm) return;
  findings.c_arm = fit_c_arm(findings.chosen.fit, settings.angles,
                             {*settings.pixel_pitch_mm, settings.source_isocentre_mm});
}

void judge(CameraFindings& findings) {
  findings.pattern = residual_pattern(findings.chosen);
  findings.distortion_px =
      largest_distortion_px(findings.chosen.fit.intrinsics, findings.width, findings.height);
  explain_with_c_arm(findings);
  findings.statements = statements_of(findings);
}

}  // namespace

bool CameraFindings::is_usable() const {
  return std::none_of(statements.begin(), statements.end(), [](const CameraStatement& statement) {
    return statement.verdict == ReportVerdict::kBad;
  });
}

CameraCalibration CameraFindings::calibration() const {
  CameraCalibration camera = calibration_of(chosen.fit.intrinsics, chosen.fit.views.front().T_camera_world);
  camera.name = settings.camera;
  camera.width = width;
  camera.height = height;
  camera.mirrored = mirrored;
  camera.calibration_residual_px = chosen.fit.rms_px;
  const FittedView& view = chosen.fit.views.front();
  Eigen::Array3d mm2 = view.sigma_mm().array().square();
  Eigen::Array3d deg2 = (view.sigma_rad() * kDegrees).array().square();
  if (c_arm) {
    // The pose will come from angles: they err by what the model leaves of the poses found.
    const auto count = static_cast<double>(c_arm->views.size());
    for (const ExplainedView& explained : c_arm->views) {
      mm2 += explained.shift_mm.array().square() / count;
      deg2 += explained.turn_deg.array().square() / count;
    }
  }
  const Eigen::Array3d mm = mm2.sqrt();
  const Eigen::Array3d deg = deg2.sqrt();
  camera.pose_sigma_mm = {mm.x(), mm.y(), mm.z()};
  camera.pose_sigma_deg = {deg.x(), deg.y(), deg.z()};
  camera.focal_sigma = chosen.fit.sigma_of(0) / chosen.fit.intrinsics.fx;
  return camera;
}

CameraFindings calibrate_with_balls(const std::vector<CalibrationPicture>& pictures,
                                    const BallPhantom& phantom, const CameraSettings& settings) {
  check_images(pictures, settings);
  if (phantom.is_plane() && pictures.size() < 3 && !settings.focal_px) {
    throw PhantomError(
        "the balls of \"" + phantom.name +
        "\" lie in one plane, and one or two images of a plane do not tell focal length from distance; give "
        "three or more with the plane tilted 20 deg or more in between, or the focal length with --focal");
  }
  CameraFindings findings;
  findings.settings = settings;
  findings.width = pictures.front().width;
  findings.height = pictures.front().height;
  for (const PhantomBall& ball : phantom.balls) findings.point_names.push_back(ball.name);
  std::vector<RecognisedImage> images;
  std::vector<PointView> views;
  MatchPrior prior;
  if (settings.focal_px) prior.focal_px = {0.9 * *settings.focal_px, 1.1 * *settings.focal_px};
  for (const CalibrationPicture& picture : pictures) {
    images.push_back(recognise(picture, phantom, settings, prior));
    const RecognisedImage& image = images.back();
    if (image.mirrored != images.front().mirrored) {
      throw PhantomError(picture.name + (image.mirrored ? ": is" : ": is not") + " mirrored, and " +
                         pictures.front().name + (image.mirrored ? " is not" : " is") +
                         "; give images of one camera in one mode");
    }
    // One camera: the next images need not look for their focal length.
    const double fx = images.front().match.intrinsics.fx;
    if (!phantom.is_plane()) prior.focal_px = {fx / 1.2, fx * 1.2};
    views.push_back({points_of(image.match.pairs, image.found, phantom),
                     image.match.T_camera_phantom * phantom.T_world_phantom.inverse()});
  }
  findings.mirrored = images.front().mirrored;
  const CameraPrior camera_prior = prior_of(settings, findings.width, findings.height);
  ChosenFit chosen = fit_or_throw(images.front().match.intrinsics, views, camera_prior);
  // Balls at the rim, that the first and plainer camera missed, and those that it mistook.
  const double near_px = std::max(3.0, 8 * chosen.fit.rms_px);
  for (std::size_t i = 0; i < images.size(); ++i) {
    views[i] =
        paired_again(images[i], phantom, chosen.fit.intrinsics, chosen.fit.views[i].T_camera_world, near_px);
  }
  findings.chosen = fit_or_throw(chosen.fit.intrinsics, views, camera_prior);
  for (std::size_t i = 0; i < images.size(); ++i) {
    const CameraCalibration camera =
        calibration_of(findings.chosen.fit.intrinsics, findings.chosen.fit.views[i].T_camera_world);
    findings.images.push_back({pictures[i].name, images[i].found,
                               visible(phantom, camera, findings.width, findings.height),
                               findings.chosen.views[i].points.size(), pictures[i].clipped_share()});
  }
  judge(findings);
  const auto mistakes = phantom_mistakes(findings, phantom);
  findings.statements.insert(findings.statements.begin(), mistakes.begin(), mistakes.end());
  return findings;
}

CameraFindings calibrate_with_board(const std::vector<CalibrationPicture>& pictures,
                                    const Chequerboard& board, const CameraSettings& settings) {
  check_images(pictures, settings);
  CameraFindings findings;
  findings.settings = settings;
  findings.width = pictures.front().width;
  findings.height = pictures.front().height;
  findings.mirrored = settings.mirrored;
  const auto corners = static_cast<std::size_t>(board.columns) * static_cast<std::size_t>(board.rows);
  for (std::size_t i = 0; i < corners; ++i) findings.point_names.push_back("corner " + std::to_string(i + 1));
  std::vector<PointView> views;
  for (const CalibrationPicture& picture : pictures) {
    const auto points = find_board(settings.mirrored ? picture.mirrored() : picture, board);
    if (!points) {
      throw PhantomError(picture.name + ": not all of the board's " + std::to_string(board.columns) + " x " +
                         std::to_string(board.rows) +
                         " inner corners can be seen; leave the image out, or check --board: it counts "
                         "corners where four squares meet, not squares");
    }
    findings.images.push_back({picture.name, {}, corners, corners, picture.clipped_share()});
    views.push_back({*points});
  }
  if (pictures.size() < 3 && !settings.focal_px) {
    throw PhantomError(
        "a chequerboard is a plane, and one or two images of a plane do not tell focal length from distance; "
        "give three or more with the board tilted 20 deg or more in between, or the focal length with "
        "--focal");
  }
  const auto guess = first_guess(views, findings.width, findings.height);
  if (!guess) {
    throw PhantomError(
        "no camera explains these images of the board; is it flat, and are its tilts different?");
  }
  findings.chosen = fit_or_throw(*guess, views, prior_of(settings, findings.width, findings.height));
  judge(findings);
  return findings;
}

}  // namespace tubed
