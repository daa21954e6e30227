// What EM and image sources have in common: how opening and reading can end, and where data comes from.
#pragma once

#include <string>

namespace tubed {

/// Where measurements come from. Anything but a device marks every estimate it touches (DEMO_DATA,
/// REPLAY_DATA).
enum class Origin { kDevice, kSimulated, kReplayed };

/// How an attempt to open a source ended. `why` says in words what is wrong and what to do; empty when ok.
struct OpenResult {
  bool ok = false;
  std::string why;
};

/// How one read ended.
enum class ReadOutcome {
  kFrame,    ///< the frame was filled; there may be more
  kNothing,  ///< nothing has come: wait, then read again
  kRefused,  ///< something came that cannot be used (bad check sum, wrong size); counted, frame untouched
  kLost,     ///< the device is gone: close, then open again after a back-off
  kEnded,    ///< a recording is over: nothing will ever come again
};

}  // namespace tubed
