#include "drivers/aurora/can_status.hpp"

namespace tubed::aurora {

std::string_view describe(CanTrackerState state) noexcept {
  switch (state) {
    case CanTrackerState::kMeasuring:
      return "measures";
    case CanTrackerState::kNoPort:
      return "cannot open the tracker's serial port: is its cable in, and no other program at it?";
    case CanTrackerState::kNoTracker:
      return "hears no tracker: is it on, and the serial cable in?";
    case CanTrackerState::kStarting:
      return "starts the tracker, which takes up to 15 s";
    case CanTrackerState::kNotMeasuring:
      return "gets no measurements from its tracker: its own log says why";
    case CanTrackerState::kGatewayEnds:
      return "was stopped: start it again";
  }
  return "reports an error that this version does not know: look at its own log";
}

}  // namespace tubed::aurora
