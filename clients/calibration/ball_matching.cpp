#include "clients/calibration/ball_matching.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <opencv2/calib3d.hpp>
#include <random>

namespace tubed {

namespace {

constexpr double kCoarse = 0.025;     // of the longer side: what counts as near to begin with
constexpr double kFocalStep = 1.35;   // the pose takes up half of that on either side
constexpr double kSizeFactor = 1.45;  // a shadow of that many times the expected size is of something else
constexpr std::size_t kMinPairs = 6;
constexpr int kMaxTriples = 40;

using Triple = std::array<std::size_t, 3>;

/// A camera of unknown merit.
struct Hypothesis {
  Intrinsics intrinsics;
  RigidTransform T_camera_phantom;
  double score;
};

struct Search {
  const std::vector<FoundBall>& found;
  const BallPhantom& phantom;
  double width;
  double height;
  MatchPrior::Sizes sizes;
  [[nodiscard]] double near_px() const { return kCoarse * std::max(width, height); }
};

/// A ball's diameter on the image is close to the shadow's?
bool fits_in_size(double expected_px, double found_px, MatchPrior::Sizes sizes) {
  if (sizes == MatchPrior::Sizes::kIgnored) return true;
  const double factor = found_px / expected_px;
  return factor < kSizeFactor && factor > 1 / kSizeFactor;
}

/// Sum over balls of 1 - (distance / near)^2 of the nearest shadow of their size (MSAC, Torr and Zisserman
/// 2000).
double score_of(const Search& search, const Intrinsics& camera, const RigidTransform& T_camera_phantom) {
  const double near2 = search.near_px() * search.near_px();
  double score = 0;
  for (const PhantomBall& ball : search.phantom.balls) {
    const Eigen::Vector3d p = T_camera_phantom * ball.p_phantom_mm;
    if (!(p.z() > ball.diameter_mm)) return 0;
    const Eigen::Vector2d at(camera.cx + camera.fx * p.x() / p.z(), camera.cy + camera.fx * p.y() / p.z());
    const double diameter_px = camera.fx * ball.diameter_mm / p.z();
    double nearest2 = near2;
    for (const FoundBall& shadow : search.found) {
      const double distance2 = (shadow.p_image_px - at).squaredNorm();
      if (distance2 < nearest2 && fits_in_size(diameter_px, shadow.diameter_px, search.sizes))
        nearest2 = distance2;
    }
    score += 1 - nearest2 / near2;
  }
  return score;
}

std::vector<std::size_t> largest(std::size_t count, const std::vector<double>& sizes) {
  std::vector<std::size_t> order(sizes.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return sizes[a] > sizes[b]; });
  order.resize(std::min(count, order.size()));
  return order;
}

/// The balls of the larger kind: those above the widest gap between two sizes; all when there is one kind.
std::vector<std::size_t> large_balls(const BallPhantom& phantom) {
  std::vector<double> sizes;
  for (const PhantomBall& ball : phantom.balls) sizes.push_back(ball.diameter_mm);
  const std::vector<std::size_t> order = largest(sizes.size(), sizes);
  std::size_t count = order.size();
  double widest = 1.2;
  for (std::size_t i = 3; i + 1 < order.size(); ++i) {
    const double factor = sizes[order[i]] / sizes[order[i + 1]];
    if (factor > widest) {
      widest = factor;
      count = i + 1;
    }
  }
  return largest(count, sizes);
}

std::vector<double> focal_lengths(const Search& search, const MatchPrior& prior) {
  const double side = std::max(search.width, search.height);
  const auto [least, most] = prior.focal_px.value_or(std::pair(0.9 * side, 7 * side));
  const int steps = std::max(1, static_cast<int>(std::ceil(std::log(most / least) / std::log(kFocalStep))));
  std::vector<double> focal_px;
  for (int i = 0; i < steps; ++i) focal_px.push_back(least * std::pow(most / least, (i + 0.5) / steps));
  return focal_px;
}

/// Poses that put three balls onto three shadows.
std::vector<RigidTransform> three_point_poses(const Search& search, const Triple& balls,
                                              const Triple& shadows, const Intrinsics& camera) {
  std::vector<cv::Point3d> object;
  std::vector<cv::Point2d> image;
  for (std::size_t i = 0; i < 3; ++i) {
    const Eigen::Vector3d& p = search.phantom.balls[balls[i]].p_phantom_mm;
    const Eigen::Vector2d& at = search.found[shadows[i]].p_image_px;
    object.emplace_back(p.x(), p.y(), p.z());
    image.emplace_back((at.x() - camera.cx) / camera.fx, (at.y() - camera.cy) / camera.fx);
  }
  std::vector<cv::Mat> turns;
  std::vector<cv::Mat> shifts;
  cv::solveP3P(object, image, cv::Matx33d::eye(), cv::noArray(), turns, shifts, cv::SOLVEPNP_AP3P);
  std::vector<RigidTransform> poses;
  for (std::size_t i = 0; i < turns.size(); ++i) {
    const Eigen::Vector3d turn(turns[i].at<double>(0), turns[i].at<double>(1), turns[i].at<double>(2));
    RigidTransform pose = RigidTransform::Identity();
    if (turn.norm() > 0) pose.linear() = Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
    pose.translation() =
        Eigen::Vector3d(shifts[i].at<double>(0), shifts[i].at<double>(1), shifts[i].at<double>(2));
    if (pose.matrix().allFinite()) poses.push_back(pose);
  }
  return poses;
}

/// Three shadows spread over the image; a draw of several is the one that spreads most.
Triple spread_shadows(const Search& search, const std::vector<std::size_t>& shadows, std::mt19937& random) {
  Triple best{};
  double widest = -1;
  for (int draw = 0; draw < 3; ++draw) {
    Triple triple{};
    std::vector<std::size_t> left = shadows;
    for (std::size_t& shadow : triple) {
      const std::size_t at = random() % left.size();
      shadow = left[at];
      left.erase(left.begin() + static_cast<std::ptrdiff_t>(at));
    }
    const auto at = [&](std::size_t i) { return search.found[triple[i]].p_image_px; };
    const Eigen::Vector2d a = at(1) - at(0);
    const Eigen::Vector2d b = at(2) - at(0);
    const double area = std::abs(a.x() * b.y() - a.y() * b.x());
    if (area > widest) {
      widest = area;
      best = triple;
    }
  }
  return best;
}

bool are_alike(const RigidTransform& a, const RigidTransform& b) {
  constexpr double kSameTurn_rad = 0.15;
  return Eigen::AngleAxisd(a.linear().transpose() * b.linear()).angle() < kSameTurn_rad;
}

/// Keeps the best few that differ.
void keep(std::vector<Hypothesis>& best, const Hypothesis& next) {
  constexpr std::size_t kKept = 5;
  const auto alike = std::find_if(best.begin(), best.end(), [&](const Hypothesis& other) {
    return are_alike(other.T_camera_phantom, next.T_camera_phantom);
  });
  if (alike != best.end()) {
    if (next.score > alike->score) *alike = next;
  } else if (best.size() < kKept) {
    best.push_back(next);
  } else {
    const auto worst = std::min_element(best.begin(), best.end(),
                                        [](const auto& a, const auto& b) { return a.score < b.score; });
    if (next.score > worst->score) *worst = next;
  }
}

/// The best poses with which a triple of shadows is some triple of balls.
std::vector<Hypothesis> hypotheses(const Search& search, const Triple& shadows,
                                   const std::vector<std::size_t>& balls,
                                   const std::vector<double>& focal_px) {
  // Three are met by construction, some by chance.
  const double min_score =
      std::max(4.0, 0.25 * static_cast<double>(std::min(search.phantom.balls.size(), search.found.size())));
  std::vector<Hypothesis> best;
  for (const std::size_t a : balls) {
    for (const std::size_t b : balls) {
      for (const std::size_t c : balls) {
        if (a == b || b == c || a == c) continue;
        for (const double focal : focal_px) {
          const Intrinsics camera{focal, 1, (search.width - 1) / 2, (search.height - 1) / 2, {}};
          for (const RigidTransform& pose : three_point_poses(search, {a, b, c}, shadows, camera)) {
            const double score = score_of(search, camera, pose);
            if (score > min_score) keep(best, {camera, pose, score});
          }
        }
      }
    }
  }
  std::sort(best.begin(), best.end(), [](const auto& x, const auto& y) { return x.score > y.score; });
  return best;
}

std::size_t balls_in_image(const Search& search, const Intrinsics& intrinsics, const RigidTransform& pose) {
  const Camera camera(calibration_of(intrinsics, pose));
  std::size_t count = 0;
  for (const PhantomBall& ball : search.phantom.balls) {
    const auto at = camera.project(ball.p_phantom_mm);
    if (!at) continue;
    const double margin_px = intrinsics.fx * ball.diameter_mm / at->depth_mm;
    const auto within = [margin_px](double value, double size) {
      return value > margin_px && value < size - 1 - margin_px;
    };
    if (within(at->p_image_px.x(), search.width) && within(at->p_image_px.y(), search.height)) ++count;
  }
  return count;
}

/// Refines one hypothesis while what counts as near shrinks.
std::optional<PhantomMatch> refined(const Search& search, const Hypothesis& hypothesis) {
  PhantomMatch match;
  match.intrinsics = hypothesis.intrinsics;
  match.T_camera_phantom = hypothesis.T_camera_phantom;
  for (const double share : {1.0, 0.7, 0.5, 0.35, 0.25}) {
    match.pairs = pair_up(search.found, search.phantom, match.intrinsics, match.T_camera_phantom,
                          share * search.near_px(), search.sizes);
    if (match.pairs.size() < kMinPairs) return std::nullopt;
    BallPhantom own_frame = search.phantom;
    own_frame.T_world_phantom = RigidTransform::Identity();
    const PointView view{points_of(match.pairs, search.found, own_frame), match.T_camera_phantom};
    IntrinsicsModel model;
    constexpr std::size_t kPairsForDistortion = 14;
    model.focal = !search.phantom.is_plane();
    model.distortion_terms = match.pairs.size() >= kPairsForDistortion ? 1 : 0;
    auto fit = refine_camera(match.intrinsics, {view}, model, Residuals::kRobust);
    constexpr double kMaxDrift = 2;  // of the focal length
    const double drift = fit ? fit->intrinsics.fx / hypothesis.intrinsics.fx : 0;
    if (!fit || drift > kMaxDrift || drift < 1 / kMaxDrift) return std::nullopt;
    match.intrinsics = fit->intrinsics;
    match.T_camera_phantom = fit->views[0].T_camera_world;
    match.rms_px = fit->rms_px;
  }
  match.in_image = balls_in_image(search, match.intrinsics, match.T_camera_phantom);
  return match;
}

bool is_better(const PhantomMatch& a, const PhantomMatch& b) {
  return a.pairs.size() != b.pairs.size() ? a.pairs.size() > b.pairs.size() : a.rms_px < b.rms_px;
}

/// Takes `next` in; keeps note of another pose that is as good.
void compete(std::optional<PhantomMatch>& best, std::optional<PhantomMatch>& second,
             const PhantomMatch& next) {
  if (best && are_alike(best->T_camera_phantom, next.T_camera_phantom)) {
    if (is_better(next, *best)) best = next;
  } else if (!best || is_better(next, *best)) {
    second = best;
    best = next;
  } else if (!second || is_better(next, *second)) {
    second = next;
  }
}

}  // namespace

bool PhantomMatch::is_certain() const {
  constexpr std::size_t kMinCertain = 8;
  return pairs.size() >= kMinCertain && 2 * pairs.size() >= in_image;
}

std::optional<PhantomMatch> match_balls(const std::vector<FoundBall>& found, const BallPhantom& phantom,
                                        int width, int height, const MatchPrior& prior) {
  const Search search{found, phantom, static_cast<double>(width), static_cast<double>(height), prior.sizes};
  if (found.size() < kMinPairs) return std::nullopt;
  const std::vector<std::size_t> balls = large_balls(phantom);
  std::vector<double> sizes;
  for (const FoundBall& shadow : found) sizes.push_back(shadow.diameter_px);
  const std::vector<std::size_t> shadows = largest(balls.size() + 2, sizes);
  const std::vector<double> focal_px = focal_lengths(search, prior);
  std::optional<PhantomMatch> best;
  std::optional<PhantomMatch> second;
  std::mt19937 random(1);
  // As much work for a phantom with many large balls as for one with few.
  const double orders = std::pow(static_cast<double>(balls.size()), 3) * static_cast<double>(focal_px.size());
  const int triples = std::clamp(static_cast<int>(2.2e5 / orders), 4, kMaxTriples);
  for (int i = 0; i < triples; ++i) {
    const Triple triple = spread_shadows(search, shadows, random);
    for (const Hypothesis& hypothesis : hypotheses(search, triple, balls, focal_px)) {
      if (best && hypothesis.score < 0.6 * static_cast<double>(best->pairs.size())) break;
      if (const auto match = refined(search, hypothesis)) compete(best, second, *match);
    }
    if (best && best->is_certain() && 4 * best->pairs.size() >= 3 * best->in_image) break;
  }
  if (best && second) {
    best->is_ambiguous =
        20 * second->pairs.size() >= 19 * best->pairs.size() && second->rms_px < 1.5 * best->rms_px + 0.1;
  }
  return best;
}

std::vector<MatchedBall> pair_up(const std::vector<FoundBall>& found, const BallPhantom& phantom,
                                 const Intrinsics& intrinsics, const RigidTransform& T_camera_phantom,
                                 double near_px, MatchPrior::Sizes sizes) {
  struct Near {
    double distance_px;
    MatchedBall pair;
  };
  const Camera camera(calibration_of(intrinsics, T_camera_phantom));
  std::vector<Near> all;
  for (std::size_t ball = 0; ball < phantom.balls.size(); ++ball) {
    const double diameter_mm = phantom.balls[ball].diameter_mm;
    const auto at = camera.project(phantom.balls[ball].p_phantom_mm);
    if (!at) continue;
    for (std::size_t i = 0; i < found.size(); ++i) {
      const double distance_px = (found[i].p_image_px - at->p_image_px).norm();
      if (distance_px < near_px &&
          fits_in_size(intrinsics.fx * diameter_mm / at->depth_mm, found[i].diameter_px, sizes)) {
        all.push_back({distance_px, {ball, i}});
      }
    }
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const Near& a, const Near& b) { return a.distance_px < b.distance_px; });
  std::vector<bool> is_ball_taken(phantom.balls.size());
  std::vector<bool> is_found_taken(found.size());
  std::vector<MatchedBall> pairs;
  for (const Near& near : all) {
    if (is_ball_taken[near.pair.ball] || is_found_taken[near.pair.found]) continue;
    is_ball_taken[near.pair.ball] = is_found_taken[near.pair.found] = true;
    pairs.push_back(near.pair);
  }
  return pairs;
}

std::vector<CameraPoint> points_of(const std::vector<MatchedBall>& pairs, const std::vector<FoundBall>& found,
                                   const BallPhantom& phantom) {
  constexpr double kModelSigma_px = 0.02;  // what a soft disc is not like a shadow
  std::vector<CameraPoint> points;
  for (const MatchedBall& pair : pairs) {
    const FoundBall& shadow = found[pair.found];
    points.push_back({phantom.p_world_mm(pair.ball), phantom.balls[pair.ball].diameter_mm / 2,
                      shadow.p_image_px, std::hypot(shadow.sigma_px, kModelSigma_px), pair.ball});
  }
  return points;
}

std::vector<FoundBall> mirrored(std::vector<FoundBall> found, int width) {
  for (FoundBall& ball : found) ball.p_image_px.x() = width - 1 - ball.p_image_px.x();
  return found;
}

}  // namespace tubed
