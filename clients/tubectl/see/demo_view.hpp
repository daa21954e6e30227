// The live picture of a demonstration in a terminal.
#pragma once

#include <termios.h>

#include <optional>
#include <string>

#include "clients/pictures/grey_picture.hpp"
#include "clients/tubectl/see/demo_figures.hpp"
#include "clients/tubectl/see/terminal_images.hpp"
#include "idl/geometry/camera.hpp"

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
  [[nodiscard]] const TerminalAbility& ability() const { return ability_; }

 private:
  static std::string ask();

  termios before_{};
  TerminalAbility ability_;
};

/// Newest shape of each instrument.
struct DemoShapes {
  std::optional<tubed_TubeEstimate> fused;
  std::optional<tubed_TubeEstimate> em;
  std::string notice;                   ///< what the subscriber was told last, e.g. "deadline missed"
  std::string faults;                   ///< what is switched on by keys
  std::optional<double> side_depth_mm;  ///< in front of the camera, in the middle of the view from the side
  std::string waiting{"waiting for the first shape ..."};  ///< said before it
};

/// What is drawn on.
struct DemoScreen {
  int rows = 40;  ///< of characters
  int columns = 100;
  TerminalAbility ability;
  const GreyPicture* image = nullptr;    ///< of the first camera; null: there is none, or it is not wanted
  std::optional<ViewGeometry> geometry;  ///< of the image; nothing: the configuration's
  bool shows_help = false;
};

/// The whole picture as text: the image with the projected tube, the tube from the side, validity, rate,
/// latency, error; or what all that means, and the keys.
std::string draw_demo(const DemoFigures& figures, const DemoShapes& shapes, const DemoScreen& screen);

/// Of the tube in front of the camera, mm; nothing without a shape.
std::optional<double> mean_depth_mm(const Camera& camera, const tubed_TubeEstimate& estimate);

}  // namespace tubed
