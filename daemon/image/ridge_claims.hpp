// Whose ridge is it, where a tube's projection passes beside itself?
#pragma once

#include <Eigen/Core>
#include <array>
#include <span>

#include "daemon/image/correspondence_line.hpp"

namespace tubed {

/// Lines of two stretches of one tube may find one ridge though they were expected apart: the fainter shaft
/// of an arch seen from its side loses its lines to the darker one beside it. Shafts seldom change places, so
/// the other ridge tells: it lies beyond the common one on the side of the stretch that has to go there.
/// Called by the optimizer thread, in the order find(), settle(). Memory is the object itself.
class RidgeClaims {
 public:
  enum class Verdict : unsigned char {
    kOwn,     ///< keeps what it found
    kOthers,  ///< has to look for another ridge on its own side
    kUnsure   ///< keeps what it found, though it may be another stretch's
  };

  /// Of a line. Offsets as in CorrespondenceLine.
  struct Claim {
    int rival = -1;            ///< line of another stretch that found the same ridge; -1: none
    double ridge_px = 0;       ///< where the ridge is along this line
    double half_width_px = 0;  ///< how far to either side it reaches
    int side = 0;              ///< on which side of the rival this line was expected: 1 or -1
    Verdict verdict = Verdict::kOwn;

    /// Whether an offset lies beyond the ridge, on this line's side.
    [[nodiscard]] bool is_beyond(double offset_px) const {
      return (offset_px - ridge_px) * side > half_width_px;
    }
  };

  using PerLine = std::array<bool, kMaxCorrespondenceLines>;

  /// Lines, neighbours along the tube next to each other, that have found one ridge with another stretch;
  /// whether there are any. `on_ridge[i]`: the image shows a ridge where lines[i] has found the tube; the
  /// others claim nothing.
  bool find(std::span<const CorrespondenceLine> lines, const PerLine& on_ridge);

  /// Fills the verdicts; whether a line has to look again. `sees_another[i]`: there is a ridge somewhere
  /// beyond(), asked of lines with a rival only.
  bool settle(std::span<const CorrespondenceLine> lines, const PerLine& sees_another);

  /// claims()[i] is of lines[i].
  [[nodiscard]] const std::array<Claim, kMaxCorrespondenceLines>& claims() const { return claims_; }

 private:
  /// A line that claims what it found.
  struct Found {
    int line = 0;
    int run_end = 0;  ///< place behind the last of those next to each other, without a gap, from this one on
    Eigen::Vector2d p_px = Eigen::Vector2d::Zero();
    double spacing_px = 0;  ///< to the lines next to it, along the tube as it was expected
  };

  void collect(std::span<const CorrespondenceLine> lines, const PerLine& on_ridge);
  [[nodiscard]] int rival_of(std::span<const CorrespondenceLine> lines, const Found& found) const;
  [[nodiscard]] int step_toward(double distance_px, int place) const;
  [[nodiscard]] bool mostly(const PerLine& sees_another, int line, int count) const;

  std::array<Claim, kMaxCorrespondenceLines> claims_{};
  std::array<Found, kMaxCorrespondenceLines> found_;
  int count_ = 0;
  double max_step_px_ = 1;  ///< from one of found_ to the next of its run
  double near_px_ = 0;      ///< beyond, nobody is beside a line
};

}  // namespace tubed
