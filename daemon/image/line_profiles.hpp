// How far the greys across a line stand out as those of a tube of the expected width would.
#pragma once

#include <array>
#include <span>

#include "daemon/image/correspondence_line.hpp"
#include "daemon/image/image_measurement.hpp"

namespace tubed {

/// A tube is darker (brighter, as the image's polarity is) over its width than on both of its sides. A ridge
/// filter asks that of circles, so a dark noisy stretch answers to it everywhere, and of several widths, so
/// the edge of the spine does; a caller that knows the tube's course and width may test more. Called by the
/// optimizer thread; memory is the object itself.
class LineProfiles {
 public:
  static constexpr int kMaxReach = 24;  ///< px to either side

  /// Looks across those of the lines that are in view, `reach_px` (1 .. kMaxReach) to either side. Lines
  /// next to each other share the level of noise.
  void measure(const ImageMeasurement& image, std::span<const CorrespondenceLine> lines, int reach_px);

  /// Whether lines[line] was looked at: in view, of a known half width below 10 px, and something stands out
  /// somewhere.
  [[nodiscard]] bool knows(std::size_t line) const { return slope_[line] > 0; }

  /// log(P(greys | tube at this offset) / P(greys | none)) of lines[line], offset `state` - reach_px. The
  /// noisier it is there, the nearer to 0; 0 of lines of which nothing is known.
  [[nodiscard]] float log_odds(std::size_t line, std::size_t state) const {
    return slope_[line] * (contrast_[line][state] - 0.5F);
  }

 private:
  static constexpr int kPadding = 12;  ///< px beyond the reach, for the sides

  using Greys = std::array<float, 2 * (kMaxReach + kPadding) + 1>;

  [[nodiscard]] static bool is_of_use(const CorrespondenceLine& line);
  void look_across(const ImageMeasurement& image, const CorrespondenceLine& line, int reach_px);
  [[nodiscard]] float contrast_at(int place, int centre_px, int side_px) const;
  [[nodiscard]] float noise_of(int count);
  void weigh(std::span<const CorrespondenceLine> lines, float usual);

  Greys greys_{};
  Greys steps_{};
  std::array<std::array<float, 2 * kMaxReach + 1>, kMaxCorrespondenceLines> contrast_{};  ///< of the usual
  std::array<float, kMaxCorrespondenceLines> noise_{};
  std::array<float, kMaxCorrespondenceLines> slope_{};
  std::array<float, kMaxCorrespondenceLines> peaks_{};
};

}  // namespace tubed
