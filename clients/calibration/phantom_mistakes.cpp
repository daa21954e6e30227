#include "clients/calibration/phantom_mistakes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>

#include "clients/calibration/formatted.hpp"
#include "clients/markers/marker_file.hpp"

namespace tubed {

namespace {

constexpr double kSameWidth = 1.35;      // ratio of diameters
constexpr double kMinShown = 0.6;        // of the images that should show it
constexpr double kMaxUnexplained = 0.1;  // of all balls; more is not chance

/// What one image says about places of balls.
class ImageOfBalls {
 public:
  ImageOfBalls(const CameraFindings& findings, std::size_t image)
      : camera_(camera_of(findings, image)),
        found_(findings.images[image].found),
        is_claimed_(found_.size()),
        near_px_(std::max(2.0, 6 * findings.chosen.fit.rms_px)) {
    for (const CameraPoint& point : findings.chosen.views[image].points) {
      matched_.push_back(point.point);
      claim(point.p_image_px);
    }
    for (const LeftOutPoint& out : findings.chosen.left_out) {
      if (out.view == image) claim(out.point.p_image_px);
    }
  }

  [[nodiscard]] bool matches(std::size_t ball) const {
    return std::find(matched_.begin(), matched_.end(), ball) != matched_.end();
  }
  /// Would a ball there lie in the image?
  [[nodiscard]] bool contains(const Eigen::Vector3d& p_world_mm, double diameter_mm) const {
    const auto at = camera_.project(p_world_mm);
    return at && camera_.contains(at->p_image_px, width_px(diameter_mm, at->depth_mm));
  }
  /// Is a shadow of that width there that belongs to no ball?
  [[nodiscard]] bool shows(const Eigen::Vector3d& p_world_mm, double diameter_mm) const {
    const auto at = camera_.project(p_world_mm);
    if (!at) return false;
    const double width = width_px(diameter_mm, at->depth_mm);
    for (std::size_t i = 0; i < found_.size(); ++i) {
      const double ratio = found_[i].diameter_px / width;
      if (!is_claimed_[i] && ratio < kSameWidth && ratio > 1 / kSameWidth &&
          (found_[i].p_image_px - at->p_image_px).norm() < near_px_) {
        return true;
      }
    }
    return false;
  }

 private:
  static Camera camera_of(const CameraFindings& findings, std::size_t image) {
    CameraCalibration calibration =
        calibration_of(findings.chosen.fit.intrinsics, findings.chosen.fit.views[image].T_camera_world);
    calibration.width = findings.width;
    calibration.height = findings.height;
    return Camera(calibration);
  }
  [[nodiscard]] double width_px(double diameter_mm, double depth_mm) const {
    return camera_.calibration().fx * diameter_mm / depth_mm;
  }
  void claim(const Eigen::Vector2d& p_image_px) {
    for (std::size_t i = 0; i < found_.size(); ++i) {
      if ((found_[i].p_image_px - p_image_px).norm() < 1e-6) is_claimed_[i] = true;
    }
  }

  Camera camera_;
  std::vector<FoundBall> found_;
  std::vector<bool> is_claimed_;
  std::vector<std::size_t> matched_;
  double near_px_;
};

/// One way in which a row may be wrong, and where the ball then is.
struct RowMistake {
  std::string words;  ///< "z has the wrong sign"
  Eigen::Vector3d p_phantom_mm;
};

std::vector<RowMistake> row_mistakes(const Eigen::Vector3d& p_mm) {
  constexpr std::array<const char*, 3> kAxis{"x", "y", "z"};
  std::vector<RowMistake> all;
  for (int i = 0; i < 3; ++i) {
    const std::string axis = kAxis.at(static_cast<std::size_t>(i));
    const auto with = [&](double value) {
      Eigen::Vector3d changed = p_mm;
      changed[i] = value;
      return changed;
    };
    all.push_back({axis + " has the wrong sign", with(-p_mm[i])});
    all.push_back({axis + " is ten times too large", with(p_mm[i] / 10)});
    all.push_back({axis + " is ten times too small", with(p_mm[i] * 10)});
    const int j = (i + 1) % 3;
    Eigen::Vector3d swapped = p_mm;
    std::swap(swapped[i], swapped[j]);
    all.push_back({axis + " and " + kAxis.at(static_cast<std::size_t>(j)) + " are exchanged", swapped});
  }
  return all;
}

/// All images, and how well they show something.
class Evidence {
 public:
  explicit Evidence(const CameraFindings& findings) {
    for (std::size_t i = 0; i < findings.images.size(); ++i) images_.emplace_back(findings, i);
  }

  /// Not matched in most of the images that should show it.
  [[nodiscard]] bool misses(const BallPhantom& phantom, std::size_t ball) const {
    int asked = 0, matched = 0;
    for (const ImageOfBalls& image : images_) {
      if (!image.contains(phantom.p_world_mm(ball), phantom.balls[ball].diameter_mm)) continue;
      ++asked;
      matched += image.matches(ball) ? 1 : 0;
    }
    return asked > 0 && 2 * matched < asked;
  }

  /// Share of the images with `p` in them that show a shadow of that width there; 0 where none has it.
  [[nodiscard]] double shown(const Eigen::Vector3d& p_world_mm, double diameter_mm) const {
    int asked = 0, shown = 0;
    for (const ImageOfBalls& image : images_) {
      if (!image.contains(p_world_mm, diameter_mm)) continue;
      ++asked;
      shown += image.shows(p_world_mm, diameter_mm) ? 1 : 0;
    }
    return asked > 0 ? static_cast<double>(shown) / asked : 0;
  }

 private:
  std::vector<ImageOfBalls> images_;
};

/// The row's own mistake that images speak for most.
std::optional<std::string> mistake_of(const Evidence& evidence, const BallPhantom& phantom,
                                      std::size_t ball) {
  std::optional<std::string> best;
  double most = kMinShown;
  for (const RowMistake& mistake : row_mistakes(phantom.balls[ball].p_phantom_mm)) {
    const double shown =
        evidence.shown(phantom.T_world_phantom * mistake.p_phantom_mm, phantom.balls[ball].diameter_mm);
    if (shown > most) {
      most = shown;
      best = mistake.words;
    }
  }
  return best;
}

/// Another missing ball whose place has a shadow as wide as this one, while its own has one as wide as that.
std::optional<std::size_t> exchanged_with(const Evidence& evidence, const BallPhantom& phantom,
                                          std::size_t ball, const std::vector<std::size_t>& missing) {
  for (const std::size_t other : missing) {
    if (other <= ball) continue;
    const double here_mm = phantom.balls[ball].diameter_mm;
    const double there_mm = phantom.balls[other].diameter_mm;
    if (evidence.shown(phantom.p_world_mm(other), here_mm) > kMinShown &&
        evidence.shown(phantom.p_world_mm(ball), there_mm) > kMinShown) {
      return other;
    }
  }
  return std::nullopt;
}

void take(std::vector<std::size_t>& from, std::size_t ball) {
  from.erase(std::remove(from.begin(), from.end(), ball), from.end());
}

}  // namespace

std::vector<CameraStatement> phantom_mistakes(const CameraFindings& findings, const BallPhantom& phantom) {
  const Evidence evidence(findings);
  std::vector<CameraStatement> statements;
  const auto bad = [&statements](const std::string& words) {
    statements.push_back({ReportVerdict::kBad, "the phantom's file is wrong: " + words});
  };
  std::vector<std::size_t> missing;
  for (std::size_t ball = 0; ball < phantom.balls.size(); ++ball) {
    if (evidence.misses(phantom, ball)) missing.push_back(ball);
  }
  std::map<std::string, std::vector<std::string>> of_kind;
  for (const std::size_t ball : std::vector<std::size_t>(missing)) {
    if (const auto other = exchanged_with(evidence, phantom, ball, missing)) {
      bad(phantom.balls[ball].name + " and " + phantom.balls[*other].name +
          " are exchanged: where either should be the shadow is as wide as the other");
      take(missing, ball);
      take(missing, *other);
    } else if (const auto mistake = mistake_of(evidence, phantom, ball)) {
      of_kind[*mistake].push_back(phantom.balls[ball].name);
    }
  }
  // One ball in one image may meet another's shadow by chance.
  for (const auto& [mistake, names] : of_kind) {
    if (findings.images.size() < 2 && names.size() < 2) continue;
    bad(mistake + " of " + list_of(names));
    for (const std::string& name : names) {
      const auto named = [&](std::size_t ball) { return phantom.balls[ball].name == name; };
      missing.erase(std::remove_if(missing.begin(), missing.end(), named), missing.end());
    }
  }
  std::vector<std::string> names;
  for (const std::size_t ball : missing) names.push_back(phantom.balls[ball].name);
  if (static_cast<double>(names.size()) > kMaxUnexplained * static_cast<double>(phantom.balls.size())) {
    bad(formatted("%zu of %zu balls cast no shadow where it has them: ", names.size(), phantom.balls.size()) +
        list_of(names) + "; is it the file of this phantom, and are all balls in place?");
  }
  return statements;
}

}  // namespace tubed
