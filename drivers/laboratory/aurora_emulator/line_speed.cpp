#include "drivers/laboratory/aurora_emulator/line_speed.hpp"

// These declare another struct termios than <termios.h> does, so that a file can have one of them only.
#include <asm/ioctls.h>
#include <asm/termbits.h>
#include <sys/ioctl.h>

namespace tubed::aurora::emulator {

int line_speed(int descriptor) noexcept {
  termios2 settings{};
  return ::ioctl(descriptor, TCGETS2, &settings) == 0 ? static_cast<int>(settings.c_ospeed) : 0;
}

}  // namespace tubed::aurora::emulator
