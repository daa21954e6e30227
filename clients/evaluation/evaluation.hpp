// Estimates of a whole run against its truth, and one method against another: the content of the paper's
// Table 1.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string_view>
#include <vector>

#include "clients/evaluation/consistency.hpp"
#include "clients/evaluation/estimates_csv.hpp"
#include "clients/evaluation/misleading.hpp"
#include "clients/evaluation/shape_error.hpp"
#include "clients/evaluation/statistics.hpp"
#include "idl/geometry/camera.hpp"

namespace tubed {

/// One row of Table 1.
struct Metric {
  std::string_view name;
  double ShapeError::*value_mm;
};
inline constexpr std::array<Metric, 5> kMetrics{{{"Hausdorff", &ShapeError::hausdorff_mm},
                                                 {"RMS", &ShapeError::rms_mm},
                                                 {"x RMS", &ShapeError::x_mm},
                                                 {"y RMS", &ShapeError::y_mm},
                                                 {"z RMS", &ShapeError::z_mm}}};

/// What is true at one instant at which an estimate is due.
struct TrueInstant {
  std::uint32_t frame = 0;             ///< under which the estimate is filed
  SampledCentreline truth;             ///< empty when the run does not tell
  std::size_t view_camera = 0;         ///< index of the camera of the instant's first image row
  std::optional<ViewGeometry> view{};  ///< how that one stood; nothing: as in TrueRun::cameras
};

struct TrueRun {
  std::vector<Camera> cameras;  ///< at least one; the first gives the errors their axes
  std::vector<TrueInstant> instants;
};

/// Do the given standard deviations keep their word? Counts coordinates (three a point up to s_max_mm, in
/// view or not; world axes) of the error at equal arc length: sigma is that of the point at s, whatever match
/// the metrics use.
struct SigmaCoverage {
  std::size_t coordinate_count = 0;
  std::array<std::size_t, 3> within{};  ///< 1, 2, 3 sigma
  /// Share within k = 1, 2, 3 sigma. Precondition: coordinate_count > 0.
  [[nodiscard]] double share(std::size_t k) const {
    return static_cast<double>(within[k - 1]) / static_cast<double>(coordinate_count);
  }
};

/// Points, up to s_max_mm and in view or not, by what holds them, with their distances from the true points
/// of the same arc length.
struct HeldPoints {
  std::vector<double> off_mm;
  SigmaCoverage coverage;
};

/// One method (one file of estimates) against the truth.
struct MethodEvaluation {
  std::vector<std::optional<ShapeError>> errors;  ///< one each of TrueRun::instants, same order
  /// One each of errors: how many of its standard deviations the tip is off, on the world axis on which it is
  /// most; nothing where there is no shape, no truth or no sigma.
  std::vector<std::optional<double>> tip_sigmas;
  std::vector<std::uint32_t> missing_frames;    ///< due, and no estimate in the file
  std::vector<std::uint32_t> shapeless_frames;  ///< an estimate with fewer than two points
  std::vector<std::uint32_t> truthless_frames;  ///< estimated, but the truth has no such frame
  std::vector<std::uint32_t> unjudged_frames;   ///< estimated and true, but no point in view
  std::map<Validity, std::size_t> validity_counts;
  SigmaCoverage coverage;
  /// By CentrelinePoint::held_by: nothing, a coil, an image, both; all empty where the file does not say.
  std::array<HeldPoints, 4> held{};
  Consistency consistency;
  /// Of each validity, the instants with misleading points; empty where the file has no covariances.
  std::map<Validity, MisleadingCount> misleading;

  [[nodiscard]] std::size_t judged_count() const;
  /// Values of one metric over the judged instants, mm.
  [[nodiscard]] std::vector<double> values_mm(const Metric& metric) const;
};

/// Throws std::runtime_error when the estimates have a frame that is not due in the run: they belong to
/// another one.
MethodEvaluation evaluate_method(const TrueRun& run, const Estimates& estimates,
                                 const ShapeErrorSettings& settings);

/// One row of Table 1: EM alone against EM and images, over the instants both have.
struct MetricComparison {
  MedianAndIqr em_mm;
  MedianAndIqr fused_mm;
  /// Improvement factor 100 (EM - fused) / EM an instant, %. Not a number when there is nothing to improve:
  /// EM without any error at an instant at which fused has one.
  MedianAndIqr improvement_percent;
  WilcoxonResult wilcoxon;                     ///< of EM - fused
  double p_corrected = 1;                      ///< Bonferroni, for the five metrics
  std::optional<ShapiroWilkResult> normality;  ///< of EM - fused
};

struct Comparison {
  std::size_t pair_count = 0;
  std::array<MetricComparison, kMetrics.size()> metrics;
};

/// Nothing when no instant was judged for both. Both have to come from the same run.
std::optional<Comparison> compare(const MethodEvaluation& em, const MethodEvaluation& fused);

}  // namespace tubed
