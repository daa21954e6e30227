#include "drivers/v4l2/card_words.hpp"

#include <array>
#include <cerrno>
#include <cstring>

namespace tubed {

CardWords describe_card_error(std::string_view path, std::string_view doing, int error) noexcept {
  CardWords words;
  words.printable(path);
  switch (error) {
    case ENOENT:
      return words << " is not there: plug the card in, or correct device; `tubectl doctor` lists the cards";
    case ENODEV:
    case ENXIO:
      return words << " has gone: its cable was pulled or its driver has failed";
    case EACCES:
    case EPERM:
      return words << " may not be opened by this user: `sudo usermod -aG video USER`, log in anew; a unit "
                      "needs DeviceAllow=char-video4linux rw";
    case EBUSY:
      return words << " is used by another program: close it (`fuser " << path << "` names it)";
    case ENOTTY:
      return words << " is no video device: correct device; `tubectl doctor` lists the cards";
    case ENOLINK:
      return words << ": no signal at its input: is the console on, and the cable in?";
    case ENOLCK:
      return words << ": the signal at its input is not stable: cable, splitter or a console that starts";
    case ERANGE:
      return words << ": the signal at its input has a size or rate that the card does not take: set the "
                      "console's output";
    default:
      break;
  }
  std::array<char, 64> room{};
  return words << ": " << doing << " failed: " << ::strerror_r(error, room.data(), room.size());
}

CardWords describe(PictureSize size) noexcept {
  CardWords words;
  return words << size.width << " x " << size.height;
}

}  // namespace tubed
