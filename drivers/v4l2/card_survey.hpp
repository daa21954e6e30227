// What a card is and offers, asked without changing anything: a program that uses it is not disturbed.
#pragma once

#include <string>
#include <vector>

#include "drivers/v4l2/picture_shape.hpp"
#include "drivers/v4l2/video_device.hpp"

namespace tubed {

struct OfferedSize {
  PictureSize size;
  bool is_largest_of_many = false;  ///< any size up to this one
  double max_rate_hz = 0;           ///< 0: the card does not say
};

struct OfferedFormat {
  std::string name;      ///< as in format = "grey"; of others V4L2's four letters
  bool is_read = false;  ///< by this driver
  std::vector<OfferedSize> sizes;
};

struct OfferedInput {
  int number = 0;
  std::string name;
  bool has_signal = true;   ///< true as well where the card cannot tell
  PictureSize signal_size;  ///< of the chosen input's signal; 0 x 0: not known
};

/// Texts are the card's, made printable.
struct CardOffer {
  std::string path;
  int error = 0;  ///< errno of opening it; all below is empty then
  bool captures = false;
  std::string name;
  std::string driver;
  std::string bus;
  std::vector<OfferedFormat> formats;
  std::vector<OfferedInput> inputs;
  int input = 0;     ///< the chosen one
  PictureSize size;  ///< as it is set now
};

/// Opens `device`, asks, and closes it. At most 32 formats, sizes of each, and inputs.
CardOffer survey_card(VideoDevice& device, const std::string& path);

/// One line for a person: name, driver, signal, and the formats that are read with their largest size and
/// rate.
std::string describe(const CardOffer& offer);

}  // namespace tubed
