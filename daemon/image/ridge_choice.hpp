// Which of two ridges side by side is the tube's?
#pragma once

#include <array>
#include <span>

#include "daemon/image/correspondence_line.hpp"
#include "daemon/image/line_profiles.hpp"

namespace tubed {

/// Another catheter beside the tracked one explains a stretch of lines as well as the tube itself; only where
/// the tube was predicted tells them apart. The prediction decides between ridges and says nothing else: the
/// chain is run with it, and where it finds another ridge than the image alone does, the image's one becomes
/// background. Offsets and variances are of the evidence alone, for the prediction is fused later.
/// Called by the optimizer thread, in the order prefer(), settle(). Memory is the object itself.
class RidgeChoice {
 public:
  static constexpr int kMaxStates = 2 * LineProfiles::kMaxReach + 1;
  using Row =
      std::array<float, kMaxStates>;  ///< P(y | tube here) / P(y | background), offsets -reach .. reach

  /// Multiplies each line's evidence by the likelihood of its prediction, and keeps what the lines have found
  /// without it; false, and nothing is done, when none was predicted.
  bool prefer(std::span<const CorrespondenceLine> lines, int reach_px, std::span<Row> evidence);

  /// After a chain with that evidence: restores the evidence and what was found before it, and makes another
  /// tube's ridges background. Whether there are any, so that the chain has to be run again.
  bool settle(std::span<CorrespondenceLine> lines, int reach_px, std::span<Row> evidence) const;

 private:
  struct Found {
    double offset_px = 0;
    double variance_px2 = 0;
  };

  std::array<Row, kMaxCorrespondenceLines> alone_;
  std::array<Found, kMaxCorrespondenceLines> found_;
};

}  // namespace tubed
