// Loaded in front of the C library (LD_PRELOAD): what adjtimex() answers one process stands in the file
// KERNEL_CLOCK, which may change while the process runs: "followed", "free" or "refused".
#include <sys/timex.h>

#include <cerrno>
#include <cstdlib>
#include <fstream>
#include <string>

extern "C" int adjtimex(timex* state) noexcept {
  const char* file = std::getenv("KERNEL_CLOCK");
  std::string word;
  if (file != nullptr) std::ifstream(file) >> word;
  if (word == "refused") {
    errno = EPERM;
    return -1;
  }
  *state = timex{};
  state->status = word == "followed" ? STA_PLL : STA_UNSYNC;
  return word == "followed" ? TIME_OK : TIME_ERROR;
}
