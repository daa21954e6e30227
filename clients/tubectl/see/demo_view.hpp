// The live picture of a demonstration in a terminal.
#pragma once

#include <termios.h>

#include <optional>
#include <string>

#include "clients/tubectl/see/demo_figures.hpp"

namespace tubed {

/// Puts the terminal into key-by-key mode with an empty screen, and back. One object at a time, one thread.
class LiveTerminal {
 public:
  LiveTerminal();
  ~LiveTerminal();
  LiveTerminal(const LiveTerminal&) = delete;
  LiveTerminal& operator=(const LiveTerminal&) = delete;
  /// The key pressed since, 0 for none.
  char key();

 private:
  termios before_{};
};

/// Newest shape of each instrument.
struct DemoShapes {
  std::optional<tubed_TubeEstimate> fused;
  std::optional<tubed_TubeEstimate> em;
  std::string notice;  ///< what the subscriber was told last, e.g. "deadline missed"
  std::string faults;  ///< what is switched on by keys
  std::string waiting{"waiting for the first shape ..."};  ///< said before it
};

/// The whole picture as text: two projections of the tube (as the camera sees it, and from the side),
/// validity, rate, latency, error. `rows` x `columns`: the terminal's size.
std::string draw_demo(const DemoFigures& figures, const DemoShapes& shapes, int rows, int columns);

}  // namespace tubed
