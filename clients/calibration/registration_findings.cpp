#include "clients/calibration/registration_findings.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "clients/calibration/formatted.hpp"
#include "clients/calibration/marker_permutation.hpp"
#include "clients/calibration/tail_probability.hpp"

namespace tubed {

namespace {

// An explanation that nobody stated is taken when it is a hundred times likelier than the one that was, and
// one that is a hundred times less likely is out of the question.
const double kLogEvidence = std::log(100.0);
constexpr double kSignificance = 0.01;  // of a whole set of markers
constexpr double kMinSigma_mm = 0.1;    // along an axis; as in marker_permutation.hpp
constexpr double kMaxFreestTurn_deg = 2;
constexpr double kDeg = std::numbers::pi / 180;

double spread_mm(const Eigen::Matrix3Xd& points) {
  return std::sqrt((points.colwise() - points.rowwise().mean()).squaredNorm() /
                   static_cast<double>(points.cols()));
}

void refuse_nearly_collinear(const MarkerRegistration& registration) {
  const double turn_deg = freest_turn_rad(registration) / kDeg;
  if (turn_deg > kMaxFreestTurn_deg) {
    throw MarkerFileError(
        "the markers lie nearly on one line: the turn about it has a standard deviation of " +
        formatted("%.1f", turn_deg) +
        " degrees; use markers that are spread over a volume, 50 mm off that line and more");
  }
}

/// Lengths against each other, which do not ask which marker is which.
CalibrationFinding check_units(const MarkerPairs& pairs) {
  struct Unit {
    double factor;
    const char* words;
  };
  constexpr std::array<Unit, 6> kUnits{{{1e3, "the markers of the world are in micrometres"},
                                        {1e-3, "the markers of the world are in metres"},
                                        {0.1, "the markers of the world are in cm"},
                                        {1 / 25.4, "the markers of the world are in inches"},
                                        {25.4, "the touched markers are in inches"},
                                        {10, "the touched markers are in cm"}}};
  const double ratio = spread_mm(pairs.p_world_mm) / spread_mm(pairs.p_em_mm);
  const std::string evidence =
      formatted("the markers spread over %.4g in the world and %.4g where they were touched",
                spread_mm(pairs.p_world_mm), spread_mm(pairs.p_em_mm));
  for (const Unit& unit : kUnits) {
    if (std::abs(std::log(ratio / unit.factor)) < 0.2) {
      const std::string touched_m = unit.factor == 1e3 ? ", or the touched ones in metres" : "";
      return {"units", ReportVerdict::kBad, evidence,
              "it looks as if " + (unit.words + touched_m) + ": write both in mm"};
    }
  }
  if (ratio < 0.8 || ratio > 1.25) {
    return {"units", ReportVerdict::kBad, evidence,
            "these are not the same markers in the same unit: check both files, mm in both"};
  }
  return {"units", ReportVerdict::kGood, evidence, ""};
}

/// Of two explanations with as many unknowns each: how much likelier `other` is than `stated`, both sums of
/// squared residuals, for a sigma that is not known.
double log_ratio(double stated_mm2, double other_mm2, int degrees_of_freedom) {
  const double floor_mm2 = degrees_of_freedom * kMinSigma_mm * kMinSigma_mm;
  return degrees_of_freedom / 2.0 * std::log((stated_mm2 + floor_mm2) / (other_mm2 + floor_mm2));
}

double fre_of(double squared_mm2, std::size_t count) {
  return std::sqrt(squared_mm2 / static_cast<double>(count));
}

CalibrationFinding check_mirrored(const MarkerPairs& pairs, const MarkerRegistration& registration) {
  const double as_stated_mm2 = registration.residual_world_mm.squaredNorm();
  const double mirrored_mm2 = mirrored_squared_residuals_mm2(pairs.p_world_mm, pairs.p_em_mm);
  const double likelier = log_ratio(as_stated_mm2, mirrored_mm2, registration.degrees_of_freedom);
  const std::string evidence = formatted("residuals of %.2f mm RMS as they are, %.2f mm in a mirror",
                                         registration.fre_mm, fre_of(mirrored_mm2, pairs.size()));
  // Two exchanged markers near a plane fit better in a mirror, too: the likelier explanation is told.
  const auto other = likelier > kLogEvidence ? best_other_order(pairs, likelier) : std::nullopt;
  if (other && other->log_likelihood_ratio - other->log_alternatives > likelier) {
    return {"handedness", ReportVerdict::kGood,
            evidence + ", but another order of the markers fits better still", ""};
  }
  if (likelier > kLogEvidence) {
    return {"handedness", ReportVerdict::kBad, evidence,
            "one file has left-handed coordinates: one axis, or all three, has the wrong sign. Between LPS "
            "and RAS "
            "x AND y change their sign, never one of them alone"};
  }
  if (likelier > -kLogEvidence) {
    return {"handedness", ReportVerdict::kGood, evidence + ": the markers lie too near a plane to tell", ""};
  }
  return {"handedness", ReportVerdict::kGood, evidence, ""};
}

CalibrationFinding check_order(const MarkerPairs& pairs, const MarkerRegistration& registration) {
  const auto other = best_other_order(pairs, -kLogEvidence);
  if (!other) {
    return {"names", ReportVerdict::kGood,
            "no other order of the markers fits, by a factor of 100 in likelihood", ""};
  }
  const std::string evidence =
      formatted("residuals of %.2f mm RMS by the names, %.2f mm if ", registration.fre_mm,
                fre_of(other->squared_residuals_mm2, pairs.size())) +
      words_for(*other, pairs.names);
  if (other->log_likelihood_ratio > kLogEvidence + other->log_alternatives) {
    return {"names", ReportVerdict::kBad, evidence, "correct the names, or touch these markers again"};
  }
  return {"names", ReportVerdict::kDoubtful, evidence,
          "the markers are so nearly symmetric that the residuals cannot tell: make sure that each was "
          "touched under "
          "its own name, or move one marker out of the symmetry"};
}

/// Leave-one-out, worst first: the marker of the smallest probability is named when that times the number of
/// markers is below the level (Bonferroni), then the others are tested without it.
std::vector<std::size_t> find_outliers(const MarkerPairs& pairs, std::optional<double> fle_mm) {
  std::vector<std::size_t> outliers;
  MarkerPairs left = pairs;
  std::vector<std::size_t> index(pairs.size());
  for (std::size_t i = 0; i < index.size(); ++i) index[i] = i;
  while (left.size() > 3) {
    const std::vector<LeftOut> all = leave_one_out(left, fle_mm);
    const auto least = std::min_element(
        all.begin(), all.end(), [](const LeftOut& a, const LeftOut& b) { return a.p_value < b.p_value; });
    if (least->p_value * static_cast<double>(left.size()) > kSignificance) break;
    const auto at = static_cast<std::size_t>(least - all.begin());
    outliers.push_back(index[at]);
    left = left.without(at);
    index.erase(index.begin() + static_cast<std::ptrdiff_t>(at));
  }
  return outliers;
}

CalibrationFinding describe_outliers(const JudgedRegistration& judged) {
  if (judged.left_out.empty()) {
    return {"outliers", ReportVerdict::kDoubtful, "three markers cannot contradict each other",
            "touch more markers, better six than three"};
  }
  if (judged.outliers.empty()) {
    return {"outliers", ReportVerdict::kGood, "no marker contradicts the others", ""};
  }
  std::vector<std::string> names;
  for (const std::size_t i : judged.outliers) names.push_back(judged.pairs.names[i]);
  const std::size_t first = judged.outliers.front();
  return {"outliers", ReportVerdict::kBad,
          names.front() +
              formatted(" lies %.1f mm from where the others have it", judged.left_out[first].error_mm) +
              (names.size() > 1 ? "; contradicting: " + list_of(names) : ""),
          "touch " + list_of(names) + " again, or leave out with --exclude " + names.front()};
}

/// Registered lengths against those of the world; a scale is estimated for this and nothing else.
CalibrationFinding check_scale(const MarkerPairs& pairs, const MarkerRegistration& registration) {
  const Eigen::Matrix3Xd touched_mm = registration.T_world_em.linear() * pairs.p_em_mm;
  const Eigen::Matrix3Xd q_em = touched_mm.colwise() - touched_mm.rowwise().mean();
  const Eigen::Matrix3Xd q_world = pairs.p_world_mm.colwise() - registration.centroid_world_mm;
  const double length2_mm2 = q_em.squaredNorm();
  const double scale = q_em.cwiseProduct(q_world).sum() / length2_mm2;
  const double explained_mm2 = (scale - 1) * (scale - 1) * length2_mm2;
  const double left_mm2 = std::max(registration.residual_world_mm.squaredNorm() - explained_mm2, 0.0);
  const double dof = registration.degrees_of_freedom - 1;
  const double sigma2_mm2 = std::max(left_mm2 / dof, kMinSigma_mm * kMinSigma_mm);
  const double percent = 100 * (scale - 1);
  const std::string evidence = formatted("lengths in the world are %+.2f %% of the touched ones, +- %.2f",
                                         percent, 100 * std::sqrt(sigma2_mm2 / length2_mm2));
  if (f_tail(explained_mm2 / sigma2_mm2, 1, dof) < kSignificance && std::abs(percent) > 0.5) {
    return {
        "scale", ReportVerdict::kDoubtful, evidence,
        "the tracker's field is distorted by metal nearby, or the size of the voxels in the CT is not right"};
  }
  return {"scale", ReportVerdict::kGood, evidence, ""};
}

CalibrationFinding check_residuals(const MarkerRegistration& registration) {
  const double degrees = registration.degrees_of_freedom;
  const std::string evidence =
      formatted("FRE %.2f mm RMS, FLE %.2f mm", registration.fre_mm, registration.fle_mm);
  if (!registration.fle_stated) {
    const double limit_mm = 2;
    return registration.fre_mm > limit_mm
               ? CalibrationFinding{"residuals", ReportVerdict::kDoubtful, evidence,
                                    "more than 2 mm: look for metal near the "
                                    "field generator, a tip offset that is "
                                    "not right, markers that moved since the CT"}
               : CalibrationFinding{"residuals", ReportVerdict::kGood, evidence, ""};
  }
  const double squared =
      registration.residual_world_mm.squaredNorm() * 3 / (registration.fle_mm * registration.fle_mm);
  const double p = chi_square_tail(squared, degrees);
  const std::string against =
      evidence + formatted(" as stated, which residuals like these exceed with p = %.2g", p);
  return p < kSignificance
             ? CalibrationFinding{"residuals", ReportVerdict::kDoubtful, against,
                                  "they are larger than the stated FLE explains: state a larger one, or "
                                  "leave --fle out"}
             : CalibrationFinding{"residuals", ReportVerdict::kGood, against, ""};
}

/// By those that are no outliers.
MarkerRegistration register_others(const JudgedRegistration& judged, std::optional<double> fle_mm) {
  MarkerPairs others = judged.pairs;
  std::vector<std::size_t> outliers = judged.outliers;
  std::sort(outliers.rbegin(), outliers.rend());
  for (const std::size_t i : outliers) others = others.without(i);
  return register_markers(others, fle_mm);
}

/// Residual that some marker of a sound set exceeds with the level's probability, mm: a residual is about
/// FLE sqrt(1 - 2 / n) / sqrt(3) along each axis, with the FLE of those that are no outliers.
double outlier_limit_mm(const MarkerRegistration& registration) {
  const auto n = static_cast<double>(registration.size());
  const double sigma_mm = registration.fle_mm * std::sqrt((1 - 2 / n) / 3);
  return sigma_mm * std::sqrt(chi_square_quantile(1 - kSignificance / n, 3));
}

}  // namespace

ReportVerdict worst(const std::vector<CalibrationFinding>& findings) {
  ReportVerdict verdict = ReportVerdict::kGood;
  for (const CalibrationFinding& finding : findings) verdict = std::max(verdict, finding.verdict);
  return verdict;
}

JudgedRegistration judge_registration(MarkerPairs pairs, std::optional<double> fle_mm) {
  JudgedRegistration judged{std::move(pairs), {}, {}, {}, 0, {}};
  judged.registration = register_markers(judged.pairs, fle_mm);
  judged.left_out = leave_one_out(judged.pairs, fle_mm);
  const auto is_wrong_with = [&](CalibrationFinding finding) {
    judged.findings.push_back(std::move(finding));
    return judged.findings.back().verdict == ReportVerdict::kBad;
  };
  if (is_wrong_with(check_units(judged.pairs))) return judged;
  if (is_wrong_with(check_mirrored(judged.pairs, judged.registration))) return judged;
  if (is_wrong_with(check_order(judged.pairs, judged.registration))) return judged;
  judged.outliers = find_outliers(judged.pairs, fle_mm);
  // One marker far off makes the turn of any set look unknown.
  const MarkerRegistration others = register_others(judged, fle_mm);
  refuse_nearly_collinear(others);
  judged.outlier_limit_mm = outlier_limit_mm(others);
  if (is_wrong_with(describe_outliers(judged))) return judged;
  judged.findings.push_back(check_scale(judged.pairs, judged.registration));
  judged.findings.push_back(check_residuals(judged.registration));
  return judged;
}

}  // namespace tubed
