#include "clients/calibration/traced_tip.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

#include "clients/calibration/arc_chain.hpp"
#include "clients/calibration/coil_recording.hpp"
#include "clients/calibration/formatted.hpp"
#include "drivers/csv/csv_reader.hpp"
#include "drivers/interface/rest_curve_limits.hpp"

namespace tubed {

namespace {

constexpr Eigen::Index kMinPoints = 8;
constexpr double kMaxStep_mm = 15;
constexpr double kSamePlace_mm = 1e-6;
constexpr double kMaxCorner_deg = 100;
constexpr double kMinLength_mm = 15;  // centimetres taken for millimetres are fewer
constexpr double kMaxLength_mm = 500;
constexpr double kMinPiece_mm = 3;
constexpr double kMaxPieces = 24;
constexpr double kFloor_mm = 0.1;  // nobody traces better, and a fit without residuals has no criterion
constexpr double kStraight_rad = 3 * std::numbers::pi / 180;
constexpr double kFlat_mm = 1;        // in z, of points that lie in one plane
constexpr double kStraight_mm = 200;  // radius: over 30 mm that is half a millimetre

double corner_deg(const Eigen::Vector2d& before, const Eigen::Vector2d& behind) {
  const double cross = before.x() * behind.y() - before.y() * behind.x();
  return std::abs(std::atan2(cross, before.dot(behind))) * 180 / std::numbers::pi;
}

double whole_length_mm(const Eigen::Matrix2Xd& points) {
  return (points.rightCols(points.cols() - 1) - points.leftCols(points.cols() - 1)).colwise().norm().sum();
}

void check_drawing(const TracedTip& drawing) {
  const Eigen::Matrix2Xd& points = drawing.points_mm;
  const auto refuse = [&](const std::string& words) {
    throw CalibrationError(drawing.source + ": " + words);
  };
  if (points.cols() < kMinPoints) {
    refuse(
        formatted("expected %d points or more, found %d: trace the middle of the catheter in steps of 2 or "
                  "3 mm, the tip first",
                  static_cast<int>(kMinPoints), static_cast<int>(points.cols())));
  }
  const double length_mm = whole_length_mm(points);
  if (length_mm < kMinLength_mm || length_mm > kMaxLength_mm) {
    refuse(formatted("the drawing is %.3g mm long, expected %.0f to %.0f: are these millimetres?", length_mm,
                     kMinLength_mm, kMaxLength_mm));
  }
  for (Eigen::Index i = 1; i < points.cols(); ++i) {
    const Eigen::Vector2d step = points.col(i) - points.col(i - 1);
    if (step.norm() > kMaxStep_mm) {
      refuse(
          formatted("from point %d to %d it is %.1f mm, expected %.0f at most: trace in steps of 2 or 3 mm",
                    static_cast<int>(i), static_cast<int>(i + 1), step.norm(), kMaxStep_mm));
    }
    if (i + 1 < points.cols() && corner_deg(step, points.col(i + 1) - points.col(i)) > kMaxCorner_deg) {
      refuse(formatted("the line turns back at point %d: expected points in their order along the catheter",
                       static_cast<int>(i + 1)));
    }
  }
}

/// n ln s^2 + 1.5 k ln n with the unbiased s^2 = SSE / (n - k), because there are as few as four points for
/// each arc. k: a curvature and an end each arc, and where and in which direction the first one begins.
double criterion(const ArcChain& chain, const Eigen::Matrix2Xd& points) {
  const auto n = static_cast<double>(points.cols());
  const double k = 2 * static_cast<double>(chain.piece_count()) + 2;
  if (n - k < 1) return std::numeric_limits<double>::max();
  const double mean_mm2 = chain.residuals_mm(points).squaredNorm() / (n - k) + kFloor_mm * kFloor_mm;
  return n * std::log(mean_mm2) + 1.5 * k * std::log(n);
}

/// Pieces whose next one is most like them, as much as both together turn otherwise than each by itself.
std::vector<std::size_t> likely_merges(const ArcChain& chain) {
  constexpr std::size_t kTried = 4;
  std::vector<std::pair<double, std::size_t>> changes;
  for (std::size_t piece = 0; piece + 1 < chain.piece_count(); ++piece) {
    const RestArc one = chain.arc(piece);
    const RestArc next = chain.arc(piece + 1);
    const double differ = one.curvature_per_mm() - next.curvature_per_mm();
    const double shared_mm = one.length_mm * next.length_mm / (one.length_mm + next.length_mm);
    changes.emplace_back(std::abs(differ) * shared_mm * shared_mm, piece);  // about how far the middle moves
  }
  std::ranges::sort(changes);
  std::vector<std::size_t> pieces;
  for (const auto& [change, piece] : changes) {
    if (pieces.size() < kTried) pieces.push_back(piece);
  }
  return pieces;
}

/// The chain with two neighbours made one, that explains the points best.
std::optional<ArcChain> best_merged(const ArcChain& chain, const Eigen::Matrix2Xd& points) {
  std::optional<ArcChain> best;
  double least = std::numeric_limits<double>::max();
  for (const std::size_t piece : likely_merges(chain)) {
    ArcChain merged = chain.merged(piece);
    merged.fit(points, ArcChain::Ends::kHeld, 4);
    const double value = criterion(merged, points);
    if (value < least) {
      least = value;
      best = merged;
    }
  }
  return best;
}

ArcChain min_arcs(const Eigen::Matrix2Xd& points) {
  const double length_mm = whole_length_mm(points);
  const double most = std::min(kMaxPieces, std::floor(static_cast<double>(points.cols()) / 4));
  const auto pieces = static_cast<std::size_t>(std::clamp(std::floor(length_mm / kMinPiece_mm), 1.0, most));
  ArcChain chain = ArcChain::along(points, pieces);
  chain.fit(points, ArcChain::Ends::kHeld, 10);
  ArcChain best = chain;
  double least = criterion(best, points);
  while (const auto merged = best_merged(chain, points)) {
    chain = *merged;
    ArcChain moved = chain;
    moved.fit(points, ArcChain::Ends::kFree, 20);
    if (const double value = criterion(moved, points); value <= least) {
      least = value;
      best = moved;
    }
  }
  return best;
}

/// A configuration with these arcs would be refused.
void check_curve(const RestCurve& curve, const std::string& source) {
  for (std::size_t i = 0; i < curve.arcs.size(); ++i) {
    if (curve.arcs[i].length_mm < kMinRestArc_mm) {
      throw CalibrationError(source + formatted(": arc %d would be %.1f mm long, a configuration takes %.1f "
                                                "or more: are these millimetres?",
                                                static_cast<int>(i + 1), curve.arcs[i].length_mm,
                                                kMinRestArc_mm));
    }
  }
  if (whole_turns(curve) > kMaxRestTurns) {
    throw CalibrationError(source +
                           formatted(": the catheter would turn round %.2f times, a configuration "
                                     "takes %.0f at most: are these millimetres, and is the line drawn once?",
                                     whole_turns(curve), kMaxRestTurns));
  }
}

double tenth(double value) { return std::round(10 * value) / 10; }

/// How far points lie from one plane, where a file tells their z.
class HeightRange {
 public:
  void add(double z_mm) {
    least_mm_ = std::min(least_mm_, z_mm);
    greatest_mm_ = std::max(greatest_mm_, z_mm);
  }
  [[nodiscard]] double range_mm() const { return std::max(greatest_mm_ - least_mm_, 0.0); }

 private:
  double least_mm_ = std::numeric_limits<double>::max();
  double greatest_mm_ = std::numeric_limits<double>::lowest();
};

}  // namespace

TracedTip read_traced_tip(const std::filesystem::path& file, double mm_per_px) {
  const bool is_photograph = mm_per_px > 0;
  if (!std::filesystem::is_regular_file(file)) {
    throw CalibrationError(file.string() +
                           ": there is no such file; expected a drawing, a CSV file with the " + "columns " +
                           (is_photograph ? "x_px,y_px" : "x_mm,y_mm"));
  }
  CsvReader rows = is_photograph ? CsvReader(file, {"x_px", "y_px"}, {"z_px", "z"})
                                 : CsvReader(file, {"x_mm", "y_mm"}, {"z_mm", "z"});
  HeightRange height;
  std::vector<Eigen::Vector2d> points;
  while (rows.next_row()) {
    for (const std::size_t z : {2U, 3U}) {
      if (rows.has(z) && !rows.is_empty(z)) height.add((is_photograph ? mm_per_px : 1.0) * rows.number(z));
    }
    const Eigen::Vector2d point =
        (is_photograph ? mm_per_px : 1.0) * Eigen::Vector2d(rows.number(0), rows.number(1));
    if (points.empty() || (point - points.back()).norm() > kSamePlace_mm) points.push_back(point);
  }
  TracedTip drawing{file.string(), Eigen::Matrix2Xd(2, static_cast<Eigen::Index>(points.size()))};
  for (std::size_t i = 0; i < points.size(); ++i) {
    drawing.points_mm.col(static_cast<Eigen::Index>(i)) = points[i];
  }
  if (height.range_mm() > kFlat_mm) {
    throw CalibrationError(
        drawing.source +
        formatted(": z goes over %.1f mm: bends out of one plane are not handled; let the catheter lie flat, "
                  "and where it cannot, leave rest_shape = \"unknown\"",
                  height.range_mm()));
  }
  check_drawing(drawing);
  return drawing;
}

TracedCurve fit_arcs(const TracedTip& drawing) {
  const ArcChain chain = min_arcs(drawing.points_mm);
  TracedCurve found;
  for (std::size_t piece = 0; piece < chain.piece_count(); ++piece) {
    const RestArc arc = chain.arc(piece);
    const double turn_rad = arc.length_mm * arc.curvature_per_mm();
    const bool is_straight = std::abs(turn_rad) < kStraight_rad || std::abs(arc.radius_mm) > kStraight_mm;
    if (!is_straight && std::abs(tenth(arc.radius_mm)) < kMinRestRadius_mm) {
      throw CalibrationError(
          drawing.source +
          formatted(": an arc would have a radius of %.1f mm, a configuration takes %.0f or more: are these "
                    "millimetres?",
                    std::abs(arc.radius_mm), kMinRestRadius_mm));
    }
    if (is_straight && !found.curve.arcs.empty() && found.curve.arcs.back().radius_mm == 0) {
      found.curve.arcs.back().length_mm += tenth(arc.length_mm);
    } else {
      found.curve.arcs.push_back({tenth(arc.length_mm), is_straight ? 0 : tenth(arc.radius_mm)});
    }
  }
  const auto bent = std::ranges::find_if(found.curve.arcs, [](const RestArc& a) { return a.radius_mm != 0; });
  if (bent == found.curve.arcs.end()) {
    throw CalibrationError(drawing.source +
                           ": the drawing is straight; say rest_shape = \"straight\" in the configuration");
  }
  if (bent->radius_mm < 0) {
    for (RestArc& arc : found.curve.arcs) arc.radius_mm = arc.radius_mm == 0 ? 0 : -arc.radius_mm;
  }
  found.ends_bent = found.curve.arcs.back().radius_mm != 0;
  if (!found.ends_bent) {
    found.shaft_mm = found.curve.arcs.back().length_mm;
    found.curve.arcs.pop_back();
  }
  check_curve(found.curve, drawing.source);
  const Eigen::VectorXd across_mm = chain.residuals_mm(drawing.points_mm).head(drawing.points_mm.cols());
  found.rms_mm = std::sqrt(across_mm.squaredNorm() / static_cast<double>(across_mm.size()));
  found.max_mm = across_mm.cwiseAbs().maxCoeff();
  found.drawn_mm = chain.length_mm();
  found.line_mm = chain.sampled(0.5);
  return found;
}

}  // namespace tubed
