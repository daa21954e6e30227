// Where the tube is in the image, measured on lines normal to its projected centreline.
#pragma once

#include <array>
#include <cstdint>

#include "daemon/image/appearance_model.hpp"
#include "daemon/image/correspondence_line.hpp"
#include "daemon/image/image_measurement.hpp"
#include "daemon/image/line_profiles.hpp"
#include "daemon/image/ridge_choice.hpp"
#include "daemon/image/ridge_claims.hpp"
#include "daemon/image/ridge_noise.hpp"

namespace tubed {

/// Finds the offsets of neighbouring lines together: a chain whose states are offsets along each line, whose
/// transitions prefer a smooth tube and whose evidence is the vesselness, or how tube-like the pixels are.
/// Mean and variance of each line's posterior come from the forward-backward recursion, so a faint stretch is
/// carried by its neighbours and says so by a larger variance. Where another tube's ridge lies beside the
/// tube's, RidgeChoice says which is which; where two stretches of the tube have found one ridge, one of them
/// looks again without it. Called by the optimizer thread; memory is the object itself, search() never
/// allocates.
class LineSearch {
 public:
  static constexpr int kMaxLines = kMaxCorrespondenceLines;
  static constexpr int kMaxReach = LineProfiles::kMaxReach;  ///< px to either side

  enum class Manner {
    kAsPublished,  ///< vesselness alone
    kThorough  ///< LineProfiles beside it; where two stretches have found one ridge RidgeClaims says whose
  };

  /// What ridges beside the tube's are taken for.
  enum class Among {
    kTubes,  ///< other tubes: each ridge counts by its height
    kNoise   ///< where there are many, as high as the tube's, each of them counts less
  };

  explicit LineSearch(Manner manner = Manner::kThorough) : is_thorough_(manner == Manner::kThorough) {}

  /// What a search found over all lines.
  struct Outcome {
    int in_view = 0;          ///< lines that could be searched
    double inlier_ratio = 0;  ///< share of those not on an edge that agree
    float ridge_height = 0;   ///< usual vesselness of the tube: median over the lines of their maxima
  };

  /// Searches lines[0 .. count), neighbours along the tube next to each other, `reach_px` (1 .. kMaxReach) to
  /// either side. `transition_px`: standard deviation of the offset's change from one line to the next.
  Outcome search(const ImageMeasurement& image, std::array<CorrespondenceLine, kMaxLines>& lines, int count,
                 int reach_px, double transition_px, Among among = Among::kTubes);

  /// The same with another evidence: log(P_f / P_b) of `model`, the mean over the line's half width to either
  /// side. A line agrees when what it found looks more like tube than like background.
  Outcome search(const ImageMeasurement& image, const AppearanceModel& model,
                 std::array<CorrespondenceLine, kMaxLines>& lines, int count, int reach_px,
                 double transition_px);

  /// Fills `agrees` by the model, for lines whose offsets somebody else has found.
  Outcome judge(const ImageMeasurement& image, const AppearanceModel& model,
                std::array<CorrespondenceLine, kMaxLines>& lines, int count, int reach_px);

 private:
  static constexpr int kMaxStates = RidgeChoice::kMaxStates;
  using Row = RidgeChoice::Row;

  void sample(const ImageMeasurement& image, const std::array<CorrespondenceLine, kMaxLines>& lines,
              int count, int reach_px);
  [[nodiscard]] float ridge_height(const std::array<CorrespondenceLine, kMaxLines>& lines, int count,
                                   int states);
  void to_evidence(const std::array<CorrespondenceLine, kMaxLines>& lines, int count, int states,
                   float height, Among among);
  void to_evidence(const ImageMeasurement& image, const AppearanceModel& model,
                   const std::array<CorrespondenceLine, kMaxLines>& lines, int count, int reach_px);
  void find_moments(std::array<CorrespondenceLine, kMaxLines>& lines, int count, int reach_px) const;
  void doubt_edges(const ImageMeasurement& image, std::array<CorrespondenceLine, kMaxLines>& lines, int count,
                   int reach_px);
  void run_chain(int count, int states, double transition_px);
  void find(std::array<CorrespondenceLine, kMaxLines>& lines, int count, int reach_px, double transition_px);
  void look_beside(int count, int reach_px);
  void leave_to_others(int count, int reach_px);
  void doubt_claims(std::array<CorrespondenceLine, kMaxLines>& lines, int count, int reach_px) const;

  bool is_thorough_;
  std::array<Row, kMaxLines> vesselness_;
  std::array<Row, kMaxLines> evidence_;  ///< P(y | tube here) / P(y | background)
  std::array<Row, kMaxLines> forward_;
  std::array<Row, kMaxLines> backward_;
  std::array<float, kMaxLines> peaks_;
  std::array<bool, kMaxLines> on_edge_;
  LineProfiles profiles_;
  RidgeNoise noise_;
  RidgeChoice choice_;
  RidgeClaims claims_;
  RidgeClaims::PerLine on_ridge_{};
  RidgeClaims::PerLine sees_another_{};
};

}  // namespace tubed
