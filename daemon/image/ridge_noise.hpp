// How high a ridge filter's answers are where there is no tube.
#pragma once

#include <array>
#include <span>

#include "daemon/image/correspondence_line.hpp"
#include "daemon/image/line_profiles.hpp"

namespace tubed {

/// Ridges of noise, in the dark of an abdomen, are as high as a faint tube's: one more of them says little.
/// Of each line the highest ridge but for two counts, which may be the tube's own and that of another tube
/// beside it; a line of noise has more. Called by the optimizer thread; memory is the object itself.
class RidgeNoise {
 public:
  using Row = std::array<float, 2 * LineProfiles::kMaxReach + 1>;

  /// Of lines next to each other along the tube: the vesselness on each at its first `states` offsets, 1 px
  /// apart. Those that are not in view take no part.
  void measure(std::span<const CorrespondenceLine> lines, std::span<const Row> vesselness, int states);

  /// Around lines[line], the mean over its neighbours, vesselness. 0 where no more than two ridges fit on the
  /// lines.
  [[nodiscard]] float at(std::span<const CorrespondenceLine> lines, std::size_t line) const;

 private:
  std::array<float, kMaxCorrespondenceLines> third_ridge_{};
};

}  // namespace tubed
