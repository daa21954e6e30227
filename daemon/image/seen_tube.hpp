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

 private:
  std::bitset<kMaxCorrespondenceLines> agreeing_;
  int count_ = 0;
  double spacing_mm_ = 1;
};

}  // namespace tubed
