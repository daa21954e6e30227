// Where the tube is in the image, measured on lines normal to its projected centreline.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>

#include "daemon/image/appearance_model.hpp"
#include "daemon/image/image_measurement.hpp"

namespace tubed {

/// One line: before the search its base and direction, after it what was found.
struct CorrespondenceLine {
  Eigen::Vector2d base_px = Eigen::Vector2d::Zero();  ///< projected centreline point
  Eigen::Vector2d normal = Eigen::Vector2d::UnitX();  ///< unit, normal to the projected centreline
  double half_width_px = 0;                           ///< of the tube's projection; 0 where nobody asks
  bool in_view = false;                               ///< set by the caller; the others are passed over
  double offset_px = 0;                               ///< found: mean of the posterior along the normal
  double variance_px2 = 0;                            ///< found: its variance
  bool agrees = false;                                ///< the image shows a ridge there, and no edge
};

/// Finds the offsets of neighbouring lines together: a chain whose states are offsets along each line, whose
/// transitions prefer a smooth tube and whose evidence is the vesselness, or how tube-like the pixels are.
/// Mean and variance of each line's posterior come from the forward-backward recursion, so a faint stretch is
/// carried by its neighbours and says so by a larger variance. Called by the optimizer thread; memory is the
/// object itself, search() never allocates.
class LineSearch {
 public:
  static constexpr int kMaxLines = 256;
  static constexpr int kMaxReach = 24;  ///< px to either side

  /// What a search found over all lines.
  struct Outcome {
    int in_view = 0;          ///< lines that could be searched
    double inlier_ratio = 0;  ///< share of those not on an edge that agree
    float ridge_height = 0;   ///< usual vesselness of the tube: median over the lines of their maxima
  };

  /// Searches lines[0 .. count), neighbours along the tube next to each other, `reach_px` (1 .. kMaxReach) to
  /// either side. `transition_px`: standard deviation of the offset's change from one line to the next.
  Outcome search(const ImageMeasurement& image, std::array<CorrespondenceLine, kMaxLines>& lines, int count,
                 int reach_px, double transition_px);

  /// The same with another evidence: log(P_f / P_b) of `model`, the mean over the line's half width to either
  /// side. A line agrees when what it found looks more like tube than like background.
  Outcome search(const ImageMeasurement& image, const AppearanceModel& model,
                 std::array<CorrespondenceLine, kMaxLines>& lines, int count, int reach_px,
                 double transition_px);

  /// Fills `agrees` by the model, for lines whose offsets somebody else has found.
  Outcome judge(const ImageMeasurement& image, const AppearanceModel& model,
                std::array<CorrespondenceLine, kMaxLines>& lines, int count, int reach_px);

 private:
  static constexpr int kMaxStates = 2 * kMaxReach + 1;
  using Row = std::array<float, kMaxStates>;

  void sample(const ImageMeasurement& image, const std::array<CorrespondenceLine, kMaxLines>& lines,
              int count, int reach_px);
  [[nodiscard]] float ridge_height(const std::array<CorrespondenceLine, kMaxLines>& lines, int count,
                                   int states);
  void to_evidence(const std::array<CorrespondenceLine, kMaxLines>& lines, int count, int states,
                   float height);
  void to_evidence(const ImageMeasurement& image, const AppearanceModel& model,
                   const std::array<CorrespondenceLine, kMaxLines>& lines, int count, int reach_px);
  void find_moments(std::array<CorrespondenceLine, kMaxLines>& lines, int count, int reach_px) const;
  void doubt_edges(const ImageMeasurement& image, std::array<CorrespondenceLine, kMaxLines>& lines, int count,
                   int reach_px);
  void run_chain(int count, int states, double transition_px);

  std::array<Row, kMaxLines> vesselness_;
  std::array<Row, kMaxLines> evidence_;  ///< P(y | tube here) / P(y | background)
  std::array<Row, kMaxLines> forward_;
  std::array<Row, kMaxLines> backward_;
  std::array<float, kMaxLines> peaks_;
  std::array<bool, kMaxLines> on_edge_;
};

}  // namespace tubed
