#include "drivers/laboratory/fluoroscope/tube_chord.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tubed {

namespace {

struct Interval {
  double from;
  double to;
};

/// Keeps what lies on the side of the plane through `p` that `normal` points to.
void cut(Interval& interval, const Eigen::Vector3d& p, const Eigen::Vector3d& normal,
         const Eigen::Vector3d& direction) {
  const double approach = normal.dot(direction);
  const double distance = normal.dot(p);
  if (std::abs(approach) < 1e-12) {
    if (distance > 0) {
      interval.to = interval.from;
    }
  } else if (approach > 0) {
    interval.from = std::max(interval.from, distance / approach);
  } else {
    interval.to = std::min(interval.to, distance / approach);
  }
}

}  // namespace

double chord_mm(const TubePiece& piece, double radius_mm, const Eigen::Vector3d& direction) {
  // Across the axis, the ray is at u * across - offset: inside while that is shorter than the radius.
  const Eigen::Vector3d across = direction - direction.dot(piece.tangent) * piece.tangent;
  const Eigen::Vector3d offset = piece.begin - piece.begin.dot(piece.tangent) * piece.tangent;
  const double speed = across.squaredNorm();
  const double outside = offset.squaredNorm() - radius_mm * radius_mm;
  Interval inside{0, std::numeric_limits<double>::infinity()};
  if (speed < 1e-14) {
    if (outside >= 0) {
      return 0;
    }
  } else {
    const double middle = across.dot(offset) / speed;
    const double half_squared = middle * middle - outside / speed;
    if (half_squared <= 0) {
      return 0;
    }
    const double half = std::sqrt(half_squared);
    inside = {middle - half, middle + half};
  }
  cut(inside, piece.begin, piece.begin_normal, direction);
  cut(inside, piece.end, -piece.end_normal, direction);
  return std::max(inside.to - inside.from, 0.0);
}

}  // namespace tubed
