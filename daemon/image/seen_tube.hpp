// Along which stretches of a tube an image shows it.
#pragma once

#include <bitset>
#include <span>

#include "daemon/image/correspondence_line.hpp"

namespace tubed {

/// What the lines of one image found, kept by arc length. Never allocates.
class SeenTube {
 public:
  /// Of lines that have been searched, the first at the tip, spacing_mm apart along the tube; at most
  /// kMaxCorrespondenceLines.
  void record(std::span<const CorrespondenceLine> lines, double spacing_mm);

  /// Do most of the lines agree that lie up to two lines before and behind this place, mm from the tip?
  /// Beyond either end of the tube: at that end.
  [[nodiscard]] bool at(double s_mm) const;

  enum class Toward { kTip, kTail };
  struct Followed {
    double to_mm;  ///< from the tip; where it began if it cannot be followed at all
    /// From there to here 30 mm and more are in view, and most of them do not show it. to_mm: nowhere.
    double lost_to_mm;
  };
  /// How far it can be followed from a place on the tube without a gap: as long as seven of the next ten
  /// lines agree.
  [[nodiscard]] Followed followed(double from_mm, Toward toward) const;

 private:
  struct Stretch {
    int lines = 0;
    int in_view = 0;
    int agreeing = 0;
    int last_in_view = 0;
  };
  [[nodiscard]] bool is_line(int line) const { return line >= 0 && line < count_; }
  [[nodiscard]] Stretch stretch(int line, int step, int most) const;

  std::bitset<kMaxCorrespondenceLines> in_view_;
  std::bitset<kMaxCorrespondenceLines> agreeing_;  ///< and in view
  int count_ = 0;
  double spacing_mm_ = 1;
};

}  // namespace tubed
