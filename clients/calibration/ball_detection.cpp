#include "clients/calibration/ball_detection.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "clients/calibration/soft_disc.hpp"

namespace tubed {

namespace {

constexpr double kScaleStep = 1.3;

/// Blurred by `sigma_px` less blurred by kScaleStep of it: positive where a dark disc of that scale is.
struct Layer {
  double sigma_px;
  cv::Mat difference;
  double noise;  ///< of the difference: from its median absolute value
};

struct Candidate {
  Eigen::Vector2d p_image_px;
  double radius_px;
  double strength;  ///< in noises
  double response;  ///< grey levels, > 0: dark
};

double noise_of(const cv::Mat& difference) {
  std::vector<float> values;
  values.reserve(difference.total() / 7 + 1);
  for (std::size_t i = 0; i < difference.total(); i += 7) {
    values.push_back(std::abs(difference.ptr<float>()[i]));
  }
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle / 0.6745;  // a normal distribution's
}

std::vector<Layer> scale_space(const CalibrationPicture& picture, const BallLook& look) {
  cv::Mat grey(picture.height, picture.width, CV_32F);
  std::copy(picture.pixels.begin(), picture.pixels.end(), grey.ptr<float>());
  // A disc of radius r answers most at sigma = r / sqrt(2); one layer more at either end.
  const double first = look.min_diameter_px / 2 / std::numbers::sqrt2 / kScaleStep / kScaleStep;
  const double last = look.max_diameter_px / 2 / std::numbers::sqrt2 * kScaleStep * kScaleStep;
  std::vector<Layer> layers;
  cv::Mat fine;
  cv::GaussianBlur(grey, fine, {}, first, first, cv::BORDER_REPLICATE);
  for (double sigma = first; sigma < last; sigma *= kScaleStep) {
    cv::Mat coarse;
    // What is blurred already needs the difference of variances only.
    const double more = sigma * std::sqrt(kScaleStep * kScaleStep - 1);
    cv::GaussianBlur(fine, coarse, {}, more, more, cv::BORDER_REPLICATE);
    cv::Mat difference = coarse - fine;
    const double noise = noise_of(difference);
    layers.push_back({sigma, std::move(difference), noise});
    fine = coarse;
  }
  return layers;
}

bool is_extremum(const std::vector<Layer>& layers, std::size_t layer, int x, int y, float sign) {
  const float value = sign * layers[layer].difference.at<float>(y, x);
  for (std::size_t l = layer - 1; l <= layer + 1; ++l) {
    for (int dy = -1; dy <= 1; ++dy) {
      const float* const row = layers[l].difference.ptr<float>(y + dy) + x;
      for (int dx = -1; dx <= 1; ++dx) {
        if ((l != layer || dx != 0 || dy != 0) && sign * row[dx] >= value) return false;
      }
    }
  }
  return true;
}

/// Places and scales at which a disc may be, strongest first.
std::vector<Candidate> candidates(const std::vector<Layer>& layers, float sign) {
  constexpr double kMinStrength = 4;
  constexpr std::size_t kMaxCandidates = 600;
  std::vector<Candidate> found;
  for (std::size_t l = 1; l + 1 < layers.size(); ++l) {
    const Layer& layer = layers[l];
    const double least = std::max(kMinStrength * layer.noise, 1e-3);
    for (int y = 1; y + 1 < layer.difference.rows; ++y) {
      const float* const row = layer.difference.ptr<float>(y);
      for (int x = 1; x + 1 < layer.difference.cols; ++x) {
        const double response = static_cast<double>(sign * row[x]);
        if (response > least && is_extremum(layers, l, x, y, sign)) {
          // Between sigma and kScaleStep sigma lies the Laplacian's scale.
          const double radius_px = layer.sigma_px * std::sqrt(kScaleStep) * std::numbers::sqrt2;
          found.push_back({{x, y},
                           radius_px,
                           response / std::max(layer.noise, 1e-9),
                           response * static_cast<double>(sign)});
        }
      }
    }
  }
  std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.strength > b.strength; });
  if (found.size() > kMaxCandidates) found.resize(kMaxCandidates);
  return found;
}

bool looks_like_a_ball(const SoftDisc& disc, const BallLook& look, float sign) {
  constexpr double kMinExplained = 0.65;
  constexpr double kMinContrastToNoise = 3;
  const double diameter_px = 2 * disc.radius_px;
  return disc.contrast * static_cast<double>(sign) < 0 && disc.explained > kMinExplained &&
         std::abs(disc.contrast) > kMinContrastToNoise * disc.noise &&
         diameter_px > 0.7 * look.min_diameter_px && diameter_px < 1.2 * look.max_diameter_px &&
         disc.softness_px < std::max(1.6, 0.55 * disc.radius_px);
}

/// Once more for those that have a neighbour within the pixels of their fit, which count no longer then.
void fit_beside_neighbours(const CalibrationPicture& picture, std::vector<FoundBall>& balls) {
  const std::vector<FoundBall> before = balls;
  for (FoundBall& ball : balls) {
    const double reach_px = 0.7 * ball.diameter_px + 3;
    std::vector<OtherDisc> others;
    double gap_px = reach_px;
    for (const FoundBall& other : before) {
      const double distance_px = (other.p_image_px - ball.p_image_px).norm();
      constexpr double kEdge_px = 2;  // softness of a shadow's edge
      if (distance_px > 0 && distance_px < reach_px + other.diameter_px / 2 + kEdge_px) {
        others.push_back({other.p_image_px, other.diameter_px / 2 + kEdge_px});
        gap_px = std::min(gap_px, distance_px - (other.diameter_px + ball.diameter_px) / 2);
      }
    }
    if (others.empty()) continue;
    const auto disc = fit_soft_disc(picture, ball.p_image_px, ball.diameter_px / 2, ball.contrast, others);
    if (disc && gap_px > 1) {
      ball.p_image_px = disc->p_image_px;
      ball.sigma_px = disc->sigma_px;
    } else {
      constexpr double kTouching_px = 0.5;
      ball.sigma_px = std::hypot(ball.sigma_px, kTouching_px);
    }
  }
}

/// Discs of one polarity.
std::vector<FoundBall> find_discs(const CalibrationPicture& picture, const std::vector<Layer>& layers,
                                  const BallLook& look, float sign) {
  std::vector<FoundBall> balls;
  for (const Candidate& candidate : candidates(layers, sign)) {
    constexpr double kContrastOfResponse = 4;  // a disc's contrast over its greatest difference, about
    const auto disc = fit_soft_disc(picture, candidate.p_image_px, candidate.radius_px,
                                    -kContrastOfResponse * candidate.response);
    if (!disc || !looks_like_a_ball(*disc, look, sign)) continue;
    const bool is_known = std::any_of(balls.begin(), balls.end(), [&](const FoundBall& ball) {
      return (ball.p_image_px - disc->p_image_px).norm() <
             0.5 * std::max(ball.diameter_px, 2 * disc->radius_px);
    });
    if (!is_known) {
      balls.push_back({disc->p_image_px, 2 * disc->radius_px, disc->contrast, disc->noise, disc->sigma_px});
    }
  }
  std::sort(balls.begin(), balls.end(), [](const FoundBall& a, const FoundBall& b) {
    return std::abs(a.contrast) * b.noise > std::abs(b.contrast) * a.noise;
  });
  return balls;
}

}  // namespace

std::vector<FoundBall> find_balls(const CalibrationPicture& picture, const BallLook& look) {
  const std::vector<Layer> layers = scale_space(picture, look);
  std::vector<FoundBall> dark;
  std::vector<FoundBall> bright;
  if (look.polarity != BallLook::Polarity::kBright) dark = find_discs(picture, layers, look, 1);
  if (look.polarity != BallLook::Polarity::kDark) bright = find_discs(picture, layers, look, -1);
  std::vector<FoundBall>& balls = bright.size() > dark.size() ? bright : dark;
  fit_beside_neighbours(picture, balls);
  return balls;
}

}  // namespace tubed
