#include "daemon/image/background_motion.hpp"

#include <algorithm>
#include <cmath>

namespace tubed {

namespace {

constexpr Eigen::Index kPart = 32;       // side, halved px
constexpr Eigen::Index kPartStep = 16;   // from one part to the next, halved px
constexpr Eigen::Index kReach = 24;      // greatest shift that is looked for, halved px
constexpr float kMinPartTexture = 0.2F;  // root mean square of a part
constexpr float kMinScore = 0.45F;       // normalised correlation
constexpr double kTolerance_px = 1;
constexpr double kMinMatched = 1.0 / 3;  // of the parts, or nothing is said
constexpr double kMinAgreeing = 0.75;    // below, parts moved differently
constexpr double kMinMagnification = 0.012;
constexpr double kMinBaseline_px = 24;  // between two parts that tell a magnification

/// Place of the greatest of three values at -1, 0, 1, by a parabola through them.
double peak_of(float left, float middle, float right) {
  const float curvature = left - 2 * middle + right;
  return curvature < 0 ? std::clamp(0.5 * static_cast<double>((left - right) / curvature), -0.5, 0.5) : 0;
}

}  // namespace

BackgroundMotionFinder::BackgroundMotionFinder(Eigen::Index rows, Eigen::Index columns)
    : before_(PixelGrid::Zero(rows / 2, columns / 2)),
      now_(before_),
      squares_(Eigen::ArrayXXd::Zero(rows / 2 + 1, columns / 2 + 1)),
      scores_(PixelGrid::Zero(2 * kReach + 1, 2 * kReach + 1)) {
  matches_.reserve(static_cast<std::size_t>((rows / 2 / kPartStep + 1) * (columns / 2 / kPartStep + 1)));
}

BackgroundMotion BackgroundMotionFinder::find(const TextureGrid& before, const TextureGrid& now,
                                              double mm_per_px) {
  halve(before, before_);
  halve(now, now_);
  sum_squares();
  match_all();
  BackgroundMotion motion;
  if (parts_ == 0 || static_cast<double>(matches_.size()) < kMinMatched * parts_) {
    return motion;
  }
  const Model pan = best_pan();
  const Model magnified = best_magnification();
  // A magnification has a parameter more: it has to explain more.
  const bool is_magnified = count_agreeing(magnified) > count_agreeing(pan) + parts_ / 20 &&
                            std::abs(magnified.magnification - 1) > kMinMagnification;
  const Model& model = is_magnified ? magnified : pan;
  motion.shift_mm = 2 * mm_per_px * model.offset;
  motion.magnification = model.magnification;
  motion.agreeing_share = count_agreeing(model) / static_cast<double>(matches_.size());
  motion.kind = motion.agreeing_share < kMinAgreeing ? BackgroundMotion::Kind::kTurned
                : is_magnified                       ? BackgroundMotion::Kind::kMagnified
                                                     : BackgroundMotion::Kind::kPanned;
  return motion;
}

void BackgroundMotionFinder::halve(const TextureGrid& from, PixelGrid& to) {
  constexpr float kShare = 1.0F / (4 * kTextureUnit);
  for (Eigen::Index row = 0; row < to.rows(); ++row) {
    for (Eigen::Index column = 0; column < to.cols(); ++column) {
      to(row, column) = kShare * static_cast<float>(from.block<2, 2>(2 * row, 2 * column).cast<int>().sum());
    }
  }
}

void BackgroundMotionFinder::sum_squares() {
  for (Eigen::Index row = 0; row < now_.rows(); ++row) {
    double in_row = 0;
    for (Eigen::Index column = 0; column < now_.cols(); ++column) {
      in_row += static_cast<double>(now_(row, column)) * static_cast<double>(now_(row, column));
      squares_(row + 1, column + 1) = squares_(row, column + 1) + in_row;
    }
  }
}

float BackgroundMotionFinder::energy_of_now(Eigen::Index row, Eigen::Index column) const {
  return static_cast<float>(squares_(row + kPart, column + kPart) - squares_(row, column + kPart) -
                            squares_(row + kPart, column) + squares_(row, column));
}

void BackgroundMotionFinder::match_all() {
  matches_.clear();
  parts_ = 0;
  for (Eigen::Index row = 0; row + kPart <= before_.rows(); row += kPartStep) {
    for (Eigen::Index column = 0; column + kPart <= before_.cols(); column += kPartStep) {
      const float energy = before_.block<kPart, kPart>(row, column).square().sum();
      if (energy >= kMinPartTexture * kMinPartTexture * kPart * kPart) {
        ++parts_;
        match(row, column, energy);
      }
    }
  }
}

/// Looks for the part at that place. One whose best place is at the border may have left the picture.
void BackgroundMotionFinder::match(Eigen::Index row, Eigen::Index column, float energy) {
  const auto part = before_.block<kPart, kPart>(row, column);
  scores_ = -1;
  Eigen::Index best_y = 0;
  Eigen::Index best_x = 0;
  float best = -1;
  for (Eigen::Index y = -std::min(kReach, row); y <= std::min(kReach, now_.rows() - kPart - row); ++y) {
    for (Eigen::Index x = -std::min(kReach, column); x <= std::min(kReach, now_.cols() - kPart - column);
         ++x) {
      const float energy_now = energy_of_now(row + y, column + x);
      if (energy_now <= 0) continue;
      const float score =
          (part * now_.block<kPart, kPart>(row + y, column + x)).sum() / std::sqrt(energy * energy_now);
      scores_(y + kReach, x + kReach) = score;
      if (score > best) {
        best = score;
        best_y = y;
        best_x = x;
      }
    }
  }
  const Eigen::Index r = best_y + kReach;
  const Eigen::Index c = best_x + kReach;
  const bool is_inside = r > 0 && c > 0 && r < 2 * kReach && c < 2 * kReach && scores_(r - 1, c) > -1 &&
                         scores_(r + 1, c) > -1 && scores_(r, c - 1) > -1 && scores_(r, c + 1) > -1;
  if (is_inside && best >= kMinScore) {
    const Eigen::Vector2d middle(static_cast<double>(now_.cols()) / 2, static_cast<double>(now_.rows()) / 2);
    const Eigen::Vector2d centre(static_cast<double>(column) + kPart / 2.0,
                                 static_cast<double>(row) + kPart / 2.0);
    matches_.push_back({centre - middle,
                        {static_cast<double>(best_x) + peak_of(scores_(r, c - 1), best, scores_(r, c + 1)),
                         static_cast<double>(best_y) + peak_of(scores_(r - 1, c), best, scores_(r + 1, c))}});
  }
}

int BackgroundMotionFinder::count_agreeing(const Model& model) const {
  return static_cast<int>(std::count_if(matches_.begin(), matches_.end(), [&](const Match& match) {
    return (model.offset + (model.magnification - 1) * match.place - match.shift).norm() <= kTolerance_px;
  }));
}

BackgroundMotionFinder::Model BackgroundMotionFinder::best_pan() const {
  Model best;
  int most = -1;
  for (const Match& match : matches_) {
    const Model candidate{match.shift, 1};
    const int agreeing = count_agreeing(candidate);
    if (agreeing > most) {
      most = agreeing;
      best = candidate;
    }
  }
  return refined(best, false);
}

/// Every pair of parts far enough from each other is a hypothesis.
BackgroundMotionFinder::Model BackgroundMotionFinder::best_magnification() const {
  Model best;
  int most = -1;
  for (std::size_t i = 0; i < matches_.size(); ++i) {
    for (std::size_t j = i + 1; j < matches_.size(); ++j) {
      const Eigen::Vector2d baseline = matches_[j].place - matches_[i].place;
      if (baseline.norm() < kMinBaseline_px) continue;
      Model candidate;
      candidate.magnification =
          1 + (matches_[j].shift - matches_[i].shift).dot(baseline) / baseline.squaredNorm();
      candidate.offset = matches_[i].shift - (candidate.magnification - 1) * matches_[i].place;
      const int agreeing = count_agreeing(candidate);
      if (agreeing > most) {
        most = agreeing;
        best = candidate;
      }
    }
  }
  return refined(best, true);
}

/// Least squares over the parts that agree.
BackgroundMotionFinder::Model BackgroundMotionFinder::refined(const Model& model, bool may_magnify) const {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();  // of (offset x, offset y, magnification - 1)
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const Match& match : matches_) {
    if ((model.offset + (model.magnification - 1) * match.place - match.shift).norm() > kTolerance_px)
      continue;
    Eigen::Matrix<double, 2, 3> J;
    J << 1, 0, match.place.x(), 0, 1, match.place.y();
    normal += J.transpose() * J;
    right += J.transpose() * match.shift;
  }
  if (normal(0, 0) < 3) return model;
  if (!may_magnify) return {right.head<2>() / normal(0, 0), 1};
  const Eigen::Vector3d x = normal.ldlt().solve(right);
  return {x.head<2>(), 1 + x.z()};
}

}  // namespace tubed
