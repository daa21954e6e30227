// Three ways to read grey pictures of a capture card in a program: this project's driver, OpenCV and
// GStreamer.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace tubed {

/// What is read, as the card delivers it.
struct CardFormat {
  std::string device;  ///< path
  std::string fourcc;  ///< "MJPG" or "Y16 "
  int width = 0, height = 0;
  int rate_hz = 30;
};

/// Called with the grey pixels, 8 or 16 bits as the card's, as soon as a program has them; false: enough.
using OnPicture = std::function<bool(const std::uint8_t* pixels, std::size_t bytes)>;

/// Reads pictures until it is enough. Throws std::runtime_error when there is nothing to read.
struct Consumer {
  std::string name;
  std::string missing;  ///< what to install, where it was not built; empty: it was
  void (*read)(const CardFormat&, const OnPicture&) = nullptr;
};

/// The project's own first.
const std::vector<Consumer>& consumers();

void read_by_driver(const CardFormat& format, const OnPicture& on_picture);
void read_by_opencv(const CardFormat& format, const OnPicture& on_picture);
void read_by_gstreamer(const CardFormat& format, const OnPicture& on_picture);

}  // namespace tubed
