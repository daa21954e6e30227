// Images that would not help, because by what the room's description says the tube lies beside all of them.
#pragma once

#include <chrono>
#include <cstdio>
#include <span>

#include "drivers/interface/timestamps.hpp"

namespace tubed {

/// A value of the optimizer's thread. Shapes from coils alone may be right then, and VALID; but nobody would
/// know why images change nothing.
class TubeBesideViews {
 public:
  /// Images were measured, and any of the shapes lay within one of them, or none did.
  void saw(MonotonicTime exposure, bool in_view) {
    images_ = in_view ? 0 : images_ + 1;
    if (images_ == 1) since_ = exposure;
    newest_ = exposure;
  }

  /// One sentence for a person, zero-terminated and cut to the size of `words`. False, and nothing is
  /// written, unless images of five seconds, ten at least, have been so.
  [[nodiscard]] bool describe(std::span<char> words) const {
    if (images_ < kMinImages || newest_ - since_ < kAtLeast) return false;
    std::snprintf(
        words.data(), words.size(),
        "the tube has lain outside every image for %.0f s, by T_camera_world and T_world_em; if the images "
        "do show it, one of these is wrong: `tubectl check` of a recording looks for which",
        seconds_between(since_, newest_));
    return true;
  }

 private:
  static constexpr int kMinImages = 10;
  static constexpr std::chrono::seconds kAtLeast{5};

  MonotonicTime since_{};  ///< the first of the images beside it
  MonotonicTime newest_{};
  int images_ = 0;  ///< beside it, one after the other
};

}  // namespace tubed
