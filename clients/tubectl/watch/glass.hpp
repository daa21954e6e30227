// tubectl latency --glass: from light on a screen to the shape.
#pragma once

#include <string>
#include <vector>

#include "clients/cpp/subscription.hpp"

namespace tubed {

struct GlassArguments {
  std::string where;  ///< "terminal", or the path of a socket
  std::string camera = "A";
  std::vector<int> size_px{400, 600};  ///< width and height of the pictures, at a socket
  double duration_s = 10;
  double speed_mm_s = 10;
  bool as_json = false;
};

/// Flashes for the time asked for, prints what that took. The verb's exit code: kExitUnavailable when no
/// flash was answered, with what to look at. Throws what the screen throws, and DdsError.
int measure_glass(const GlassArguments& arguments, const Subscription& subscription);

}  // namespace tubed
