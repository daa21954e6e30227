#include "clients/calibration/straight_catheter.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "clients/calibration/coil_rest.hpp"
#include "idl/geometry/squared.hpp"

namespace tubed {

namespace {

constexpr int kMinMeasurements = 20;
constexpr double kMinTime_s = 1;
constexpr std::size_t kMinCoils = 3;  // two lie on a line whatever the catheter does
constexpr double kMaxBeside_mm = 3;   // beyond, it is not straight: 3 mm over 360 mm cost 0.07 mm of length
constexpr double kMaxTipBeside_mm = 10;  // of a touched tip
constexpr double kMovedBy_mm = 1;    // by which the coils next to one that was not measured move, to be told
constexpr double kMaxAngle_deg = 5;  // of a coil's direction to the line
constexpr double kOrderBy_mm = 5;    // distances that fit the reverse order so much better
constexpr double kUsualLasting_mm = 0.3;  // of the field, before anything was seen

double degrees(double rad) { return rad * 180 / std::numbers::pi; }
std::string text_of(const char* format, auto... values) {
  std::array<char, 320> text{};
  std::snprintf(text.data(), text.size(), format, values...);
  return text.data();
}

/// The line of one recording, and where coils lie along it, counted away from the tip.
struct Line {
  Eigen::Vector3d origin_mm;      ///< the middle of the coils
  Eigen::Vector3d away_from_tip;  ///< unit
  std::vector<std::optional<CoilRest>> rests;
  std::vector<double> along_mm;  ///< an element a coil
  double beside_square_mm2 = 0;  ///< sum over coils and both axes
  int freedom = 0;               ///< of that sum
  bool is_reversed = false;      ///< against the order that is stated
};

std::vector<std::size_t> measured(const Line& line) {
  std::vector<std::size_t> coils;
  for (std::size_t k = 0; k < line.rests.size(); ++k) {
    if (line.rests[k]) {
      coils.push_back(k);
    }
  }
  return coils;
}

/// Turns the line away from the tip: by how most coils' order says it lies.
void orient(const InstrumentDescription& instrument, Line& line) {
  const auto coils = measured(line);
  double correlation = 0;
  double mean_mm = 0;
  for (const std::size_t k : coils) {
    mean_mm += instrument.coils[k].offset_from_tip_mm / static_cast<double>(coils.size());
  }
  for (const std::size_t k : coils) {
    correlation += (instrument.coils[k].offset_from_tip_mm - mean_mm) *
                   line.away_from_tip.dot(line.rests[k]->p_em_mm - line.origin_mm);
  }
  if (correlation < 0) {
    line.away_from_tip = -line.away_from_tip;
  }
}

Line fit(const CoilRecording& recording) {
  const InstrumentDescription& instrument = recording.instrument;
  Line line{Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitX(), {}, {}};
  for (const CoilPlacement& coil : instrument.coils) {
    line.rests.push_back(rest_of(recording.measurements, coil, kMinMeasurements));
  }
  const auto coils = measured(line);
  if (coils.size() < kMinCoils) {
    throw CalibrationError(recording.from +
                           text_of(": %zu coils were measured %d times or more, 3 are needed to see "
                                   "whether the catheter is straight; see `tubectl doctor "
                                   "--tracker` for coils that are missing",
                                   coils.size(), kMinMeasurements));
  }
  for (const std::size_t k : coils) {
    if (line.rests[k]->moved_mm > line.rests[k]->moved_limit_mm) {
      throw CalibrationError(recording.from +
                             text_of(": coil %zu (sensor %d) moved by %.1f mm; hold the catheter still "
                                     "and record again",
                                     k + 1, instrument.coils[k].sensor, line.rests[k]->moved_mm));
    }
    line.origin_mm += line.rests[k]->p_em_mm / static_cast<double>(coils.size());
  }
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const std::size_t k : coils) {
    const Eigen::Vector3d off = line.rests[k]->p_em_mm - line.origin_mm;
    scatter += off * off.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(scatter);
  line.away_from_tip = axes.eigenvectors().col(2);
  line.beside_square_mm2 = axes.eigenvalues()[0] + axes.eigenvalues()[1];
  line.freedom = 2 * static_cast<int>(coils.size()) - 4;
  orient(instrument, line);
  for (const auto& rest : line.rests) {
    line.along_mm.push_back(rest ? line.away_from_tip.dot(rest->p_em_mm - line.origin_mm) : 0);
  }
  return line;
}

double beside_mm(const Line& line, std::size_t coil) {
  const Eigen::Vector3d off = line.rests[coil]->p_em_mm - line.origin_mm;
  return (off - line.away_from_tip.dot(off) * line.away_from_tip).norm();
}

/// Degrees between the coil's direction toward the tip and the line's.
double angle_deg(const Line& line, std::size_t coil, const CoilPlacement& placement) {
  const double dot = -line.away_from_tip.dot(line.rests[coil]->tangent_em) * (placement.flipped ? -1 : 1);
  return degrees(std::acos(std::clamp(dot, -1.0, 1.0)));
}

/// Distances that are a thousand or so times too small or too large are no distances in mm.
void refuse_units(const CoilRecording& recording, const Line& line) {
  const auto coils = measured(line);
  const auto& placements = recording.instrument.coils;
  const double found_mm = std::abs(line.along_mm[coils.back()] - line.along_mm[coils.front()]);
  const double stated_mm =
      placements[coils.back()].offset_from_tip_mm - placements[coils.front()].offset_from_tip_mm;
  if (found_mm > 5 * stated_mm || stated_mm > 5 * found_mm) {
    throw CalibrationError(
        recording.from +
        text_of(": the coils lie %.3g apart, %.0f mm are stated: check the units (mm) of the "
                "recording, and whether it is this catheter",
                found_mm, stated_mm));
  }
}

void refuse_bent(const CoilRecording& recording, const Line& line) {
  std::size_t worst = measured(line).front();
  int tilted = 0;
  int judged = 0;
  double lowest = 180;
  for (const std::size_t k : measured(line)) {
    worst = beside_mm(line, k) > beside_mm(line, worst) ? k : worst;
    const double angle = angle_deg(line, k, recording.instrument.coils[k]);
    const double to_line = std::min(angle, 180 - angle);
    tilted += to_line > kMaxAngle_deg ? 1 : 0;
    lowest = std::min(lowest, to_line);
    ++judged;
  }
  if (beside_mm(line, worst) > kMaxBeside_mm) {
    throw CalibrationError(
        recording.from +
        text_of(": the catheter is not straight: coil %zu (sensor %d) lies %.1f mm beside the line through "
                "all coils, at most %.0f mm are allowed; press it into the groove, or one coil is wrong",
                worst + 1, recording.instrument.coils[worst].sensor, beside_mm(line, worst), kMaxBeside_mm));
  }
  if (judged > 1 && tilted > judged / 2) {
    throw CalibrationError(recording.from +
                           text_of(": %d of %d coils point more than %.0f degrees off the line: the "
                                   "catheter is bent between them; press it into the groove",
                                   tilted, judged, kMaxAngle_deg));
  }
}

// It would be taken for where it falls on the line.
void refuse_tip_beside(const CoilRecording& recording, const Line& line, const StraightTip& tip) {
  if (!tip.p_em_mm) return;
  const Eigen::Vector3d from_line_mm = *tip.p_em_mm - line.origin_mm;
  const double beside_mm = from_line_mm.cross(line.away_from_tip).norm();
  if (beside_mm <= kMaxTipBeside_mm) return;
  throw CalibrationError(recording.from +
                         text_of(": the tip at (%.4g, %.4g, %.4g) lies %.0f mm beside the line through the "
                                 "coils, at most %.0f mm are allowed: give it in mm, in the tracker's "
                                 "coordinates, touched where the catheter lay in this recording (of several "
                                 "places of the groove, give the one that was touched)",
                                 tip.p_em_mm->x(), tip.p_em_mm->y(), tip.p_em_mm->z(), beside_mm,
                                 kMaxTipBeside_mm));
}

/// RMS of the differences between distances of neighbours as stated and as measured, in this order or the
/// reverse one.
double order_misfit_mm(const InstrumentDescription& instrument, const Line& line, bool reversed) {
  auto coils = measured(line);
  double sum = 0;
  for (std::size_t i = 0; i + 1 < coils.size(); ++i) {
    const std::size_t from = reversed ? coils[coils.size() - 1 - i] : coils[i];
    const std::size_t to = reversed ? coils[coils.size() - 2 - i] : coils[i + 1];
    const double stated =
        instrument.coils[coils[i + 1]].offset_from_tip_mm - instrument.coils[coils[i]].offset_from_tip_mm;
    const double found = std::abs(line.along_mm[to] - line.along_mm[from]);
    sum += squared(found - stated);
  }
  return std::sqrt(sum / static_cast<double>(coils.size() - 1));
}

/// Order and direction: which of them contradicts the other, or what was stated.
void find_mistakes(const CoilRecording& recording, const Line& line, const StraightTip& tip,
                   StraightCatheter& result) {
  const auto& placements = recording.instrument.coils;
  const auto coils = measured(line);
  for (std::size_t i = 0; i + 1 < coils.size(); ++i) {
    if (line.along_mm[coils[i + 1]] <= line.along_mm[coils[i]]) {
      result.mistakes.push_back(text_of(
          "coil %zu (sensor %d) and coil %zu (sensor %d) lie in the other order along the groove: "
          "exchange their sensor numbers, or their plugs",
          coils[i] + 1, placements[coils[i]].sensor, coils[i + 1] + 1, placements[coils[i + 1]].sensor));
    }
  }
  std::vector<std::size_t> away;
  for (const std::size_t k : coils) {
    result.coils[k].points_away = angle_deg(line, k, placements[k]) > 90;
    if (result.coils[k].points_away) {
      away.push_back(k);
    }
  }
  const bool all_away = away.size() == coils.size();
  const double as_stated_mm = order_misfit_mm(recording.instrument, line, false);
  const double reversed_mm = order_misfit_mm(recording.instrument, line, true);
  const bool tip_is_behind = tip.p_em_mm && line.away_from_tip.dot(*tip.p_em_mm - line.origin_mm) > 0;
  if (tip_is_behind || (all_away && reversed_mm + kOrderBy_mm < as_stated_mm)) {
    result.mistakes.push_back(text_of(
        "the coils' order is reversed: sensor %d, stated furthest from the tip, is the nearest; give the "
        "sensors in the other order (distances then fit to %.1f mm instead of %.1f mm)",
        placements[coils.back()].sensor, reversed_mm, as_stated_mm));
  } else if (all_away) {
    result.mistakes.push_back(
        "all coils point away from the tip: either their order is reversed, which their distances do not "
        "tell, or each is mounted backward (flipped = true); give the tip's place (--tip) to tell which");
  } else {
    for (const std::size_t k : away) {
      result.mistakes.push_back(text_of("coil %zu (sensor %d) points away from the tip: flipped = %s there",
                                        k + 1, placements[k].sensor,
                                        placements[k].flipped ? "false" : "true"));
    }
  }
  for (const std::size_t k : coils) {
    const double angle = std::min(result.coils[k].angle_deg, 180 - result.coils[k].angle_deg);
    if (angle > kMaxAngle_deg) {
      result.remarks.push_back(
          text_of("coil %zu (sensor %d) points %.1f degrees off the line: it sits askew, or the "
                  "field is bent there",
                  k + 1, placements[k].sensor, angle));
    }
  }
}

/// From the tip to the first coil that was measured, and the variance of that.
std::pair<double, double> first_offset(const Line& line, std::size_t first, const StraightTip& tip,
                                       double stated_mm) {
  if (tip.p_em_mm) {
    const double tip_along_mm = line.away_from_tip.dot(*tip.p_em_mm - line.origin_mm);
    return {line.along_mm[first] - tip_along_mm, squared(tip.p_sigma_mm)};
  }
  if (tip.beyond_coil_mm) {
    return {*tip.beyond_coil_mm, squared(tip.beyond_sigma_mm)};
  }
  return {stated_mm, 0};
}

void place_coils(const std::vector<Line>& lines, const StraightTip& tip, StraightCatheter& result) {
  const double many = static_cast<double>(lines.size());
  std::vector<std::size_t> common;
  for (std::size_t k = 0; k < result.coils.size(); ++k) {
    if (std::all_of(lines.begin(), lines.end(),
                    [k](const Line& line) { return line.rests[k].has_value(); })) {
      common.push_back(k);
    }
  }
  const std::size_t first = common.front();
  for (const std::size_t k : common) {
    StraightCoil& coil = result.coils[k];
    std::vector<double> found_mm;
    double variance = 0;
    for (const Line& line : lines) {
      const auto [offset_mm, tip_variance] = first_offset(line, first, tip, result.coils[first].stated_mm);
      found_mm.push_back(offset_mm + line.along_mm[k] - line.along_mm[first]);
      variance = tip_variance;
      coil.measurements += line.rests[k]->measurements;
      coil.noise_mm = std::max(coil.noise_mm, line.rests[k]->noise_mm.maxCoeff());
      coil.beside_mm = std::max(coil.beside_mm, beside_mm(line, k));
    }
    coil.found_mm = 0;
    for (const double found : found_mm) {
      coil.found_mm += found / many;
    }
    // With the tip touched, its place and the coil's err; otherwise both coils do, the first and this one.
    const bool is_reference = k == first && !tip.p_em_mm;
    const double coils_in_it = tip.p_em_mm ? 1 : is_reference ? 0 : 2;
    const double white = squared(coil.noise_mm) / coil.measurements;
    coil.sigma_mm = std::sqrt(variance + coils_in_it * (squared(result.lasting_mm) / many + white));
    coil.was_found = result.has_tip || !is_reference;
  }
}

/// By how much the coils next to one move, in the mean.
double neighbours_move_mm(const Line& line, const StraightCatheter& result, std::size_t coil) {
  double sum = 0;
  int count = 0;
  const auto take_next = [&](int step) {
    for (int k = static_cast<int>(coil) + step; k >= 0 && k < static_cast<int>(result.coils.size());
         k += step) {
      if (!line.rests[static_cast<std::size_t>(k)]) continue;
      const StraightCoil& next = result.coils[static_cast<std::size_t>(k)];
      sum += next.found_mm - next.stated_mm;
      ++count;
      return;
    }
  };
  take_next(-1);
  take_next(1);
  return count > 0 ? sum / count : 0;
}

void say_unmeasured(const Line& line, StraightCatheter& result) {
  for (std::size_t k = 0; k < result.coils.size(); ++k) {
    if (line.rests[k]) continue;
    std::string remark = text_of("coil %zu (sensor %d) was not measured; its arc length stays as stated",
                                 k + 1, result.coils[k].sensor);
    const double move_mm = neighbours_move_mm(line, result, k);
    if (std::abs(move_mm) > kMovedBy_mm) {
      remark += text_of(", although the coils next to it move by %+.1f mm: measure it, or move it by as much",
                        move_mm);
    }
    result.remarks.push_back(remark);
  }
}

}  // namespace

StraightCatheter measure_straight(const std::vector<CoilRecording>& placements, const StraightTip& tip) {
  StraightCatheter result;
  for (const CoilPlacement& coil : placements.front().instrument.coils) {
    result.coils.push_back({coil.sensor, coil.offset_from_tip_mm, coil.offset_from_tip_mm});
  }
  result.has_tip = tip.p_em_mm || tip.beyond_coil_mm;
  result.placements = static_cast<int>(placements.size());
  std::vector<Line> lines;
  double beside_square = 0;
  int freedom = 0;
  for (const CoilRecording& recording : placements) {
    require_time(recording, kMinTime_s);
    lines.push_back(fit(recording));
    refuse_units(recording, lines.back());
    refuse_bent(recording, lines.back());
    refuse_tip_beside(recording, lines.back(), tip);
    beside_square += lines.back().beside_square_mm2;
    freedom += lines.back().freedom;
  }
  for (std::size_t k = 0; k < result.coils.size(); ++k) {
    if (lines.front().rests[k]) {
      result.coils[k].angle_deg = angle_deg(lines.front(), k, placements.front().instrument.coils[k]);
    }
  }
  result.line_rms_mm = std::sqrt(beside_square / freedom);
  // Predictive of Student's t with two degrees of freedom of what is usual: variance sum / (nu - 2).
  result.lasting_mm = std::sqrt((beside_square + 2 * squared(kUsualLasting_mm)) / freedom);
  find_mistakes(placements.front(), lines.front(), tip, result);
  place_coils(lines, tip, result);
  say_unmeasured(lines.front(), result);
  return result;
}

}  // namespace tubed
